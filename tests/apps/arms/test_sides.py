"""Parts that come to their places from a side: how they are held, their ends, and a cell."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi
from unittest.mock import patch
from xml.etree import ElementTree

import numpy as np
import pytest

from factory.api import Layout, RunError
from factory.apps.arms import laying
from factory.apps.arms.arming import from_one_side
from factory.apps.arms.cell import ToolGrip
from factory.apps.arms.holds import facing_up, holds
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.load import Load
from factory.apps.arms.orders import PrivateParts, private_parts
from factory.apps.arms.rises import BEND, Rise
from factory.apps.arms.scene import Scene
from factory.floor.geometry.solids import Solid
from factory.pipeline import Project
from factory.support.arrays import Array
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates
from tests.arm_cells import SMALL, chains, project, refusal
from tests.arm_models import PACE, random_way, shipped
from tests.paths import EXAMPLES, ROOT

DRAWER = """root = chest;
chest = mate ( case, drawer );
case = mate ( block, roof );
block = atomic ( box = (0.05, 0.06, 0.05), pos = (-0.025, 0, 0.025) );
roof = atomic ( box = (0.1, 0.06, 0.008), pos = (0, 0, 0.0542) );
drawer = atomic ( box = (0.045, 0.05, 0.03), pos = (0.0227, 0, 0.03) )"""
"""A block with a roof that reaches beyond it, and what comes from a side to its place below."""


BOX = (
    DRAWER.replace("roof );", "roof, wall1, wall2 );")
    + """;
wall1 = atomic ( box = (0.1, 0.006, 0.05), pos = (0, -0.0342, 0.025) );
wall2 = atomic ( box = (0.1, 0.006, 0.05), pos = (0, 0.0342, 0.025) )"""
)
"""The same with walls, between which it comes from one side alone."""


@cache
def drawer() -> Layout:
    """Its cell."""
    return project(DRAWER, "six").layout


def test_an_end_goes_to_a_side_and_then_up() -> None:
    along = (0.0, -1.0)
    way = np.array([*along, 0.0])
    rise = Rise.beside(way, 0.1, 0.08)
    places = rise.places
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert not places[0].any() and steps.sum() == pytest.approx(rise.length, abs=1e-4)
    assert np.ptp(steps) < 1e-4
    aside, up = places @ way, places[:, 2]
    assert not up[aside < 0.1 - 1e-9].any()  # level as far as was asked for
    assert np.allclose(aside[up > BEND], 0.1 + BEND)
    gone = np.linspace(0.0, rise.length, len(places))
    assert up[gone >= rise.straight].min() >= 0.08 - 0.006
    assert np.allclose(places, np.outer(aside, way) + np.outer(up, [0.0, 0.0, 1.0]))


@pytest.mark.parametrize("normal", [(0, 1, 0), (0, 0, 1)])
def test_a_pad_is_on_the_face_that_it_is_asked_for(normal: tuple[float, ...]) -> None:
    solids, out = project(DRAWER, "six").product.solids, np.array(normal, float)
    turn = facing_up(out)
    assert np.allclose(turn @ turn.T, np.eye(3)) and np.linalg.det(turn) == pytest.approx(1.0)
    (hold,) = holds([solids["drawer"]], [solids["block"], solids["roof"]], np.zeros(3), out)
    part = solids["drawer"]
    off = out @ (hold.pad.at - part.low) if out.sum() < 0 else out @ (hold.pad.at - part.high)
    assert off == pytest.approx(1e-4) and hold.pad.level
    assert hold.clear == (normal not in ((0, 0, 1), (-1, 0, 0)))


@pytest.mark.parametrize(("text", "axis", "sides"), [(BOX, 0, (1,))])
def test_a_part_comes_along_the_axis_that_is_clear(
    text: str, axis: int, sides: tuple[int, ...]
) -> None:
    made = project(text, "six")
    approach = made.approaches["chest"]
    assert (approach.kind, approach.axis, approach.sides) == ("slide", axis, sides)
    factory = from_one_side(made.compiled)
    chosen = factory.by_label["chest"].approach
    assert chosen is not None and chosen.sides == (1,) and not chosen.overlaps[0]
    assert factory.by_label["case"].lowered >= 0


def boxes(layout: Layout, label: str, off: Array) -> tuple[Array, Array]:
    """The box of a part that is off its place (..., 3)."""
    solid = layout.product.solids[label]
    return solid.low + off, solid.high + off


def test_what_comes_from_a_side_meets_nothing_on_its_way() -> None:
    """By the boxes of its parts; at its end it moves along one axis."""
    layout = drawer()
    told, factory = chains(layout), layout.factory
    leaf = factory.by_label["drawer"].index
    leg = told.curves.legs[told.row(factory.parents[leaf], 1)]
    tip, turn = leg.chain.tool(leg.way.at(np.linspace(0.0, leg.way.length, 4000))[0])
    stand = told.stands[1]
    c, s = np.cos(stand.yaw), np.sin(stand.yaw)
    world = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    off = (tip - tip[-1]) @ world.T
    held = world @ turn[-1] @ [0.0, 0.0, 1.0]
    assert told.grips["drawer"].normal[2] == 0.0
    assert np.allclose(held, -told.grips["drawer"].normal, atol=1e-8)
    near = np.abs(off).max(axis=1) < 0.06
    assert near.sum() > 100
    assert np.abs(off[near] @ (np.eye(3) - np.abs(np.outer(held, held)))).max() < 2e-5
    low, high = boxes(layout, "drawer", off)
    for other in ("block", "roof"):
        least, most = boxes(layout, other, np.zeros(3))
        apart = np.maximum(low - most, least - high).max(axis=1)
        assert apart.min() > 1e-4


RADIUS = 0.015


def solid(mass: float = 1.0) -> Solid:
    text = "root = x; x = mate ( a, b ); a = atomic ( box = (0.1, 0.1, 0.01), pos = (0, 0, 0) );"
    text += f"b = atomic ( box = (0.08, 0.04, 0.02), pos = (0.01, 0, 0.0152), mass = {mass} )"
    templates = all_templates()
    return Project(read_pag(text, templates), templates).product.solids["b"]


def load(seed: int, mass: float = 1.0, radius: float = RADIUS) -> Load:
    part = solid(mass)
    grip = ToolGrip(np.array([0.02, 0.005, part.high[2]]), 0.7, radius)
    chain = shipped("six")
    return Load("r2", "b", part, grip, chain, random_way(chain, seed))


def test_at_rest_a_pad_bears_the_weight_below_it() -> None:
    chain = shipped("six")
    q = np.tile([0.3, -1.2, 1.4, -pi / 2 - 0.2, pi / 2, 0.0], (4, 1))
    down = chain.tool(q[:1])[1][0]
    assert abs(down[2, 2]) == pytest.approx(1.0, abs=1e-9)
    q[:, 0] += np.linspace(0.0, 0.5, 4)
    one = load(0)
    one = replace(one, chain=chain, way=JointWay(np.linspace(0.0, 1.0, 4), q))
    centred = replace(one, grip=replace(one.grip, tip=one.burden.centre))
    share = centred.pull(WayLimits(1e-6, 1e-6))
    assert share == pytest.approx(9.81 / (5e4 * pi * RADIUS**2), rel=1e-3)


def test_the_mass_that_is_named_is_the_greatest() -> None:
    """For the pad, and for the drives."""
    damping = np.zeros(6)
    for mass, radius in ((8.0, RADIUS), (60.0, 0.5)):
        with pytest.raises(RunError) as error:
            load(1, mass, radius).check(PACE, damping)
        (why,) = error.value.diagnostics
        assert why.code == "ArmLoad" and f"'b' of {mass:g} kg" in why.message
        assert ("its pad" in why.message) == (radius == RADIUS)
        most = float(why.hint.split("at most ")[1].split()[0])
        load(1, 0.98 * most, radius).check(PACE, damping)
        with pytest.raises(RunError):
            load(1, 1.02 * most, radius).check(PACE, damping)


def test_a_pin_bears_more_than_a_pad() -> None:
    """As much more as it is pressed on, where nothing slips."""
    one = load(1, 2.0)
    pinned = replace(one, grip=replace(one.grip, kind="pin"))
    assert not one.is_borne(PACE, np.zeros(6)) and pinned.is_borne(PACE, np.zeros(6))
    assert pinned.pull(PACE) < one.pull(PACE) / 50
    with pytest.raises(RunError) as error:
        replace(pinned, grip=replace(pinned.grip, radius=1e-4)).check(PACE, np.zeros(6))
    assert "its pin, 0.1 mm in radius" in error.value.diagnostics[0].message


SWING = str(EXAMPLES / "cells" / "swing.xml")


def test_ways_are_planned_round_the_pile_where_the_carrier_stands() -> None:
    """For each part elsewhere; the arm's coordinate grows towards the feeder, behind."""
    moved, move = list[float](), Scene.move

    def seen(scene: Scene, parts: set[str], by: tuple[float, float, float]) -> None:
        moved.append(by[0])
        move(scene, parts, by)

    with patch.object(Scene, "move", seen):
        layout = project(SMALL, SWING).layout
    joins = [o for o in layout.factory.making if len(o.inputs) == 2]
    stops = [layout.visits[o.index, o.carrier].at for o in joins]
    assert len({*moved}) == len({*stops}) == 2
    assert max(moved) - min(moved) == pytest.approx(max(stops) - min(stops))


@pytest.mark.slow
def test_the_carrier_goes_on_when_an_arm_is_up() -> None:
    """It stands elsewhere for the next part, however soon the arms are clear of each other."""
    with patch.object(laying, "private_parts", lambda *_: soon(private_parts(*_))):
        layout = project(SMALL, f"{SWING}=2").layout
    assert layout.certificate is not None
    ups = [(leg.reach, leg.way.off) for leg in chains(layout).curves.legs if not leg.brings]
    for past in layout.certificate.apart.passes:
        assert any(abs(past.at - reach - off) < 0.01 for reach, off in ups)


def soon(private: dict[str, PrivateParts]) -> dict[str, PrivateParts]:
    """The same, but for arms that are clear of each other as they leave."""
    return {label: replace(part, leaves=0.0) for label, part in private.items()}


def test_the_page_shows_its_joints() -> None:
    page = (ROOT / "docs" / "guide" / "extending.md").read_text("utf-8")
    shown = page.partition("### A machine with a hinge")[2].partition("```xml\n")[2]
    bodies = ElementTree.fromstring(shown.partition("```")[0])
    file = ElementTree.parse(SWING).getroot()
    for name in ("body", "joint", "site"):
        assert [e.attrib for e in bodies.iter(name)] == [
            e.attrib
            for e in file.find("worldbody").iter(name)  # type: ignore[union-attr]
        ]
    solid = [{**e.attrib} for e in file.iter("geom") if e.get("class") == "solid" and e.get("name")]
    sizes = {e["name"]: (e["size"], e.get("pos")) for e in solid}
    for one in bodies.iter("geom"):
        assert sizes[one.attrib["name"]] == (one.get("size"), one.get("pos"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SMALL.replace("(-0.018, 0.01, 0.0421)", "(-0.018, 0.3, 0.0421)"), "across the line"),
        (
            SMALL.replace(
                "(0.10, 0.07, 0.03), pos = (0, 0, 0.015)", "(0.10, 0.07, 0.2), pos = (0, 0, -0.07)"
            ),
            "mm up",
        ),
    ],
)
def test_what_it_cannot_place_is_refused(text: str, said: str) -> None:
    why = refusal(text, SWING)
    assert why.code == "Unreachable" and said in why.message and "rails" in why.hint
