"""Guidepaths with bends: curves, certificates, runs in both worlds."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import factory
from factory.apps.exports.stock import written as stock
from factory.engine.mjcf.loading import load
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.curves import Curves
from factory.floor.layout.bending import Detour, bent
from factory.floor.layout.embedding import certified
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import FAR, Bend, Ways
from factory.support.errors import RunError
from factory.support.settings import Settings
from tests.examples import without_hands

ROUND = 0.063


@pytest.fixture(scope="module")
def straight() -> Layout:
    """The lamp, whose base is fetched by r9."""
    return without_hands("lamp")


def detour(layout: Layout, robot: int, further: float, at: float) -> Layout:
    """A robot goes 0.2 m to its right, and so much further besides."""
    travel = round(layout.guidepaths[robot].travel + 0.2 + further, 6)
    return bent(layout, {robot: Detour(travel, (Bend(at, -0.2),), ROUND)})


@pytest.fixture(scope="module")
def layout(straight: Layout) -> Layout:
    """The lamp with a bend in the guidepath of r9."""
    return certified(detour(straight, 8, 0.2, 0.15))


def test_a_curve_moves_as_many_joints_as_it_has_dimensions() -> None:
    """Axis 1 of four moves joints 1, 4 and 5, and axis 3 moves joints 3, 6 and 7: each along a line
    in space."""
    along = np.array([[2.0, -1.0, 2.0], [-6.0, 2.0, 3.0]]) / [[3.0], [7.0]]
    terms = np.zeros((2, 1, 3, 3))
    terms[:, 0, 1] = along
    ways = Ways(np.array([[-FAR, FAR]] * 2), np.zeros((2, 1)), terms, np.ones(2))
    index, joints = np.array([1, 3]), np.array([[1, 4, 5], [3, 6, 7]])
    row = np.array([-1, 0, -1, 1])
    curves = Curves(
        index, ways, None, np.arange(2), np.zeros(2), row, joints, joints, joints[:, 1:]
    )
    x, v = np.array([0.3, -0.2]), np.array([0.5, 0.7])
    askew = np.cross(along, [0.0, 0.0, 0.1])  # beside the lines: not seen
    for found, known in zip(
        curves.along(along * x[:, None] + askew, along * v[:, None] - askew), (x, v), strict=True
    ):
        assert found == pytest.approx(known)
    away = ways.apart(along * x[:, None] + askew)
    assert away == pytest.approx(np.linalg.norm(askew, axis=1))
    spread = curves.spread(np.zeros(4), np.array([[1.0, 2.0, 3.0, 4.0]]))[0]
    assert spread[[0, 2]].tolist() == [1.0, 3.0]
    assert spread[joints] == pytest.approx(along * [[2.0], [4.0]])
    which, rows = curves.among(np.array([3, 0, 1]))
    assert which.tolist() == [0, 2]
    assert curves.further(rows).tolist() == [2, 3, 0, 1]


def test_a_corner_at_the_junction_is_refused(straight: Layout) -> None:
    with pytest.raises(RunError, match="r9: the corners of its guidepath are not 126 mm apart"):
        certified(detour(straight, 8, 0.2, 0.1))


def test_a_urdf_has_both_slides_of_a_robot_on_a_bend(layout: Layout, tmp_path: Path) -> None:
    """MuJoCo reads it, and puts all bodies where they are in the written model."""
    file = tmp_path / "lamp.urdf"
    factory.export(layout, "urdf", file)
    one = load(stock(physical_model(layout, 1, Settings())))
    other = mujoco.MjModel.from_xml_path(str(file))
    here, there = mujoco.MjData(one), mujoco.MjData(other)
    for name, value in (("r9/slide", 0.3), ("r9/slide_across", -0.07)):
        here.joint(name).qpos[0] = there.joint(name).qpos[0] = value
    for m, d in ((one, here), (other, there)):
        mujoco.mj_kinematics(m, d)
    for name in ("r9/carriage", "r9/shell"):
        assert np.allclose(here.body(name).xpos, there.body(name).xpos, atol=1e-9)
