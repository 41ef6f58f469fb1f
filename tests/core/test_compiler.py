"""Compile and CompileNode: the paper's example to the letter, numbering, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given

from factory.floor.layout.carrying_back import not_carried_back
from factory.floor.layout.crowding import separation
from factory.floor.layout.sweeps import piles_of
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project
from factory.support.errors import InputError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.pag_reader import read_pag
from factory.theory.problem.pag import PAG
from factory.theory.problem.robot_types import Catalogue
from tests.examples import with_hands
from tests.pag_texts import PAPER, TEMPLATES, compiled
from tests.strategies import pags

GEARS = [
    "r1: wait nopart · mate sub3 · wait sub3 · dropoff",
    "r2: wait nopart · atomic part3 · wait part3 · mate sub3",
    "r3: wait nopart · mate sub1 · hold sub1 · weld sub2 · wait sub2 · mate sub3",
    "r4: wait nopart · weld sub2",
    "r5: wait nopart · atomic part1 · wait part1 · mate sub1",
    "r6: wait nopart · atomic part2 · wait part2 · mate sub1",
]


def codes(error: pytest.ExceptionInfo[InputError]) -> list[str]:
    return [d.code for d in error.value.diagnostics]


def gears(factory) -> list[str]:
    places = factory.net.threaded.places
    return [
        f"{g.robot}: " + " · ".join(f"{places[p].mode} {places[p].label}".strip() for p in g.places)
        for g in factory.net.gears
    ]


def test_the_papers_example_has_the_gears_of_the_paper() -> None:
    factory = compiled(PAPER)
    assert gears(factory) == GEARS
    operations = {o.label: [r + 1 for r in o.robots] for o in factory.operations}
    assert operations["sub1"] == [5, 6, 3]
    assert operations["sub2"] == [3, 4]
    assert operations["sub3"] == [3, 2, 1]


def test_a_factory_is_compiled_where_its_meshes_are_gone(tmp_path) -> None:
    text = "root = s; s = mate(a, b); a = atomic(); b = atomic({})"
    pag = read_pag(text.format('mesh = "gone.stl"'), TEMPLATES, str(tmp_path / "x.pag"), None)
    project = Project(pag, TEMPLATES)
    assert gears(project.unshaped) == gears(compiled(text.format("")))
    with pytest.raises(InputError):
        _ = project.plain


def test_numbering_gives_small_inputs_first_and_tools_last() -> None:
    factory = compiled(
        "root = s; s = mate(t, u); t = mate(a, b); u = atomic(); a = weld(c); b = atomic();"
        "c = atomic()"
    )
    made = {o.label: o.carrier + 1 for o in factory.operations}
    assert (made["s"], made["u"], made["t"]) == (1, 2, 3)
    assert (made["b"], made["a"]) == (4, 5)
    assert [r + 1 for r in factory.by_label["a"].robots] == [5, 6]


@given(pags(max_labels=40))
def test_counts_are_those_of_the_specification(pag: PAG) -> None:
    factory = compile_pag(pag, TEMPLATES, load_catalogue())
    n = len(factory.operations) - 1
    robots = 1 + sum(len(o.robots) - 1 for o in factory.operations[:-1])
    assert len(factory.robots) == robots
    assert len(factory.net.threaded.transitions) == 2 * n + 2
    assert len(factory.net.threaded.places) == 2 * n + robots + 1
    assert len(factory.net.initial_marking) == robots


CRANE = """crane = (R, j, ~, <a; b>, F) where R = < gantry >; j = 1; ~ = {};
<a; b> = < nopart; LAB1 >;
F = navigation on W to ( B1 ) within eps; parameters = geometry"""
HOIST = """hoist = (R, j, ~, <a; b>, F) where R = < lift, dot >; j = 1; ~ = { S1 = A2 };
<a; b> = < LAB1, LAB2; LAB3, nopart >; F = navigation on W to ( S1 + 2r, A2 + 2r ) within eps"""


def catalogue() -> Catalogue:
    types = dict(load_catalogue().types)
    types["gantry"] = replace(types["tool"], name="gantry")
    types["lift"] = replace(types["dot"], name="lift", extends="dot")
    return Catalogue(types)


def test_the_output_type_must_fit_too() -> None:
    with pytest.raises(InputError) as error:
        compiled("root = a; a = crane()", CRANE, catalogue=catalogue())
    assert codes(error) == ["TypeMismatch"]


def test_an_unknown_type_is_named_once_and_where_it_is_written() -> None:
    """Though two operations ask for it; the carrier's too, which no role fits then."""
    turn = HOIST.replace("hoist", "turn").replace("lift, dot >", "dit, tol >")
    turn = turn.replace("LAB1, LAB2; LAB3, nopart", "LAB1, nopart; LAB2, nopart")
    with pytest.raises(InputError) as error:
        compiled("root = t; t = turn(s); s = turn(a); a = atomic()", turn)
    said = [(str(d.position), d.message) for d in error.value.diagnostics]
    column = turn.index("dit") + 1
    assert said == [
        (f"<text>:1:{column}", "turn asks for a robot of unknown type 'dit'"),
        (f"<text>:1:{column + 5}", "turn asks for a robot of unknown type 'tol'"),
    ]
    assert codes(error) == ["TypeMismatch"] * 2
    assert error.value.diagnostics[0].hint == "did you mean 'dot'?"


MATE = """mate = (R, j, ~, <a; b>, F) where R = < dot, dot, dot >; j = 3; ~ = { A1 = A2 = B3 };
<a; b> = < LAB1, LAB2, nopart; nopart, nopart, LAB3 >;
F = navigation on W to ( %s ) within %s; further = insert"""
TWO = "root = s; s = mate(a, b); a = atomic(); b = atomic()"


@pytest.mark.parametrize(
    ("goals", "eps", "words"),
    [
        ("A1 - 2r, A2 + 2r, B3", "eps", "off the guidepath"),
        ("A2 + 2r, A1 + 2r, B3", "eps", "no point of robot 1"),
    ],
)
def test_a_mode_that_cannot_reach_its_goal_is_refused(goals: str, eps: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        compiled(TWO, MATE % (goals, eps))
    assert set(codes(error)) == {"NotPrepared"}
    assert words in str(error.value)


def test_robots_left_touching_are_outside_the_next_domain() -> None:
    part = """near = (R, j, ~, <a; b>, F) where R = < dot >; j = 1; ~ = {};
    <a; b> = < nopart; LAB1 >;
    F = navigation on W to ( A1 ) within eps; parameters = geometry"""
    with pytest.raises(InputError) as error:
        compiled("root = s; s = mate(a, b); a = near(); b = near()", part)
    assert codes(error) == ["NotPrepared"]
    assert "'s'" in str(error.value)


def test_the_finished_chest_would_hit_a_post() -> None:
    layout = with_hands("chest")
    assert not_carried_back(layout) == {(0, "chest")}
    path, label = layout.guidepaths[0], "chest"
    pile = piles_of(layout)[label]
    (way,) = path.sweeps(pile.box, path.length, layout.stops(0)[-2])
    posts = [r for r in layout.certificate.regions if r.robot == 7 and r.label == "front1"]
    assert min(separation(way, post.box) for post in posts) < layout.clearance


def test_who_comes_to_a_join_with_nothing_waits_empty() -> None:
    made = compiled(PAPER)
    waits = {
        (o.label, made.robots[robot].name)
        for o in made.operations
        for slot, robot in enumerate(o.robots)
        if o.awaits_empty(slot)
    }
    assert waits == {("sub1", "r3"), ("sub2", "r4"), ("sub3", "r1")}
