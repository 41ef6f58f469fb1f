"""Screws are told by name or by shape, and driven in after all that they clamp; nuts come after
their bolts, and equal screws share a driver."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.apps.planning.fastening import fasteners
from factory.apps.planning.names import Says, says
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product, screws_in
from factory.engine.timing.timed import pace
from factory.pipeline import all_templates
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import Plan
from tests.command_line import Terminal
from tests.paths import ROOT
from tests.plan_models import box, model_source, rod

QUICK = PlanOptions(lay_out=False)
NO_SCREWS = PlanOptions(lay_out=False, screws=None)


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


@pytest.mark.parametrize("name", ["screw", "M3x16_", "din_912_", "schraube", "thing"])
def test_screws_come_after_what_they_clamp_one_after_the_other(name: str, tmp_path: Path) -> None:
    """The last name says nothing, so that their shape tells."""
    source = model_source(tmp_path, lidded(name))
    found = plan(source, QUICK)
    assert isinstance(found, Planned)
    labels = {f"{name}{n}" for n in range(1, 5)}
    assert set(screws_in(found.tree)) == labels
    nodes = planned_product(source, found.tree).pag.nodes
    screwed = [node for node in nodes if node.operation == "screw"]
    assert {node.inputs[1] for node in screwed} == labels
    for join in found.operations:
        if set(join.come) <= labels:
            assert {"base", "lid"} <= set(join.pile) and join.direction == (0, 0, 1)
    assert "are driven in as screws" in found.notes[-1]


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


def test_screws_that_close_nothing_in_come_before_what_covers_them(tmp_path: Path) -> None:
    parts = lidded("screw")
    parts["cap"] = box(54, 44, 12, (0, 0, 6)) - box(50.4, 40.4, 10, (0, 0, 4.8))
    found = plan(model_source(tmp_path, parts), QUICK)
    assert isinstance(found, Planned) and len(screws_in(found.tree)) == 4
    made = planned_product(model_source(tmp_path, parts), found.tree).pag
    (mate,) = [node for node in made.nodes if "cap" in node.inputs]
    other = next(label for label in mate.inputs if label != "cap")
    inside = {node.label for node in PAG(other, made.nodes).postorder()}
    assert {"screw1", "screw2", "screw3", "screw4"} <= inside


def test_screws_are_ordinary_parts_if_that_is_asked_for(tmp_path: Path) -> None:
    source = model_source(tmp_path, lidded("screw"))
    found = plan(source, NO_SCREWS)
    assert isinstance(found, Planned) and screws_in(found.tree) == ()
    assert fasteners(model_source(tmp_path, {"a": box(9, 9, 9), "b": rod(4, 30)}), ()) == ()
    assert fasteners(model_source(tmp_path, {"a": box(9, 9, 9), "b": rod(4, 30)}), ("b",)) == ("b",)


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


def test_a_nut_comes_after_its_bolt_with_the_washer_between(tmp_path: Path) -> None:
    low, high = box(20, 20, 5, (0, 0, 2.5)), box(20, 20, 5, (0, 0, 7.5))
    hole, ring = rod(1.7, 40), rod(3.2, 0.5) - rod(1.6, 2)
    parts = {
        "nut": nut(-1.7),
        "under": ring.translate((0, 0, -0.25)),
        "low": low - hole,
        "high": high - hole,
        "top": ring.translate((0, 0, 10.25)),
        "bolt": bolt((0, 0, 10.5), 14.5),
    }
    source = model_source(tmp_path, parts)
    came = order(plan(source, QUICK), source)
    (driven,) = [n for n, inputs in enumerate(came) if "bolt" in inputs]
    assert [{*inputs} & {*parts} for inputs in came[driven:]] == [{"bolt"}, {"under"}, {"nut"}]


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


def test_parts_that_are_only_near_do_not_count_as_touching(tmp_path: Path) -> None:
    """A lid 0.4 mm above a capacitor comes after both are in the tub."""
    tub = box(60, 40, 24, (0, 0, 12)) - box(54, 34, 24, (0, 0, 14))
    parts = {
        "lid": box(60, 40, 3, (0, 0, 25.5)),
        "capacitor": rod(6, 21.6).translate((10, 0, 12.8)),
        "tub": tub,
    }
    source = model_source(tmp_path, parts)
    assert order(plan(source, QUICK), source)[0] == {"tub", "capacitor"}


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


def exported(folder: Path, parts: dict[str, Manifold]) -> Path:
    """Parts [mm] as a folder of STL files."""
    folder.mkdir()
    for label, body in parts.items():
        mesh = body.to_mesh64()
        vertices = np.asarray(mesh.vert_properties)[:, :3]
        trimesh.Trimesh(vertices, np.asarray(mesh.tri_verts)).export(folder / f"{label}.stl")
    return folder


def tapped(drill: float) -> dict[str, Manifold]:
    """A cover on a base, with a bolt of 10 mm drawn solid in a hole of some radius."""
    base, cover = box(60, 60, 30, (0, 0, 15)), box(60, 60, 10, (0, 0, 35)) - rod(5.5, 90)
    if drill:
        base -= rod(drill, 24).translate((0, 0, 20))
    head = rod(8, 10, sides=6).translate((0, 0, 45))
    return {"base": base, "cover": cover, "bolt_M10": head + rod(5, 30).translate((0, 0, 25))}


@pytest.mark.parametrize("drill", [4.25, 0.0])
def test_a_thread_that_is_drawn_solid_is_allowed_and_runs(
    drill: float, tmp_path: Path, run: Terminal
) -> None:
    """In its tap drill, and in no hole at all."""
    words = ("plan", exported(tmp_path / "parts", tapped(drill)), "--no-look", "--json")
    assert run(*words, "--no-screws", "-o", tmp_path / "no").codes == ["NotInPlace"]
    done = run(*words, "-o", tmp_path / "out")
    assert done.status == 0, done.err
    text = Path(done.json["pag"]).read_text()
    assert "screw ( cover_on_base, bolt_M10 )" in text and "allow (" in text
    assert run("run", done.json["pag"], "--units", 1, "-q").status == 0


def test_equal_screws_share_one_driver_and_what_is_screwed_runs(
    tmp_path: Path, run: Terminal
) -> None:
    """Two screws in different places along both axes, and nobody's settings are written over."""
    parts = {k: v for k, v in lidded("screw").items() if k not in ("screw2", "screw3", "filling")}
    model_source(tmp_path, parts)
    words = ("plan", tmp_path / "model.pag", "--replan", "--no-look", "--json", "-o")
    done = run(*words, tmp_path / "out")
    assert done.status == 0, done.err
    assert done.json["figures"]["robots"] == 5
    checked = run("check", done.json["pag"], "--json").json
    (feeder,) = checked["lines"]
    assert feeder["labels"] == ["screw4", "screw1"] and checked["robots"] == 5
    made = run("run", done.json["pag"], "--units", 2, "--json")
    assert made.json["refines_net"] and made.status == 0, made.err
    settings = tmp_path / "mine" / "factory.toml"
    settings.parent.mkdir()
    settings.write_text("speed = 0.4\n")
    refused = run(*words, settings.parent)
    assert (refused.status, refused.codes) == (2, ["BadFile"])
    assert settings.read_text() == "speed = 0.4\n" and len([*settings.parent.iterdir()]) == 1


def test_a_plan_with_a_blocked_operation_fails(tmp_path: Path, run: Terminal) -> None:
    """One of a sub-tree that is kept as its author wrote it."""
    dumbbell = rod(4, 30) + rod(8, 6).translate((0, 0, 12)) + rod(8, 6).translate((0, 0, -12))
    parts = {"plate": box(40, 40, 6) - rod(4.1, 8), "dumbbell": dumbbell}
    model_source(tmp_path, {**parts, "cap": box(20, 20, 5, (0, 0, 17.5))})
    file = tmp_path / "model.pag"
    text = file.read_text().replace("mate ( plate, dumbbell, cap )", "mate ( sub, cap )")
    file.write_text(text + "\nsub = mate ( plate, dumbbell );\n")
    done = run("plan", file, "--keep", "sub", "-o", tmp_path / "out", "--no-look", "--json")
    assert done.status == 1
    assert "Blocked" in [warning["code"] for warning in done.json["warnings"]]
