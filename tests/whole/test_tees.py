"""Tees: two branches come to one place from one side, over a stem that they share."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from factory.apps.few_robots.parallel import in_parallel
from factory.apps.few_robots.sharing import with_branches, with_tees
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.clearance import certify
from factory.floor.layout.fork import Fork
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, all_templates, read
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.compiler.tees import heads, on_stems
from factory.theory.nets.verify import verify
from factory.theory.problem.pag import PAG, Parameter
from factory.theory.problem.robot_types import load_catalogue
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.fold_values import branched, plain, table_of
from tests.pag_values import paper

SLOW = 4.0
"""How long a feeder takes, or a branch [s]."""

FED = (
    ("sub2", "mate", ("sub1", "part3")),
    ("sub1", "mate", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part3", "feed", ()),
)

GLUED = (
    ("sub2", "mate", ("sub1", "part4")),
    ("sub1", "mate", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part4", "glue", ("part3",)),
    ("part3", "atomic", ()),
)


def feed() -> Template:
    """A feeder that takes its time."""
    atomic = all_templates()["atomic"]
    return replace(atomic, name="feed", law=replace(atomic.law, dwell=SLOW))


@cache
def project(branches: int, label: str = "part3", rows: tuple[object, ...] = FED) -> Project:
    """A product whose slow part comes to a mate, in so many branches."""
    pag: PAG = table_of(rows)  # type: ignore[arg-type]
    nodes = tuple(
        replace(node, parameters=(Parameter("dwell", SLOW),)) if node.operation == "glue" else node
        for node in pag.nodes
    )
    templates = {**all_templates(), "feed": feed()}
    made = Project(replace(pag, nodes=nodes), templates, load_catalogue(), Settings())
    return with_branches(made, [(label, branches)])


def carried_out(layout: Layout, units: int = 10, **more: object) -> Run:
    """A run in the engine, with its monitor."""
    request = RunRequest("mujoco", units, **more)  # type: ignore[arg-type]
    return watched(Simulation(layout, request), every_tick=True)


# --- which robots share a stem -------------------------------------------------------------------


def test_robots_on_one_stem() -> None:
    """Those that bring a label to the same mate, and those of their branches."""
    factory = branched(plain(paper()), ("sub2", 2))
    names = {robot.name: robot for robot in factory.robots}
    first = heads(factory)
    pairs = {(first[n], n) for n in range(len(first)) if first[n] != n}
    assert len(factory.robots) == 10 and len(pairs) == 4
    for one, other in pairs:
        written = [
            [factory.operations[n].written for n in factory.robots[r].operations]
            for r in (one, other)
        ]
        assert written[0] == written[1]
    assert len(names) == 10


def test_the_factory_on_stems_is_that_of_one_branch_unit_by_unit() -> None:
    """With each operation where it was, its net live."""
    factory = branched(plain(paper()), ("sub2", 2))
    stems, place = on_stems(factory)
    assert len(stems.robots) == len(plain(paper()).robots)
    assert verify(stems.net).holds
    for one, other in zip(factory.operations, stems.operations, strict=True):
        assert (one.label, tuple(place[r] for r in one.robots)) == (other.label, other.robots)
    assert [len(tours) for tours in stems.tours] == [2] * len(stems.robots)


def test_no_tee_no_change() -> None:
    factory = plain(paper())
    assert on_stems(factory) == (factory, tuple(range(len(factory.robots))))
    with pytest.raises(InputError, match="room for 2 branches, on a tee"):
        in_parallel(factory, (("sub2", 3),))


# --- the layout ----------------------------------------------------------------------------------


def on_stem(layout: Layout) -> tuple[int, int]:
    """The robots (index) that share a stem."""
    one, other = sorted(layout.stems)
    return one, other


def test_arms_lie_beside_each_other_and_end_as_one() -> None:
    layout = project(2).layout
    one, other = on_stem(layout)
    straight, bent = (layout.guidepaths[robot] for robot in (one, other))
    assert not straight.bends and len(bent.bends) == 1
    assert straight.middle(straight.reach) == pytest.approx(bent.middle(bent.reach))
    (x, y), (z, w) = straight.carriage(straight.length), bent.carriage(bent.length)
    assert abs(x - z) + abs(y - w) == pytest.approx(abs(bent.bends[0].across))


def test_the_certificate_names_the_circuit_that_keeps_two_goals_apart() -> None:
    layout = project(2).layout
    certificate = layout.certificate
    assert certificate is not None and certificate.holds
    names = {layout.factory.robots[robot].name for robot in on_stem(layout)}
    ends = [pair for pair in certificate.apart.excluded if {*pair.machines} == names]
    delivering = [pair for pair in ends if {*pair.places} == {"sub2", "sub2@2"}]
    assert delivering and all({*pair.places} <= {*pair.circuit} for pair in ends)


def test_a_short_arm_is_found() -> None:
    """The planted fault: the robot that waits is in the way of the one that rounds the corner."""
    made = project(2)
    layout = made.layout
    one, other = on_stem(layout)
    paths = list(layout.guidepaths)
    paths[one] = replace(paths[one], travel=round(paths[one].travel - 0.08, 3))
    length = paths[one].length
    visits = {
        (number, robot): replace(visit, at=min(visit.at, length)) if robot == one else visit
        for (number, robot), visit in layout.visits.items()
    }
    certificate = certify(replace(layout, guidepaths=tuple(paths), visits=visits))
    assert any("come" in fault.message or "apart" in fault.message for fault in certificate.faults)
    assert not certificate.holds and other


def test_forks_are_the_nearest_to_either_side() -> None:
    """Half a metre aside leaves the straight arm as it is."""
    layout = project(1).layout
    fork = Fork(1, 0.1, 0.2, -0.5)
    straight, bent = fork.detours(layout, 0.02)
    travel = layout.guidepaths[1].travel
    assert straight.travel == pytest.approx(travel + 0.3)
    assert bent.travel == pytest.approx(travel + 0.8)
    assert bent.bends[0].at == pytest.approx(layout.guidepaths[1].reach + travel + 0.1)


# --- runs ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("label", "rows", "share"), [("part3", FED, 0.65), ("part4", GLUED, 0.7)])
def test_a_slow_branch_costs_little_more_than_half(
    label: str, rows: tuple[object, ...], share: float
) -> None:
    """At most 0.65 of one branch's cycle with a slow feeder, predicted within 2 %, and nothing
    touches; a branch with a tool is so wide that ways are longer."""
    one, two = (carried_out(project(k, label, rows).layout, 8) for k in (1, 2))
    assert one.succeeded and two.succeeded
    assert two.physics is not None and not two.physics.unintended_contacts
    assert one.cycle_time_s is not None and two.cycle_time_s is not None
    assert two.cycle_time_s <= share * one.cycle_time_s
    assert two.cycle_time_s == pytest.approx(two.predicted_cycle_time_s, rel=0.02)


def test_logs_and_plans_keep_bends(run: Terminal, tmp_path: Path) -> None:
    """What is recorded is explained and rendered again; a plan makes the same layout."""
    log, folder = tmp_path / "tee.log", tmp_path / "made"
    asked = "examples/paper.pag", "--parallel", "part3=2"
    made = run("run", *asked, "--units", 2, "--log", log, "--json").json
    assert made["refines_net"] and made["unintended_contacts"] == 0
    seen = run("monitor", log, "--json")
    assert seen.status == 0
    run("build", *asked, "-o", folder, "-q")
    again = run("run", folder / "plan.json", "--units", 2, "--json").json
    assert again["events"] == made["events"]


def test_both_inputs_of_a_mate_may_come_over_tees() -> None:
    """From either side, each with a branch of its own."""
    layout = with_branches(read("examples/paper.pag"), [("part3", 2), ("sub2", 2)]).layout
    assert len(layout.stems) == 4
    assert carried_out(layout, 2).succeeded


def test_a_branch_of_a_tee_is_not_replicated_itself() -> None:
    with pytest.raises(InputError, match="is in the branch of 'sub2', which comes over a tee"):
        in_parallel(plain(paper()), (("sub2", 2), ("part1", 2)))


STEMMED = (
    ("sub2", "insert", ("sub1", "part3")),
    ("sub1", "insert", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part3", "atomic", ()),
)


def inserted() -> Project:
    """A pile into which two parts are inserted from one side."""
    return Project(table_of(STEMMED), all_templates(), load_catalogue(), Settings())


def test_two_labels_share_a_stem() -> None:
    """With a robot each, whose guidepaths end as one."""
    made = with_tees(inserted(), [("part2", "part3")])
    assert len(made.plain.robots) == len(inserted().plain.robots)
    layout = made.layout
    assert len(layout.stems) == 2
    assert carried_out(layout, 4).succeeded


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (("part1", "part2"), "'part1' and 'part2' are both needed in 'sub1'"),
        (("part3", "part1"), "cannot share a stem: they deliver to different robots"),
        (("part1", "part2", "part3"), "has room for 2 robots"),
    ],
)
def test_bad_tees(labels: tuple[str, ...], words: str) -> None:
    made = Project(paper(), all_templates(), load_catalogue(), Settings())
    with pytest.raises(InputError, match=words) as error:
        with_tees(made, [labels])
    assert error.value.diagnostics[0].code == "BadTee"


def test_the_table_is_read(run: Terminal, tmp_path: Path) -> None:
    """And does not go with a search for robots."""
    text = "root = t; t = insert ( s, c ); s = insert ( a, b ); a = atomic(); b = atomic();"
    pag = tmp_path / "own.pag"
    pag.write_text(f"{text} c = atomic();")
    pag.with_name("factory.toml").write_text('[tees]\nstem = ["b", "c"]\n')
    run("build", pag, "-o", tmp_path / "made", "-q")
    plan = json.loads((tmp_path / "made" / "plan.json").read_text())
    assert len(plan["plan"]["tees"]) == 1
    assert run("check", pag, "--robots", "least", "--json").codes == ["BadValue"]


def check_jitter(seeds: range, units: int) -> None:
    """Robots whose speeds differ by 30 % never stall, nor touch."""
    for seed in seeds:
        made = carried_out(project(2).layout, units, seed=seed, jitter=0.3)
        assert made.succeeded and made.units == units


def test_jitter() -> None:
    check_jitter(range(2), 4)


@pytest.mark.slow
def test_twenty_seeds() -> None:
    check_jitter(range(20), 20)


def test_only_order_places_keep_robots_apart() -> None:
    """The planted fault: nothing keeps the second robot from coming while the first goes back,
    which takes long where speeds differ by 90 %."""
    layout = project(2).layout
    certificate = layout.certificate
    assert certificate is not None and certificate.apart.orders
    apart = replace(certificate.apart, orders=())
    planted = replace(layout, certificate=replace(certificate, apart=apart))
    right, wrong = (carried_out(made, 6, jitter=0.9) for made in (layout, planted))
    assert right.succeeded
    assert "r2/carriage hit r3/carriage" in wrong.verdict.failures[0].message
