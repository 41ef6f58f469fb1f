"""An arm whose tool stays on a circle: `examples/cells/swing.xml`, a slide, a hinge and a wrist."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch
from xml.etree import ElementTree

import pytest

from factory.apps.arms import laying
from factory.apps.arms.orders import PrivateParts, private_parts
from factory.apps.arms.scene import Scene
from tests.arm_cells import SMALL, chains, project, refusal
from tests.paths import EXAMPLES, ROOT

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
