"""What a model shows in any viewer: all of the factory, faces that do not flicker, and the numbers
of its robots."""

from __future__ import annotations

from itertools import combinations
from math import radians, tan

import mujoco
import numpy as np
import pytest

from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.replica import SHOWN
from factory.engine.mjcf.robot_bodies import DIGITS, STROKES
from factory.engine.simulation.modelling import physical_model
from factory.floor.layout.layout import Layout
from tests.examples import with_hands

EXAMPLES = ["paper", "lamp", pytest.param("gearbox", marks=pytest.mark.slow)]


@pytest.fixture(scope="module")
def made(request: pytest.FixtureRequest) -> tuple[Layout, Model, mujoco.MjModel, mujoco.MjData]:
    layout = with_hands(request.param)
    model = physical_model(layout)
    m = load(model)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    return layout, model, m, d


def corners(m: mujoco.MjModel, d: mujoco.MjData) -> np.ndarray:
    """The corners of the boxes round all that is drawn of the factory (n, 3), the floor aside."""
    seen = (m.geom_group < SHOWN) & (d.geom_xpos[:, 2] > -0.01) & (m.geom_type > 0)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    return np.concatenate(
        [
            d.geom_xpos[g]
            + (m.geom_aabb[g, :3] + signs * m.geom_aabb[g, 3:]) @ d.geom_xmat[g].reshape(3, 3).T
            for g in np.flatnonzero(seen)
        ]
    )


def within(points: np.ndarray, position: np.ndarray, axes: np.ndarray, field: float) -> float:
    """How much of the height of a picture, and of its width at 4:3, points take: 1 is the edge."""
    right, up, ahead = axes @ (points - position).T
    assert (ahead > 0).all()
    tall = tan(radians(field / 2))
    return float(max(np.abs(up / ahead / tall).max(), np.abs(right / ahead / tall).max() * 3 / 4))


@pytest.mark.parametrize("made", EXAMPLES, indirect=True)
def test_cameras_and_a_viewer_begin_with_the_whole_factory(made: tuple) -> None:
    _, _, m, d = made
    points, field = corners(m, d), m.vis.global_.fovy
    for name in ("overview", "top"):
        camera = m.camera(name).id
        right, up, back = d.cam_xmat[camera].reshape(3, 3).T
        used = within(points, d.cam_xpos[camera], np.array([right, up, -back]), m.cam_fovy[camera])
        assert 0.7 < used < 1.0
    free = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(m, free)
    azimuth, elevation = np.radians([free.azimuth, free.elevation])
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)]) * np.cos(elevation)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    axes = np.array([right, np.cross(right, ahead), ahead])
    assert 0.7 < within(points, free.lookat - free.distance * ahead, axes, field) < 1.0


@pytest.mark.parametrize("made", EXAMPLES, indirect=True)
def test_no_faces_are_drawn_in_one_place(made: tuple) -> None:
    """Two boxes whose faces are in one plane and look the same way flicker, as a tower did on
    its mast, and where two that are faded overlap."""
    _, _, m, d = made
    box = m.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    turn = np.abs(d.geom_xmat.reshape(-1, 3, 3))
    straight = np.isclose(np.sort(turn.reshape(-1, 9))[:, -3:], 1, atol=1e-6).all(axis=1)
    drawn = np.flatnonzero(box & straight & (m.geom_group < SHOWN) & (d.geom_xpos[:, 2] > 0))
    half = np.einsum("gij,gj->gi", turn, m.geom_size)
    low, high = d.geom_xpos - half, d.geom_xpos + half
    found = []
    for one, other in combinations(drawn.tolist(), 2):
        shared = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
        for axis in range(3):
            if (np.delete(shared, axis) < 1e-5).any():
                continue
            ends = (low[one, axis], low[other, axis]), (high[one, axis], high[other, axis])
            if any(abs(a - b) < 2e-5 for a, b in ends):
                found.append((m.geom(one).name, m.geom(other).name))
    hidden = {pair for pair in found if pair[0].endswith("/mast") and pair[1].endswith("/arm")}
    assert set(found) - hidden == set()  # that face is below the mast's cap


@pytest.mark.parametrize("made", ["paper", "lamp"], indirect=True)
def test_robots_carry_their_numbers(made: tuple) -> None:
    """On top and on the four sides of the carriage, upright; they weigh nothing and touch nothing,
    and are not in the model of a run that is not shown."""
    layout, _, m, d = made
    for robot in layout.factory.robots:
        geom, box = m.geom(f"{robot.name}/number"), m.geom(f"{robot.name}/carriage")
        assert not geom.contype[0] and not geom.conaffinity[0] and geom.group[0] == 1
        mesh = m.mesh(geom.dataid[0])
        strokes = sum(len(DIGITS[int(digit)]) for digit in robot.name[1:])
        assert mesh.facenum[0] == 5 * strokes * 2
        start, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        places = m.mesh_vert[start : start + count] @ d.geom_xmat[geom.id].reshape(3, 3).T
        places = places + d.geom_xpos[geom.id]
        out = np.abs(places - d.geom_xpos[box.id]) - box.size
        assert (out.max(axis=1) > 0).all() and (out < 1e-3).all()
        on_top = places[:, 2] > d.geom_xpos[box.id][2] + box.size[2]
        assert np.ptp(places[on_top, 1]) > 0.009  # read from the south
    bare = load(physical_model(layout, shown=False))
    assert not any(bare.geom(g).name.endswith("/number") for g in range(bare.ngeom))
    assert not any(bare.mesh(n).name.startswith("number/") for n in range(bare.nmesh))


def test_digits_differ() -> None:
    assert len(set(DIGITS)) == 10
    assert {stroke for digit in DIGITS for stroke in digit} == set(STROKES)
