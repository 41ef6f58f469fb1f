"""The friction of guides follows what they carry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from factory.apps.disturbance import Friction, disturb
from factory.engine.mjcf.driving import GRAVITY, ROLLING
from factory.engine.record.state import State
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.theory.problem.robot_bodies import FRICTION
from tests.good_runs import random_marking
from tests.simulation_values import layout_of, ready


def carried(world: Any) -> np.ndarray:
    """What the weights of loads add to the friction of each axis [N], by what hands hold."""
    axes, loads = world.motion.axes, np.zeros(len(world.motion.axes))
    for robot, load in world.parts.holdings.loads().items():
        loads[robot] = load
    if world.parts.on_tray is not None:
        loads[axes.tray] = world.model.masses[world.model.factory.pag.root]
    return np.asarray(ROLLING * GRAVITY * loads)


def followed(simulation: Simulation, empty: Any) -> list[bytes]:
    """Runs, and gives the different frictions that were seen, all of them right."""
    seen = dict[bytes, None]()

    world = simulation.physical

    def observe(_: State) -> None:
        found = world.m.dof_frictionloss[world.motion.axes.dof]
        assert found == pytest.approx(empty + carried(world), rel=1e-12, abs=0)
        seen[found.tobytes()] = None

    assert simulation.run([observe]).trouble is None
    return list(seen)


@pytest.mark.parametrize(("name", "given"), [("paper", {}), ("fence", {}), ("20", {"fuse": True})])
def test_it_is_switched_with_every_hand_over(name: str, given: dict[str, Any]) -> None:
    simulation = ready(name, **given)
    assert len(followed(simulation, FRICTION)) > len(simulation.layout.factory.leaves)


def test_robots_that_run_their_programs_have_it_too() -> None:
    assert len(followed(ready("paper", distributed=True), FRICTION)) > 7


def test_a_run_that_begins_under_way_begins_with_it() -> None:
    """From a marking in which robots hold parts."""
    later = ready("paper", start=random_marking(layout_of("paper"), 3))
    assert carried(later.physical).any()
    followed(later, FRICTION)


def test_what_is_rubbed_rubs_more_under_a_load() -> None:
    simulation = disturb(ready("paper"), Friction(0.5, ("r1",)))
    followed(simulation, np.array([0.5, *[FRICTION] * (len(simulation.physical.motion.axes) - 1)]))


def test_a_loaded_robot_that_coasts_is_slowed_by_it() -> None:
    """The engine takes as much of its momentum as the formula says."""
    simulation = ready("20")
    world = simulation.physical
    while not (
        world.motion.drives.mass[0] > world.motion.drives.own[0] and 0 in world.motion.active
    ):
        simulation.supervisor.step()
    m, d, axes = world.m, world.d, world.motion.axes
    loss = m.dof_frictionloss[axes.dof[0]]
    assert loss > 1.2 * FRICTION
    row = np.flatnonzero(d.efc_type == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
    ids = d.efc_id[row]
    force = np.abs(d.efc_force[row[ids == axes.dof[0]]])
    assert force == pytest.approx(loss)
