"""Platens: bends that are searched for, tiles, and what is made of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

import factory
from factory.apps.exports.stock import write
from factory.apps.platen import compacting
from factory.apps.platen.compacting import compacted
from factory.apps.platen.placing import Floor, Placing
from factory.apps.platen.platen import on_platen
from factory.engine.mjcf.loading import load
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.curves import Curves
from factory.floor.layout.bending import Detour, bent
from factory.floor.layout.certificate import Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.durations import Pace
from factory.floor.layout.embedding import certified
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import regions
from factory.floor.layout.way import FAR, Bend, Ways
from factory.support.errors import InputError, RunError
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.examples import with_hands, without_hands
from tests.layout_values import paper_layout
from tests.paths import ROOT

PACE = Pace()


@pytest.fixture(scope="module")
def straight() -> Layout:
    """The truck on rails."""
    return with_hands("truck")


def crowded(layout: Layout) -> Iterator[tuple[Region, Region]]:
    return Crowding(layout).crowded(regions(layout))


def test_branches_that_come_too_near_are_seen(straight: Layout) -> None:
    """r13's branch on that of r6, moved there by a bend."""
    path = straight.guidepaths[12]
    travel = round(path.travel + 0.55, 3)
    for across in (0.5, -0.5):
        ground = Floor(straight)
        placing = Placing(ground, {}).changed(12, Detour(travel, (Bend(0.2, across),), 0.02), [12])
        placing.look([12])
        layout = certified_or_none(straight, placing)
        assert bool(placing.deep.any()) == (layout is None)


def certified_or_none(straight: Layout, placing: Placing) -> Layout | None:
    from factory.floor.layout.bending import bent

    layout = bent(straight, placing.detours)
    return None if [*crowded(layout)] else layout


def test_a_search_is_the_same_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    stool = with_hands("stool")
    monkeypatch.setattr(compacting, "TRIES", 10)
    one, other = (compacted(stool, PACE) for _ in range(2))
    assert one and [a.guidepaths for a in one] == [b.guidepaths for b in other]


def test_a_platen_needs_its_floor(straight: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compacting, "TRIES", 0)
    with pytest.raises(RunError, match=r"takes 2\.\d+ x 1\.\d+ m of floor"):
        on_platen(straight, PACE, 0.24, (2.0, 1.0))


def test_a_platen_goes_with_no_relays() -> None:
    product = factory.load_pag(ROOT / "examples" / "paper.pag")
    with pytest.raises(InputError, match="--platen cannot be combined with --relay"):
        factory.lay_out(product, relay=True, tile=0.24)


def test_a_build_tells_its_tiles(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compacting, "TRIES", 10)
    file, to = ROOT / "examples" / "paper.pag", tmp_path / "paper.xml"
    document = run("build", file, "--tile", "0.12", "-o", to, "--json").json
    assert document["tile_m"] == 0.12
    assert document["tiles"] > 10
    assert 0.2 < document["fill"] < 1.0


ROUND = 0.063


@pytest.fixture(scope="module")
def on_rails() -> Layout:
    """The lamp, whose base is fetched by r9."""
    return without_hands("lamp")


def detour(layout: Layout, robot: int, further: float, at: float) -> Layout:
    """A robot goes 0.2 m to its right, and so much further besides."""
    travel = round(layout.guidepaths[robot].travel + 0.2 + further, 6)
    return bent(layout, {robot: Detour(travel, (Bend(at, -0.2),), ROUND)})


@pytest.fixture(scope="module")
def layout(on_rails: Layout) -> Layout:
    """The lamp with a bend in the guidepath of r9."""
    return certified(detour(on_rails, 8, 0.2, 0.15))


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


def test_a_corner_at_the_junction_is_refused(on_rails: Layout) -> None:
    with pytest.raises(RunError, match="r9: the corners of its guidepath are not 126 mm apart"):
        certified(detour(on_rails, 8, 0.2, 0.1))


def test_a_urdf_has_both_slides_of_a_robot_on_a_bend(layout: Layout, tmp_path: Path) -> None:
    """MuJoCo reads it, and puts all bodies where they are in the written model."""
    file = tmp_path / "lamp.urdf"
    factory.export(layout, "urdf", file)
    one = load(physical_model(layout, 1, Settings(), finish=write))
    other = mujoco.MjModel.from_xml_path(str(file))
    here, there = mujoco.MjData(one), mujoco.MjData(other)
    for name, value in (("r9/slide", 0.3), ("r9/slide_across", -0.07)):
        here.joint(name).qpos[0] = there.joint(name).qpos[0] = value
    for m, d in ((one, here), (other, there)):
        mujoco.mj_kinematics(m, d)
    for name in ("r9/carriage", "r9/shell"):
        assert np.allclose(here.body(name).xpos, there.body(name).xpos, atol=1e-9)


def test_what_moves_together_stays_as_near_as_it_is() -> None:
    """Those that move with a robot are compared with others, not with each other."""
    placing = Placing(Floor(paper_layout()), {})
    near = np.zeros_like(placing.deep)
    near[2, 3] = near[3, 2] = 0.1
    placing.deep = near.copy()
    placing.look([1, 2, 3])
    assert (placing.deep == near).all()
