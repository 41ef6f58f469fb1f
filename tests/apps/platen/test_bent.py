"""Guidepaths with bends: curves, certificates, runs in both worlds."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest

import factory
from factory.apps.exports.stock import written as stock
from factory.apps.fidelity.measuring import Measurement
from factory.apps.monitor import beside
from factory.engine.mjcf.loading import load
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.curves import Curves
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.bending import Detour, bent
from factory.floor.layout.certificate import MILLI
from factory.floor.layout.dimensions import up
from factory.floor.layout.embedding import certified
from factory.floor.layout.feeding import cleared
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import FAR, Bend, Ways, rounding_for, way_of
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


WAYS = Ways.of([(Bend(0.2, 0.3), Bend(0.8, -0.2)), (), (Bend(0.3, -0.15),)], [0.05, 0.0, 0.07])


def test_a_way_is_smooth_and_no_faster_than_its_coordinate() -> None:
    x = np.linspace(-0.2, 1.6, 4001)
    for row, rounding in ((0, 0.05), (1, 1.0), (2, 0.07)):
        place, first, second = WAYS.at(np.full(len(x), row), x)
        assert np.abs(np.gradient(place, x, axis=0)[1:-1] - first[1:-1]).max() < 3e-3
        assert np.abs(np.diff(first, axis=0)).max() <= 4.6e-4 / 2 / rounding + 1e-9
        assert np.linalg.norm(first, axis=1).max() <= 1 + 1e-12
        assert np.abs(second).max() <= 1 / (2 * rounding) + 1e-9
    ends, _, _ = WAYS.at(np.array([0, 1, 2]), np.array([1.6, 1.6, 1.6]))
    assert ends == pytest.approx(np.array([[1.1, 0.1], [1.6, 0.0], [1.45, -0.15]]))


def test_the_nearest_point_of_a_place_on_a_way_is_that_place() -> None:
    for x in np.linspace(-0.1, 1.5, 321):
        at = np.full(3, x)
        place, first, _ = WAYS.at(np.arange(3), at)
        for found, known in zip(WAYS.nearest(place), (at, first), strict=True):
            assert np.abs(found - known).max() < 1e-12


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


def test_a_way_lies_in_its_pieces() -> None:
    for low, high in ((0.0, 1.5), (0.17, 0.21), (0.49, 0.52)):
        x = np.linspace(low, high, 500)
        place, _, _ = WAYS.at(np.zeros(500, int), x)
        pieces = [*WAYS.pieces(0, low, high)]
        boxes = [(p.min(axis=0) - 1e-9, p.max(axis=0) + 1e-9) for p in pieces]
        inside = [((place >= a) & (place <= b)).all(axis=1) for a, b in boxes]
        assert np.any(inside, axis=0).all()
        for one, other in pairwise(pieces):
            assert one[-1] == pytest.approx(other[0])


def test_at_the_rounding_for_a_speed_no_axis_accelerates_more() -> None:
    speed, acceleration = 0.5, 2.0
    _, _, second = way_of((Bend(0.2, 0.3),), rounding_for(speed, acceleration)).at(
        np.array([0]), np.array([0.2])
    )
    assert 0.98 * acceleration < np.abs(second).max() * speed**2 <= acceleration


def test_a_bend_keeps_the_branch_and_the_junction(straight: Layout, layout: Layout) -> None:
    old, new = straight.guidepaths[8], layout.guidepaths[8]
    assert new.a == old.a
    assert new.middle(new.reach) == pytest.approx(old.middle(old.reach))
    x, y = np.subtract(new.middle(new.length), old.middle(old.length))
    (u, v), (s, t) = old.heading, old.side
    assert (x, y) == pytest.approx((-0.2 * u - 0.2 * s, -0.2 * v - 0.2 * t))


@pytest.mark.parametrize("tick", ["mujoco", "distributed", "ideal"])
def test_a_factory_with_a_bend_runs(layout: Layout, tick: str) -> None:
    world = "ideal" if tick == "ideal" else "mujoco"
    distributed = tick == "distributed"
    run = factory.run(layout, units=2, world=world, distributed=distributed)
    assert run.succeeded and run.refines_net
    if world == "mujoco":
        assert run.physics.unintended_contacts == 0
        assert run.physics.handoff_gap_max_mm < 0.1
        assert run.physics.product_error_max_mm < 0.01


def test_a_guidepath_may_end_across_its_heading(straight: Layout) -> None:
    """Its robot leaves the feeder sideways, and stands there between its stops."""
    reach = straight.guidepaths[8].reach
    corner = Bend(round(reach + 0.03, 3), -2.0)
    travel = up(corner.at + 0.02 + cleared(straight, 8, 1.0) - reach)
    layout = certified(bent(straight, {8: Detour(travel, (corner,), 0.02)}))
    assert layout.guidepaths[8].sideways == 1.0
    run = factory.run(layout, units=2)
    assert run.succeeded and run.physics.unintended_contacts == 0
    assert run.physics.handoff_gap_max_mm < 0.1


def test_a_robot_on_a_bend_follows_its_reference(layout: Layout) -> None:
    request = RunRequest(units=2, settings=Settings(timestep=0.005))
    measured = Measurement(Simulation(layout, request))
    run = measured.run()
    assert run.succeeded and run.monitor is not None and not run.monitor.violations
    assert 0 < measured.drives.error * MILLI < 0.2


def test_a_corner_where_the_next_part_comes_down_is_refused(straight: Layout) -> None:
    with pytest.raises(RunError, match="magazine of r9"):
        certified(detour(straight, 8, 0.0, 0.15))


def test_a_corner_at_the_junction_is_refused(straight: Layout) -> None:
    with pytest.raises(RunError, match="r9: the corners of its guidepath are not 126 mm apart"):
        certified(detour(straight, 8, 0.2, 0.1))


def test_a_monitor_sees_where_a_robot_on_a_bend_is(layout: Layout) -> None:
    simulation = Simulation(layout, RunRequest(units=1, settings=Settings()))
    monitor = beside(simulation)
    run = simulation.run([monitor.observe])
    assert not monitor.report(run.lasting).violations
    moved = Simulation(layout, RunRequest(units=1, settings=Settings()))
    blind = beside(moved)
    blind.anatomy.bent.ways.ends[0, 1:-1] += 0.05
    blind.anatomy.bent.ways.middle[0, 1:] += 0.05
    run = moved.run([blind.observe])
    assert blind.report(run.lasting).violations


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
