"""Screws are told by name or by shape, and driven in after all that they clamp; nuts come after
their bolts, and equal screws share a driver."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.fastening import fasteners
from factory.apps.planning.names import Says, says
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product, screws_in
from factory.engine.timing.timed import pace
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.plan import Plan
from tests.paths import ROOT
from tests.plan_models import box, model_source, rod

QUICK = PlanOptions(lay_out=False)


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


def bolt(at: tuple[float, float, float], long: float = 18) -> Manifold:
    """A bolt whose head stands on a point."""
    shank = rod(1.5, long).translate((0, 0, -long / 2))
    return (shank + rod(3, 3, sides=6).translate((0, 0, 1.5))).translate(at)


def lidded(name: str) -> dict[str, Manifold]:
    """A box with a lid, held by four bolts in clearance holes, the thread in the box."""
    base, lid = (
        box(50, 40, 24, (0, 0, -12)) - box(36, 26, 20, (0, 0, -6)),
        box(50, 40, 4, (0, 0, 2)),
    )
    parts, at = {}, [(x, y, 4.0) for x in (-21, 21) for y in (-16, 16)]
    for n, (x, y, z) in enumerate(at):
        hole = rod(1.6, 60).translate((x, y, 0))
        base, lid = base - hole, lid - hole
        parts[f"{name}{n + 1}"] = bolt((x, y, z))
    return {"base": base, "lid": lid, **parts, "filling": box(30, 20, 10, (0, 0, -10))}


def test_screws_are_driven_row_by_row_as_their_carrier_goes_on(tmp_path: Path) -> None:
    """In the order of their labels the second and the third would lie across from each other."""
    source = model_source(tmp_path, lidded("screw"))
    found = plan(source, QUICK)
    assert isinstance(found, Planned)
    at = {part.label: found.orientation @ part.vertices.mean(axis=0) for part in source.parts}
    ways = np.diff([at[label] for label in screws_in(found.tree)], axis=0)
    assert (ways[:, 0] < 1e-6).all()
    assert (np.abs(ways[:, :2]) > 1e-6).sum() == len(ways)


@pytest.mark.slow
def test_one_driver_takes_at_most_15_percent_longer_than_four(tmp_path: Path) -> None:
    subprocess.run([sys.executable, ROOT / "examples" / "make_gadget.py", tmp_path], check=True)
    found = plan(read_source(tmp_path, all_templates(), SourceOptions("mm")))
    assert isinstance(found, Planned) and found.project is not None
    assert found.figures.robots <= 13 and [len(line) for line in found.lines] == [4]
    alone = found.project.with_plan(Plan())
    longest = 1.15 * pace(alone.layout, alone.settings)[0].seconds
    assert found.figures.cycle is not None and found.figures.cycle <= longest


SCREWS = """
wood_screw_2 BoltM5 vis-3 ISO4762 m3x10 cap_screw_1 M3x10 M2.5x6_2 M8x1.25x30 M3X10(2) 912_M5x16
DIN933_M8x30 din912 DIN7985 DIN_EN_ISO_4014_M8x40 EN24017 ISO7380-1_M3x8 DIN84 ISO10642
Zylinderschraube_M4x12 SenkschraubeM3 Schraube_links Gewindestift_M4x6 Deckelschraube HexBolt_2
screw_pan_head_M3 M3x10_screw_left bolt_1_copy tornillo_M5 SHCS_M3x8 thumbscrew cover_screw_1
"""
OTHERS = """
vise screwdriver television iso bolt_hole_plate bolt_circle screwdriver_holder screw_terminal
screw_plate Schraubenloch Schraubendreher Schraubdeckel Schraubstock Schrauben_Halter tete_de_vis
DIN125_M8_top ISO4032_M8 DIN934 DIN471_20x1.2 DIN625 DIN6885 DIN7 EN24032 nut_M8 nut_for_bolt_M8
Mutter_M8 Scheibe_8.4 washer_for_screw insert_M3x5 standoff_M3x10 pin_M3x10 Zylinderstift bolted
"""
PERHAPS = "m3 lead_screw door_bolt bolt_flange screw_boss screw_cap cover_M3x10 stud_M8 screw_head"


def test_the_last_noun_and_the_number_of_a_standard_say_what_a_part_is() -> None:
    assert [name for name in SCREWS.split() if says(name) != Says.SCREW] == []
    wrong = [name for name in OTHERS.split() if says(name) not in (Says.OTHER, Says.NOTHING)]
    assert wrong == []
    assert {says(name) for name in ("gear_drive", "gear_idler_1", "bush_drive")} == {Says.OTHER}
    assert [name for name in PERHAPS.split() if says(name) != Says.PERHAPS] == []


def test_where_a_name_is_in_doubt_a_shank_in_a_hole_decides(tmp_path: Path) -> None:
    """A plate with a hole is no screw on the knob in it, a bar in a pot none in the pot."""
    hole, shank = rod(3.1, 40), rod(3, 30)
    peg = box(3, 3, 18, (0, 0, -9)) + box(6, 6, 3, (0, 0, 1.5))
    plates = {"bolt_flange": box(40, 40, 6) - hole, "knob": rod(3, 40)}
    assert fasteners(model_source(tmp_path, plates), ()) == ()
    block = box(40, 40, 40, (0, 0, -20))
    for name, parts, found in (
        ("bar in a hole", {"stud": shank, "block": block - rod(2.6, 60)}, ("stud",)),
        ("bar in a body", {"stud": shank, "block": block}, ("stud",)),
        ("bar in a pot", {"stud": shank, "block": block - rod(12, 60)}, ()),
        ("no name", {"bar": shank, "block": block - hole}, ()),
        ("round, with a head", {"part": bolt((0, 0, 0)), "block": block - rod(1.6, 90)}, ("part",)),
        ("square, with a head", {"part": peg, "block": block - box(3, 3, 90)}, ()),
    ):
        assert fasteners(model_source(tmp_path, parts), ()) == found, name


def nut(at: float) -> Manifold:
    """A nut about a bolt of 3 mm, at a height."""
    return (rod(3.2, 2.4, sides=6) - rod(1.55, 4)).translate((0, 0, at))


def order(found: object, source: InPlace) -> list[set[str]]:
    """What comes in each operation of a plan, the first one first."""
    assert isinstance(found, Planned)
    nodes = planned_product(source, found.tree).pag
    taken = [node for node in nodes.postorder() if node.inputs]
    return [{*node.inputs} for node in taken]


def test_a_stud_comes_before_what_comes_over_it_and_then_its_nut(tmp_path: Path) -> None:
    base, cover = box(20, 20, 10, (0, 0, 5)), box(20, 20, 5, (0, 0, 12.5))
    parts = {
        "cover": cover - rod(1.7, 60),
        "nut": nut(16.2),
        "base": base - rod(1.25, 12).translate((0, 0, 9)),
        "stud": rod(1.5, 15).translate((0, 0, 12)),
    }
    source = model_source(tmp_path, parts)
    came = [{*inputs} & {*parts} for inputs in order(plan(source, QUICK), source)]
    assert came == [{"base", "stud"}, {"cover"}, {"nut"}]


def test_a_screw_that_alone_connects_parts_does_not_leave_them_apart(tmp_path: Path) -> None:
    """Two plates 6 mm apart: the screw is in one of them before the other comes."""
    low, high = box(40, 30, 8, (0, 0, 4)), box(40, 30, 6, (0, 0, 17))
    parts = {
        "low": low - rod(1.25, 20),
        "high": high - rod(1.6, 60),
        "screw": bolt((0, 0, 20), 16),
        "cap": box(10, 20, 4, (-12, 0, 22)),
    }
    source = model_source(tmp_path, parts)
    found = plan(source, QUICK)
    assert isinstance(found, Planned)
    assert found.figures.apart == 0 and screws_in(found.tree) == ("screw",)
    first = next(inputs for inputs in order(found, source) if "screw" in inputs)
    assert "high" in first


def test_screws_that_are_not_driven_are_named(tmp_path: Path) -> None:
    """One that a cover closes in from above comes from below, where no driver gets."""
    base = box(20, 20, 10, (0, 0, 5)) - rod(1.6, 60) - rod(3.2, 6).translate((0, 0, 0))
    parts = {
        "base": base,
        "top": box(20, 20, 5, (0, 0, 12.5)) - rod(1.25, 6).translate((0, 0, 10)),
        "screw": bolt((0, 0, 3), 9).rotate((180, 0, 0)).translate((0, 0, 6)),
    }
    found = plan(model_source(tmp_path, parts), PlanOptions(lay_out=False, up=(2, 1)))
    assert isinstance(found, Planned) and screws_in(found.tree) == ()
    assert "screw is a screw and is not driven in" in found.notes[-1]
