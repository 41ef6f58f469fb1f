"""Screws are told by name or by shape, and driven in after all that they clamp."""

from __future__ import annotations

from pathlib import Path

import pytest
from manifold3d import Manifold

from factory.pipeline import all_templates
from factory.planning.fastening import fasteners
from factory.planning.plan import Planned, PlanOptions, plan
from factory.planning.writing import planned_product, screws_in
from factory.problem.pag import PAG
from tests.command_line import Terminal
from tests.plan_models import box, model_source, rod

QUICK = PlanOptions(lay_out=False)
NO_SCREWS = PlanOptions(lay_out=False, screws=None)


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("factory.geometry.decomposition.release", lambda package: "")


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


def test_words_are_told_from_names_that_have_them_inside(tmp_path: Path) -> None:
    names = ("vise", "screwdriver", "television", "iso", "m3")
    assert fasteners(model_source(tmp_path, dict.fromkeys(names, box(9, 9, 9))), ()) == ()
    names = ("wood_screw_2", "BoltM5", "vis-3", "ISO4762", "m3x10", "cap screw 1".replace(" ", "_"))
    found = model_source(tmp_path, dict.fromkeys(names, box(9, 9, 9)))
    assert set(fasteners(found, ())) == {*names}


def test_what_is_screwed_runs(tmp_path: Path, run: Terminal) -> None:
    parts = {k: v for k, v in lidded("screw").items() if k not in ("screw3", "screw4", "filling")}
    model_source(tmp_path, parts)
    words = ("plan", tmp_path / "model.pag", "--replan", "-o", tmp_path / "out", "--no-look")
    done = run(*words, "--json")
    assert done.status == 0, done.err
    assert all_templates()["screw"].parameters
    done = run("run", done.json["pag"], "--units", 1, "--json")
    assert done.json["refines_net"] and done.status == 0, done.err
