"""Plans and layouts are files: what is written is read back, in a log and beside a PAG, and nothing
is looked for again."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from factory.apps.analyze import Timing, analyse
from factory.apps.few_robots.sharing import with_branches, with_lines
from factory.apps.log.plan_file import plan_files, read_plan
from factory.engine.simulation.modelling import physical_model
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.floor.layout.saved import LayoutTable
from factory.pipeline import Project, read
from factory.support.errors import Diagnostic, InputError
from factory.support.tables import table_of, value_of
from factory.theory.problem.plan import Plan
from tests.apps.relay.test_relay_hands import sawn
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT, TESTS
from tests.slow import slow_but

EXAMPLES = ROOT / "examples"
COMPARED = ("factory", "guidepaths", "visits", "hands", "floor", "outfeed")

BESIDE = """root = sub4;
sub4 = insert ( sub3, part4 ); sub3 = insert ( part3, sub2 ); sub2 = weld ( sub1 );
sub1 = insert ( part1, part2 ); part1 = atomic(); part2 = atomic(); part3 = atomic();
part4 = atomic()
"""
"""A product with a slow branch."""

ON_ONE = BESIDE.replace("part3, sub2", "sub2, part3")
"""The same, made on one robot."""


def assert_same(made: Layout, layout: Layout) -> None:
    """What is read is what was written, and gives the same robots and times."""
    for name in COMPARED:
        assert getattr(made, name) == getattr(layout, name), name
    assert dict(made.payloads) == dict(layout.payloads)
    assert made.certificate == layout.certificate
    assert (made.plain is None) == (layout.plain is None)
    if made.plain is not None and layout.plain is not None:
        assert_same(made.plain, layout.plain)


def with_text(text: str, folder: Path, **ground: Any) -> Project:
    (folder / "p.pag").write_text(text, "utf-8")
    return read(folder / "p.pag", (), ground=Ground(**ground))


VARIANTS: dict[str, Callable[[Path], Project]] = {
    "written": lambda folder: read(PAPER),
    "lamp": lambda folder: read(EXAMPLES / "lamp.pag"),
    "lines": lambda folder: with_lines(with_text(ON_ONE, folder), [["part2", "part3"]]),
    "forms": lambda folder: read(PAPER).with_plan(Plan({"sub3": 0, "sub1": 1})),
    "branches": lambda folder: with_branches(with_text(BESIDE, folder), [("sub2", 3)]),
    "relays": lambda folder: with_text(sawn(1), folder, relay=True),
}


GUIDEPATH = {
    "heading": [1.0, 0.0],
    "side": [0.0, 1.0],
    "a": [0.0, 0.0],
    **dict.fromkeys(("travel", "reach", "offset", "arm", "nest"), 0.1),
}
VISIT = {"at": 0.06, "lift": 0, "up": 0, "elevation": 0}

LAYOUT = {
    "clearance": 0.02,
    "guidepaths": [GUIDEPATH],
    "visits": [[VISIT]],
    "outfeed": [0, 1, 0, 1],
}

LESSONS: list[tuple[str, Any, str]] = [
    ("clearence", 1, "the table has no key 'clearence': did you mean 'clearance'?"),
    ("outfeed", [1.0], "'outfeed' must be a list of 4, not [1.0]"),
    ("guidepaths", [{**GUIDEPATH, "side": [1, 0]}], "guidepaths[0] must lie along the axes"),
    ("guidepaths", [{**GUIDEPATH, "reach": 0}], "guidepaths[0] must have a travel from 0 and"),
    ("hands", [{"kind": "below", "places": []}], "hands[0] must have places"),
]


@pytest.mark.parametrize(("key", "value", "words"), LESSONS)
def test_a_broken_table_has_its_lesson(key: str, value: Any, words: str) -> None:
    assert table_of(value_of(LayoutTable, LAYOUT)) == LAYOUT
    with pytest.raises(ValueError) as error:
        value_of(LayoutTable, {**LAYOUT, key: value} if key else value)
    assert words in str(error.value)


@cache
def written() -> Project:
    return read(EXAMPLES / "truck.pag")


@pytest.fixture
def built(run: Terminal, tmp_path: Path) -> Path:
    """The folder of a build of the paper's product with few robots."""
    done = run("build", PAPER, "--robots", 3, "--speed", 0.4, "-o", tmp_path / "d", "-q")
    assert done.status == 0, done.err
    return tmp_path / "d"


@pytest.mark.parametrize("name", slow_but(["written", "lines"], VARIANTS))
def test_a_plan_is_read_in_place_of_its_pag(name: str, tmp_path: Path) -> None:
    """To the last bit: the same plan, layout, model and prediction, with its layout and without."""
    project, folder = VARIANTS[name](tmp_path), tmp_path / "here" / "d"
    folder.mkdir(parents=True)
    for path, content in plan_files(project, folder).items():
        path.write_bytes(content)
    said = list[Diagnostic]()
    plan = read_plan(folder / "plan.json")
    again = plan.project(plan.settings, plan.ground, said.append)
    assert not said and again.settings == project.settings and again.ground == project.ground
    assert bool(project.layout.factory.plan.relays) == name.startswith("relays")
    assert again.layout.factory.plan == project.layout.factory.plan
    assert_same(again.layout, project.layout)
    one, other = (physical_model(p.layout, 2, p.settings, p.catalogue) for p in (project, again))
    assert one.xml == other.xml and one.files == other.files
    times = [Timing(p.layout, p.settings) for p in (project, again)]
    assert times[0].delays == times[1].delays
    assert analyse(times[0]).slack == analyse(times[1]).slack
    assert plan_files(again, folder) == plan_files(project, folder)
    (folder / "layout.json").unlink()
    anew = plan.project(plan.settings, plan.ground, said.append)
    assert [d.code for d in said] == ["BadPlan"] and "laid out again" in said[0].message
    assert_same(anew.layout, project.layout)


def test_what_does_not_go_with_a_plan(run: Terminal, built: Path, tmp_path: Path) -> None:
    plan, layout = built / "plan.json", built / "layout.json"
    for words in (
        ("--robots", 3),
        ("--cycle", 3.0),
        ("--relay",),
        ("--parallel", "sub2=2"),
        ("--templates", tmp_path),
        ("--effort", 3),
    ):
        done = run("check", plan, *words, "--json")
        assert done.status == 2 and done.codes == ["Usage"]
        assert f"{words[0]} applies to a PAG" in done.json["errors"][0]["message"]
    assert "laid out again" not in run("run", plan, "--world", "ideal", "--speed", 1).err
    assert "other settings" in run("run", plan, "--world", "ideal", "--clearance", 0.03).err
    assert "other settings" in run("run", plan, "--world", "ideal", "--floor", "9x9").err
    done = run("build", plan, "-o", built)
    assert done.status == 2 and "would be written over" in done.err
    kept = json.loads(layout.read_text())
    kept["layout"]["guidepaths"][1]["a"][0] += 0.05
    layout.write_text(json.dumps(kept))
    done = run("run", plan, "--world", "ideal")
    assert done.status == 2 and "BadPlan" in done.err and "not clear" in done.err


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (lambda t: "{", "BadPlan", "plan.json:1:2: BadPlan it is not JSON"),
        (lambda t: "[]", "BadPlan", "its schema must be 'factory.plan.1'"),
        (lambda t: {**t, "plan": {"forms": {"sub1": 7}}}, "BadPlan", "numbers from -1 to 1, not 7"),
        (lambda t: {**t, "plan": {"turns": [[0] * 6]}}, "BadPlan", "cannot take two parts in"),
        (
            lambda t: {**t, "plan": {"turns": [[*range(6)]], "lifts": [6]}},
            *("BadPlan", "r7 has a lift"),
        ),
        (lambda t: {**t, "templates": {"mate": "x"}}, "Syntax", "mate:1:2: "),
        (lambda t: {**t, "pag": {**t["pag"], "text": "x"}}, "Syntax", ""),
        (
            lambda t: {**t, "pag": {**t["pag"], "file": "a\0b"}},
            "BadPlan",
            "'pag': file must be the",
        ),
    ],
)
def test_plans_that_are_refused(
    change: Callable[[dict[str, Any]], Any], code: str, words: str, run: Terminal, tmp_path: Path
) -> None:
    project = written_paper()
    plan = json.loads(plan_files(project, tmp_path)[tmp_path / "plan.json"])
    changed = change(plan)
    text = changed if isinstance(changed, str) else json.dumps(changed)
    (tmp_path / "plan.json").write_text(text)
    done = run("check", tmp_path / "plan.json")
    assert done.status == 2 and code in done.err and words in done.err, done.err


@cache
def written_paper() -> Project:
    return read(PAPER)


def _raise(table: list[list[dict[str, Any]]], rows: Sequence[tuple[int, int]]) -> None:
    for operation, slot in rows:
        table[operation][slot]["elevation"] += 0.002


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[0].pop(), r"visits\[0\] must be a list of 3, one for each robot"),
        (lambda rows: rows[0][1].update(at=9.0), "r2 stands .* mm beyond the end of its guidepath"),
        (lambda rows: _raise(rows, [(0, 1)]), "the same up, elevation and shift"),
    ],
    ids=["robots", "guidepath", "tour"],
)
def test_visits_that_are_refused(change: Callable[[Any], object], words: str) -> None:
    """A layout is not read whose robots are not on their guidepaths, or bring what they bring
    elsewhere than where it is joined."""
    project = written_paper()
    table = table_of(LayoutTable.of(project.layout))
    change(table["visits"])
    with pytest.raises(InputError, match=words):
        _ = replace(project, laid=value_of(LayoutTable, table, "layout")).layout


def test_a_kept_layout_whose_machines_are_too_near_is_refused() -> None:
    """A tool stands 6 mm beside where a carriage comes past, of a robot with the same carrier."""
    plan = read_plan(TESTS / "data" / "crossing" / "plan.json")
    with pytest.raises(InputError, match="BadPlan") as refused:
        _ = plan.project(plan.settings, plan.ground, print).layout
    text = str(refused.value)
    assert "carriage of r10, in r10:nopart/s4t, and carriage of r12, in s4," in text
    assert "come 13.90 mm nearer than they may" in text
