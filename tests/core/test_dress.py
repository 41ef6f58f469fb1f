"""The drawn model moves as the run's does, and nothing drawn lies outside what is solid."""

from __future__ import annotations

from functools import cache

from factory.engine.mjcf.replica import SHOWN
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import dress
from factory.film.drawn import drawn
from factory.support.engine import mujoco
from tests.examples import with_hands

WALLS = {*dress.MAGAZINE, *dress.SHED}
"""The solids that a housing is drawn in the stead of."""


@cache
def models(name: str) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model of a run of an example, and its drawn model."""
    simulation = Simulation(with_hands(name), RunRequest(units=1))
    m, made = simulation.physical.m, simulation.model
    return m, drawn(m, made.xml, made.files, "overview")


def test_walls_are_not_drawn_where_a_housing_is() -> None:
    _, seen = models("paper")
    walls = [n for n in range(seen.ngeom) if seen.geom(n).name.rpartition("/")[2] in WALLS]
    assert walls and (seen.geom_group[walls] == SHOWN).all()
