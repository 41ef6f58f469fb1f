"""Forms: a third robot takes what two bring, or the robot of one of them keeps it. The product is
the same, the net is proved as before, and the choice is the best for what it goes by."""

from __future__ import annotations

import hashlib
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest

from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.folding import fold
from factory.apps.few_robots.forms import (
    APART,
    FormsTask,
    Option,
    _over,
    best_forms,
    joins,
)
from factory.apps.few_robots.lines import Admitted, Shift
from factory.apps.few_robots.parallel import in_parallel
from factory.apps.few_robots.search import allocated
from factory.apps.few_robots.sharing import with_branches
from factory.apps.log.plan_file import PLAN_NAME, plan_files, read_plan
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.clearance import certify
from factory.floor.layout.durations import Pace
from factory.floor.layout.saved import LayoutTable
from factory.floor.layout.shapes import payload_boxes
from factory.floor.mating.mating import judged
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project, read
from factory.support.errors import Diagnostic, InputError, RunError
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.theory.compiler.assigning import shared
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.tees import on_stems
from factory.theory.lang.template_reader import load_templates
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import Plan
from tests.command_line import Terminal
from tests.layout_values import table_pag
from tests.pag_values import TEMPLATES as OWN
from tests.paths import EXAMPLES
from tests.random_products import random_product
from tests.state_space import explored

TEMPLATES = {**OWN, **load_templates([templates_folder()])}
"""The shipped ones, and those that random PAGs use beside them."""


def task_of(pag: PAG, admits: dict[str, Admitted] | None = None) -> FormsTask:
    """With sub-assemblies of many sizes, that follow from their labels."""
    plain = compile_pag(pag, TEMPLATES, load_catalogue())
    boxes = {
        label: (0.0, 0.05 + sum(map(ord, label)) % 7 / 20, 0.0, 0.1) for label in plain.contents
    }
    return FormsTask(pag, TEMPLATES, admits or {}, boxes, Pace())


def test_a_form_that_is_refused_is_not_chosen() -> None:
    pag = table_pag("s", ("s", "mate", "a b", {}), *((x, "atomic", "", {}) for x in "ab"))
    task = task_of(pag, {})
    assert best_forms(task)[0]["s"] != Plan.THIRD
    refused = frozenset({("s", 0), ("s", 1)})
    assert best_forms(replace(task, refused=refused))[0] == {"s": Plan.THIRD}


def test_so_many_robots_come_before_hands_for_all_labels() -> None:
    """Where each factory with so few robots has labels that no hand can hold, one of them is given
    with a warning of that (NoGrip); among those with as few, hands come before time."""
    asked = Aim(robots=18)
    assert asked.rank(18, 9.0, bare=3) < asked.rank(28, 5.0) < asked.rank(29, 4.0)
    assert asked.rank(17, 9.0, bare=2) < asked.rank(18, 8.0, bare=3)
    least = Aim(robots="least")
    assert least.rank(28, 5.0) < least.rank(18, 9.0, bare=3)


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


def random_plan(project: Project, rng: random.Random) -> Project:
    """A product by some plan: forms, lines, and a branch that is there several times."""
    free = [
        label
        for node in project.pag.nodes
        if project.templates[node.operation].instead and len(node.inputs) > 1
        for label in joins(node)
    ]
    if rng.random() < 0.7:
        forms = {label: rng.choice((Plan.THIRD, 0, 1)) for label in free if rng.random() < 0.5}
        project = project.with_plan(Plan(forms))
    base = judged(project.compiled, project.product)
    if rng.random() < 0.7:
        boxes = payload_boxes(base, project.product)
        shift = Shift.of(base, project.catalogue, boxes, Pace.of(project.settings))
        fillings = [f for f in islice(shift.fillings(1.3), 40) if shift.lines(f)]
        if fillings:
            project = project.with_plan(shift.plan(rng.choice(fillings)))
    labels = [
        x for robot in project.planned.robots[1:] for x in project.planned.deliveries(robot.index)
    ]
    for label in rng.sample(labels, min(2, len(labels))):
        try:
            return with_branches(project, [(label, rng.choice((2, 3)))])
        except InputError:
            continue
    return project


def check(seed: int, folder: Path) -> None:
    """One random product by one random plan."""
    file, rng = folder / "product.pag", random.Random(seed)
    file.write_text(random_product(seed))
    project = random_plan(read(file, (), Settings(timestep=0.001, substeps=1)), rng)
    try:
        layout = project.layout
    except RunError as error:
        assert error.diagnostics[0].code == "Layout"
        return
    factory = layout.factory
    assert verify(factory.net).holds
    truth = explored(MarkedNet.of(factory.net), 500) if len(factory.operations) < 12 else None
    assert truth is None or truth.behaviour == (True, True, True)
    when = {number: n for n, number in enumerate(factory.order)}
    for robot in factory.robots:
        steps = [when[number] for number in robot.operations]
        assert steps == sorted(steps), "one unit is made operation by operation"
    assert certify(layout).holds
    units = 6 * factory.period
    request = RunRequest("ideal", units, settings=project.settings, shown=False)
    run = Simulation(layout, request).run()
    assert run.refines_net and run.products == units
    ticks = max(len(robot.operations) for robot in factory.robots) / factory.period
    assert run.cycle_time_s == pytest.approx(
        run.predicted_cycle_time_s, rel=0.005, abs=ticks * project.settings.tick
    )
    for path, content in plan_files(project, folder).items():
        path.write_bytes(content)
    kept, said = read_plan(folder / PLAN_NAME), list[Diagnostic]()
    again = kept.project(kept.settings, kept.ground, said.append)
    assert LayoutTable.of(again.layout) == LayoutTable.of(layout) and not said
    assert again.layout.factory == factory and again.layout.certificate == layout.certificate
    anew = replace(again, laid=None).layout
    assert anew.factory == factory
    assert (anew.guidepaths, anew.visits) == (layout.guidepaths, layout.visits)


@pytest.mark.slow
@pytest.mark.parametrize("seed", (7, *range(100, 1100)))
def test_a_thousand_plans(seed: int, tmp_path: Path) -> None:
    check(seed, tmp_path)


def test_a_plan_with_other_tours_is_refused() -> None:
    project = read("examples/paper.pag")
    with pytest.raises(InputError, match="6 tours"):
        shared(project.compiled, Plan(turns=((0, 1),)), project.catalogue)
    with pytest.raises(InputError, match="robots are named"):
        shared(project.compiled, Plan(turns=((0, 1, 2, 3, 4, 9),)), project.catalogue)


PRODUCTS = ("truck", "lamp", "stool", "shelf")
LONG = ("chair", "gearbox", "chest")
FILLINGS = 12
"""So many ways to fill lines are looked at."""


def digest(factory: Factory) -> str:
    """A digest of all that is compiled: operations, programs, net, parents, period."""
    robots = [(r.name, r.type, r.operations) for r in factory.robots]
    operations = [
        (o.label, o.template.name, o.robots, o.before, o.after, o.dwell, o.turn)
        for o in factory.operations
    ]
    net = factory.net
    places = [(p.left, p.right, p.name, p.mode, p.label) for p in net.threaded.net.places]
    gears = [(g.robot, g.type, g.places, g.transitions) for g in net.gears]
    kept = robots, operations, places, gears, factory.parents, factory.period, net.initial
    return hashlib.sha256(repr(kept).encode()).hexdigest()[:16]


def variants(file: Path) -> Iterator[tuple[str, Factory]]:
    """The variants of a product's factory, by name."""
    project = read(file)
    base, catalogue = judged(project.compiled, project.product), project.catalogue
    yield "as written", base
    shift = Shift.of(base, catalogue, payload_boxes(base, project.product), Pace())
    every = dict.fromkeys(map(shift.lines, islice(shift.fillings(1.3), 60)))
    plans = [fold(base, lines, catalogue) for lines in islice(filter(None, every), FILLINGS)]
    folds = [shared(base, plan, catalogue) for plan in plans]
    for number, folded in enumerate(folds):
        yield f"fold {number}", folded
    for name, factory in (("written", base), *((f"fold {n}", f) for n, f in enumerate(folds[-2:]))):
        for robot in factory.robots[1:]:
            for label in factory.deliveries(robot.index)[:1]:
                for k in (2, 3):
                    try:
                        made = shared(base, in_parallel(factory, [(label, k)]), catalogue)
                    except InputError:
                        continue
                    if on_stems(made)[0] is not made:  # tees have tests of their own
                        continue
                    yield f"{name}, {label} = {k}", made


@pytest.mark.parametrize(
    "product", [*PRODUCTS, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)]
)
def test_every_variant_is_as_it_was(product: str, golden: Callable[[str, str], None]) -> None:
    lines = [f"{digest(made)} {name}" for name, made in variants(Path(f"examples/{product}.pag"))]
    golden(f"assignments/{product}.txt", "\n".join(lines) + "\n")


def test_the_cycle_of_who_delivers_has_both_ways_and_a_loss() -> None:
    pag = table_pag("x", ("x", "mate", "a b", {}), ("a", "atomic", "", {}), ("b", "atomic", "", {}))
    task = replace(task_of(pag), pace=Pace(lost=0.2))
    option = Option(0, 0, 0.0, 0, 3.0)
    cycle = 3.2 + 2 * task.pace.rest(task.size("a") + APART)
    assert _over(task, "a", option, cycle - 0.5) == pytest.approx(0.5)
    assert _over(task, "a", option, cycle) == 0.0
