"""Forms: a third robot takes what two bring, or the robot of one of them keeps it. The product is
the same, the net is proved as before, and the choice is the best for what it goes by."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

import factory
from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.candidate import Candidate
from factory.apps.few_robots.forms import (
    APART,
    FormsTask,
    Option,
    _finished,
    _joined,
    _over,
    best_forms,
    joins,
    written_forms,
)
from factory.apps.few_robots.lines import Admitted, admitted
from factory.apps.few_robots.search import Search, allocated
from factory.floor.layout.durations import Pace
from factory.pipeline import Project, read
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.support.tables import table_of, value_of
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.expanding import expand
from factory.theory.lang.template_reader import load_templates
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import THIRD, Plan
from factory.theory.problem.robot_types import load_catalogue
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.layout_values import table_pag
from tests.pag_values import SHAPES, random_pag
from tests.pag_values import TEMPLATES as OWN
from tests.paths import EXAMPLES

TEMPLATES = {**OWN, **load_templates([templates_folder()])}
"""The shipped ones, and those that random PAGs use beside them."""

sizes, seeds, shapes = st.integers(2, 24), st.integers(0, 10_000), st.sampled_from(SHAPES)


def task_of(pag: PAG, admits: dict[str, Admitted] | None = None) -> FormsTask:
    """With sub-assemblies of many sizes, that follow from their labels."""
    plain = compile_pag(pag, TEMPLATES, load_catalogue())
    boxes = {
        label: (0.0, 0.05 + sum(map(ord, label)) % 7 / 20, 0.0, 0.1) for label in plain.contents
    }
    return FormsTask(pag, TEMPLATES, admits or {}, boxes, Pace())


def parts_made(plain: Factory) -> set[frozenset[str]]:
    """The parts of all that is joined."""
    return {frozenset(plain.contents[o.label]) for o in plain.operations[:-1] if len(o.inputs) > 1}


@given(sizes, seeds, shapes, st.sampled_from([0.5, 1.0, 2.0, 4.0, inf]))
def test_the_same_is_joined_with_the_robots_that_are_counted(
    size: int, seed: int, shape: str, bound: float
) -> None:
    pag = random_pag(size, seed, shape)
    forms, _ = best_forms(task_of(pag), bound)
    plan = Plan(forms)
    assert value_of(Plan, json.loads(json.dumps(table_of(plan)))) == plan, "it can be written down"
    made = compile_pag(pag, TEMPLATES, load_catalogue(), plan=plan)
    assert parts_made(made) == parts_made(compile_pag(pag, TEMPLATES, load_catalogue()))
    assert verify(made.net).holds
    parts = len(made.leaves)
    tools = sum(robot.type == "tool" for robot in made.robots)
    thirds = sum(form == THIRD for form in forms.values())
    assert len(made.robots) - tools == parts + thirds
    if bound == inf:
        assert thirds == 0, "without a bound no robot is spent on taking over"


def every_way(task: FormsTask, label: str, axis: int, bound: float) -> Iterator[Option]:
    """All ways to make a label, none left out."""
    node = task.nodes[label]
    if not node.inputs:
        yield Option(0, 0, 0.0, 0, task.pace.lost)
        return
    for pile in (THIRD, 0, 1) if label in task.free else (0,):
        ways = [
            [*every_way(task, x, axis if n == pile else 1 - axis, bound)]
            for n, x in enumerate(node.inputs)
        ]
        fault = int(len(ways) > 1 and label in task.admitted and _blocked(task, label, axis, pile))
        for inputs in product(*ways):
            yield _joined(task, node, pile, inputs, bound, (fault, fault))


def _blocked(task: FormsTask, label: str, axis: int, pile: int) -> bool:
    return (label, pile) in task.refused or task.admitted[label].slides[axis] == 0


@given(st.integers(3, 9), seeds, st.sampled_from(["any", "chain", "balanced"]), st.data())
def test_no_other_forms_are_better(size: int, seed: int, shape: str, data: st.DataObject) -> None:
    pag = random_pag(size, seed, shape, arity=3)
    sliding = st.sampled_from([(3, 3), (3, 0), (0, 3), (0, 0)])
    labels = [label for node in pag.nodes if len(node.inputs) > 1 for label in joins(node)]
    admits = {label: Admitted(data.draw(sliding), (0, 0)) for label in labels}
    task, bound = task_of(pag, admits), data.draw(st.sampled_from([0.8, 1.5, 3.0]))
    best = min(
        _finished(task, pag.root, option, bound).rank
        for option in every_way(task, pag.root, 1, bound)
    )
    forms, _ = best_forms(task, bound)
    chosen = [
        _finished(task, pag.root, option, bound).rank
        for option in every_way(task, pag.root, 1, bound)
        if _forms(task, option) == forms
    ]
    assert min(chosen) == pytest.approx(best)


def _forms(task: FormsTask, option: Option) -> dict[str, int]:
    found, stack = {}, [(task.pag.root, option)]
    while stack:
        label, one = stack.pop()
        if label in task.free:
            found[label] = one.pile
        stack += zip(task.nodes[label].inputs, one.inputs, strict=True)
    return found


def test_a_statement_of_many_inputs_is_cut_where_its_pile_changes_hands() -> None:
    pag = table_pag("s", ("s", "mate", "a b c d e", {}), *((x, "atomic", "", {}) for x in "abcde"))
    forms = {"s/2": 1, "s/3": 0, "s/4": THIRD, "s": 1}
    nodes = expand(pag, TEMPLATES, Plan(forms)).items()
    assert {x: (node.template.name, node.inputs) for x, node in nodes if node.inputs} == {
        "s/2": ("insert", ("b", "a")),
        "s/3": ("insert", ("s/2", "c")),
        "s/4": ("mate", ("s/3", "d")),
        "s": ("insert", ("e", "s/4")),
    }


@given(sizes, seeds, shapes)
def test_forms_as_they_are_written_change_nothing(size: int, seed: int, shape: str) -> None:
    pag = random_pag(size, seed, shape)
    plan = Plan(written_forms(task_of(pag)))
    assert expand(pag, TEMPLATES, plan) == expand(pag, TEMPLATES)


def test_a_form_that_is_refused_is_not_chosen() -> None:
    pag = table_pag("s", ("s", "mate", "a b", {}), *((x, "atomic", "", {}) for x in "ab"))
    task = task_of(pag, {})
    assert best_forms(task)[0]["s"] != THIRD
    refused = frozenset({("s", 0), ("s", 1)})
    assert best_forms(replace(task, refused=refused))[0] == {"s": THIRD}


def test_both_axes_are_looked_at_as_matings_does() -> None:
    project = read(EXAMPLES / "truck.pag")
    found = admitted(expand(project.pag, project.templates), project.product)
    assert project.matings is not None
    for mating in project.matings.all:
        assert found[mating.label].slides[mating.approach.axis] == mating.slide


def test_a_template_without_a_robot_to_spare_is_never_changed(
    templates: dict[str, Template],
) -> None:
    bare = Project(read(EXAMPLES / "paper.pag").pag, templates)
    seen = looked_at(bare, Aim(robots="least"))
    assert {tuple(one.forms) for one in seen} == {()}


def looked_at(project: Project, aim: Aim) -> list[Candidate]:
    """All candidates of a search."""
    seen: list[Candidate] = []
    Search(project, aim).look(lambda one, _: seen.append(one))
    return seen


@pytest.fixture
def templates() -> dict[str, Template]:
    """Those of the package, but mate as it was."""
    return {name: replace(t, instead="") for name, t in TEMPLATES.items()}


def test_so_many_robots_come_before_hands_for_all_labels() -> None:
    """Where each factory with so few robots has labels that no hand can hold, one of them is given
    with a warning of that (NoGrip); among those with as few, hands come before time."""
    asked = Aim(robots=18)
    assert asked.rank(18, 9.0, bare=3) < asked.rank(28, 5.0) < asked.rank(29, 4.0)
    assert asked.rank(17, 9.0, bare=2) < asked.rank(18, 8.0, bare=3)
    least = Aim(robots="least")
    assert least.rank(28, 5.0) < least.rank(18, 9.0, bare=3)


@pytest.mark.parametrize("robots", [3, 4])
def test_only_what_can_be_the_best_is_certified(robots: int) -> None:
    """A candidate with too many robots is not, nor one whose draft is slower than the best so far.
    A draft is a lower bound of its layout, so the best is as if all were certified."""
    search, before = Search(read(EXAMPLES / "paper.pag"), Aim(robots)), dict[int, Candidate]()
    seen = list[tuple[Candidate, Candidate, bool]]()

    def look(one: Candidate, best: Candidate) -> None:
        first = id(one.project) not in before
        so_far = before.setdefault(id(one.project), seen[-1][1] if seen else best)
        certified = first and "layout" in one.project.__dict__
        if certified:
            assert one.robots <= robots
            assert so_far.robots > robots or one.least < so_far.seconds
        seen.append((one, best, certified))

    search.look(look)
    count = sum(certified for *_, certified in seen)
    assert 0 < count < len(before)
    few = [one for one, *_ in seen if one.robots <= robots and one.has_layout]
    assert all(one.least <= one.seconds + 1e-6 for one in few)
    assert search.rank(search.best) == min(map(search.rank, few))


@pytest.mark.slow
def test_forms_leave_no_robot_without_a_hand() -> None:
    project = read(EXAMPLES / "truck.pag")
    assert not project.no_grips
    found = allocated(project, Aim(robots=20, effort=20))
    assert all(grip.shared for grip in found.no_grips)
    assert len(found.plain.robots) <= 20
    certificate = found.layout.certificate
    assert certificate is not None
    assert certificate.holds


def test_hands_are_given_up_for_the_robots_that_are_asked_for(run: Terminal) -> None:
    """Where all forms that leave a hand for each label take too many robots, those of the fewest
    lines are laid out."""
    done = run("check", EXAMPLES / "chair.pag", "--robots", "7", "--effort", "2", "--json")
    assert done.status == 0, done.err
    assert done.json["robots"] == 7
    assert "NoGrip" in {warning["code"] for warning in done.json["warnings"]}


def test_few_robots_do_it_in_the_time_that_is_predicted(run: Terminal) -> None:
    paper = EXAMPLES / "paper.pag"
    done = run("run", paper, "--robots", "4", "--units", "4", "--json")
    assert done.status == 0, done.err
    assert done.json["robots"] == 4
    assert done.json["cycle_time_s"] == pytest.approx(done.json["predicted_cycle_time_s"], rel=0.02)
    few = run("check", paper, "--robots", "2", "--json")
    assert few.codes == ["TooFewRobots"]
    (error,) = few.json["errors"]
    assert error["message"] == "'sub3' needs at least 3 robots: 2 carriers and 1 tool"
    least = run("check", paper, "--robots", "least", "--json").json
    assert least["robots"] == 3
    assert least["gear_train"]
    assert least["live"]


def test_from_python() -> None:
    pag = factory.load_pag(EXAMPLES / "paper.pag")
    assert [len(factory.compile(pag, robots=n).robots) for n in (3, 4, 5, 6, None)] == [
        3,
        4,
        5,
        6,
        6,
    ]
    assert factory.compile(pag) == read(EXAMPLES / "paper.pag", settings=Settings()).plain


def test_the_cycle_of_who_delivers_has_both_ways_and_a_loss() -> None:
    pag = table_pag("x", ("x", "mate", "a b", {}), ("a", "atomic", "", {}), ("b", "atomic", "", {}))
    task = replace(task_of(pag), pace=Pace(lost=0.2))
    option = Option(0, 0, 0.0, 0, 3.0)
    cycle = 3.2 + 2 * task.pace.rest(task.size("a") + APART)
    assert _over(task, "a", option, cycle - 0.5) == pytest.approx(0.5)
    assert _over(task, "a", option, cycle) == 0.0
