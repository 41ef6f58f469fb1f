"""The drawn model moves as the run's does, and nothing drawn lies outside what is solid."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import dress
from factory.film.drawn import drawn
from factory.film.lettering import GLYPHS, height, lettering
from factory.film.outfits import OUT
from factory.film.smoothing import smooth
from factory.support.engine import mujoco
from tests.examples import with_hands

EXAMPLES = ("paper", "lamp", "truck")

WALLS = {*dress.MAGAZINE, *dress.SHED}
"""The solids that a housing is drawn in the stead of."""

STANDS_OUT = {"outfeed/sides/skin": dress.BESIDE}
"""What is drawn further outside of what is solid than windows and words are [m]."""


@cache
def models(name: str) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model of a run of an example, and its drawn model."""
    simulation = Simulation(with_hands(name), RunRequest(units=1))
    m, made = simulation.physical.m, simulation.model
    return m, drawn(m, made.xml, made.files, "overview")


@pytest.mark.parametrize("name", EXAMPLES)
def test_bodies_are_where_those_of_the_run_are(name: str) -> None:
    m, seen = models(name)
    assert (m.nq, m.nbody, m.neq) == (seen.nq, seen.nbody, seen.neq)
    assert [m.body(b).name for b in range(m.nbody)] == [seen.body(b).name for b in range(m.nbody)]
    one, other = Replica(m), Replica(seen)
    rng = np.random.default_rng(1)
    for _ in range(5):
        qpos = m.qpos0 + rng.normal(0.0, 0.1, m.nq)
        one.place(qpos)
        other.place(qpos)
        assert np.array_equal(one.d.xpos, other.d.xpos)


def outside(m: mujoco.MjModel, seen: mujoco.MjModel) -> Iterator[tuple[str, float]]:
    """How far each geom that only the drawn model has stands out of the solids of its body, or of
    that on which it is carried [m]."""
    d, worn = Replica(m).d, Replica(seen).d
    solid = {m.geom(g).name: g for g in range(m.ngeom) if m.geom_group[g] < SHOWN}
    for g in range(seen.ngeom):
        name = seen.geom(g).name
        if name in solid or seen.geom_group[g] >= SHOWN or seen.geom_dataid[g] < 0:
            continue
        mesh = seen.mesh(int(seen.geom_dataid[g]))
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        points = np.asarray(seen.mesh_vert[first : first + count], float)
        points = points @ worn.geom_xmat[g].reshape(3, 3).T + worn.geom_xpos[g]
        body = int(seen.geom_bodyid[g])
        near = [k for k in solid.values() if m.geom_bodyid[k] == body]
        if "/housing/" in name:  # its walls, and what they enclose
            walls = [k for k in near if m.geom(k).name.rpartition("/")[2] in WALLS]
            at = (points - d.xpos[body]) @ d.xmat[body].reshape(3, 3)
            low = (m.geom_pos[walls] - m.geom_size[walls]).min(axis=0)
            high = (m.geom_pos[walls] + m.geom_size[walls]).max(axis=0)
            yield name, float(np.linalg.norm(at - at.clip(low, high), axis=1).max())
            continue
        yield name, float(np.min([away(m, d, k, points) for k in near], axis=0).max())


def away(m: mujoco.MjModel, d: mujoco.MjData, geom: int, points: np.ndarray) -> np.ndarray:
    """The distance of points (n, 3) from a box or a cylinder, 0 within it [m]."""
    at = (points - d.geom_xpos[geom]) @ d.geom_xmat[geom].reshape(3, 3)
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radius, half = m.geom_size[geom, :2]
        at = np.stack([np.hypot(at[:, 0], at[:, 1]) - radius, np.abs(at[:, 2]) - half], axis=1)
        return np.linalg.norm(np.maximum(at, 0.0), axis=1)
    return np.linalg.norm(np.maximum(np.abs(at) - m.geom_size[geom], 0.0), axis=1)


@pytest.mark.parametrize("name", EXAMPLES)
def test_nothing_drawn_lies_outside_what_is_solid(name: str) -> None:
    for geom, far in outside(*models(name)):
        assert far <= STANDS_OUT.get(geom, OUT) + 1e-5, geom


@given(text=st.text(st.sampled_from([*GLYPHS, *"abc ÄÉß"]), min_size=1, max_size=9))
def test_letters_fill_their_height_and_width(text: str) -> None:
    made = lettering(text, 1.0)
    if made is None:
        assert not text.strip(" ß")
        return
    low, high = made.skin.at.min(axis=0), made.skin.at.max(axis=0)
    assert (np.abs([low[1], high[1]]) <= 0.5 + 0.2).all()
    assert np.abs([low[0], high[0]]).max() <= made.wide / 2 + 0.2
    assert made.wide * height(text, 0.3, 1.0) <= 0.3 + 1e-9
    a, b, c = (made.skin.at[made.skin.face[:, k], :2] for k in range(3))
    (one, two), (three, four) = (b - a).T, (c - a).T
    assert (one * four - two * three >= -1e-9).all()  # all seen from above


def test_accents_are_left_out() -> None:
    one, other = lettering("ÄB", 1.0), lettering("AB", 1.0)
    assert one is not None and other is not None
    assert np.array_equal(one.skin.at, other.skin.at)


def test_a_stair_becomes_an_edge() -> None:
    """The mean error of a half plane that was drawn with one sample a pixel falls."""
    slope = -0.4
    y, x = np.mgrid[:60, :80] + 0.5
    fine = np.mean([(y + v - 30) > slope * (x + u - 40) for u in OFFSETS for v in OFFSETS], axis=0)[
        ..., None
    ]
    true = 90 + 140 * np.repeat(fine, 3, axis=2)
    drawn_once = np.where((y - 30) > slope * (x - 40), 230, 90).astype(np.uint8)
    picture = np.repeat(drawn_once[..., None], 3, axis=2)
    inner = np.s_[12:-12, 12:-12]
    before, after = (np.abs(p[inner] - true[inner]).sum() for p in (picture, smooth(picture)))
    assert after < 0.7 * before


OFFSETS = np.linspace(-0.45, 0.45, 10)


def test_what_is_flat_stays_as_it_is() -> None:
    picture = np.full((30, 40, 3), 200, np.uint8)
    picture[:, 20:] -= 5
    assert np.array_equal(smooth(picture), picture)
