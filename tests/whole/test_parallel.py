"""Parallel stations: the branch of a slow robot is there several times, and serves in turn."""

from __future__ import annotations

import contextlib
import json
import random
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from factory.apps.analyze.analysing import least_wip
from factory.apps.analyze.timed import flow, timed_net
from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.writer import certificate
from factory.apps.exports.program_text import write_program
from factory.apps.few_robots.parallel import in_parallel
from factory.apps.few_robots.sharing import with_branches
from factory.apps.report.drawings import about, labels_of, links
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import cycle_time
from factory.engine.timing.pool import part_pool
from factory.engine.timing.timing import Timing
from factory.floor.geometry.fused_bodies import repeated
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.durations import Pace, cycle_of
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.stops import stops_of
from factory.floor.mating.mating import judged
from factory.pipeline import Project, all_templates, read
from factory.support.errors import InputError
from factory.theory.nets.history import legal_marking
from factory.theory.nets.marked import marked
from factory.theory.nets.replay import replay
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from factory.theory.plant.programs import program_of
from factory.theory.problem.pag import PAG, Parameter
from factory.theory.problem.robot_types import load_catalogue
from tests.command_line import Terminal
from tests.fold_values import branched, plain, random_fold, simulated_cycle, swapped, table_of
from tests.pag_values import paper
from tests.state_space import explored

DWELL = 10.0

SLOW = (
    ("sub3", "insert", ("part3", "sub2")),
    ("sub2", "weld", ("sub1",)),
    ("sub1", "insert", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part3", "atomic", ()),
)
"""The paper's example with inserts: what is slow, a weld, is on a branch that is inserted."""


def slow() -> PAG:
    """That product, with a weld of 10 s."""
    found = table_of(SLOW)
    weld = found["sub2"]
    parameters = (Parameter("dwell", DWELL),)
    nodes = (replace(n, parameters=parameters) if n is weld else n for n in found.nodes)
    return replace(found, nodes=tuple(nodes))


def beside() -> PAG:
    """The same with a further part, which one robot brings to each unit."""
    top = (("sub4", "insert", ("sub3", "part4")), ("part4", "atomic", ()))
    return table_of((top[0], *SLOW, top[1]))


def replicated(k: int, label: str = "sub2") -> Factory:
    """Its factory with so many branches."""
    return branched(plain(slow()), (label, k))


def truth(factory: Factory, limit: int = 150_000) -> tuple[bool, bool, bool]:
    """Live, safe and reversible, by every marking."""
    found = explored(marked(factory.net), limit)
    assert found is not None
    return found.behaviour


# --- the net -------------------------------------------------------------------------------------


def test_one_branch_changes_nothing() -> None:
    factory = plain(slow())
    assert in_parallel(factory, (("sub2", 1),)) is factory.plan


@pytest.mark.parametrize("k", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_parallel_branches_are_live_safe_and_reversible(k: int) -> None:
    """By the proof, and by every marking."""
    factory = replicated(k)
    verdict = verify(factory.net)
    assert verdict.holds and verdict.gear_train and not verdict.faults
    assert truth(factory) == (True, True, True)


def test_robots_and_stations() -> None:
    """The branch has three robots and is there three times; all others are there once."""
    factory = replicated(3)
    assert (len(plain(slow()).robots), len(factory.robots)) == (4, 10)
    assert factory.period == 3 and factory.products == ("sub3", "sub3@2", "sub3@3")
    assert [len(tours) for tours in factory.tours] == [3] + [1] * 9
    brought = [factory.by_label[label] for label in factory.products]
    assert [o.robots for o in brought] == [(0, 1), (0, 2), (0, 3)]
    assert {o.written for o in brought} == {"sub3"}


def delays(factory: Factory) -> list[float]:
    """A second for each operation, and what it takes there."""
    return [1.0 + operation.dwell for operation in factory.operations]


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5, 6])
def test_theorem_4(k: int) -> None:
    """The cycle time is the greater of that of the rest and that of the branch, divided by k."""
    factory = replicated(k)
    rest, branch = 3.0, 1.0 + 1.0 + 11.0 + 1.0
    found = cycle_time(factory, delays(factory))
    assert found.seconds == pytest.approx(max(rest, branch / k))
    seconds = [*delays(factory), *[0.0] * (len(factory.net.threaded.places))]
    seconds = seconds[: len(factory.net.threaded.places)]
    token_game = simulated_cycle(factory.net, seconds) / k
    assert token_game == pytest.approx(found.seconds)


def test_random_branches() -> None:
    """Branches of random products, of folds too, one within another: live, and of the period that
    their numbers give; Theorem 4 by the token game."""
    made = 0
    for seed in range(16):
        rng = random.Random(seed)
        factory = random_fold(seed, 14)
        labels = [
            o.before[o.robots.index(tour.index)]
            for tour in factory.robots[1:]
            for o in [factory.operations[tour.operations[-1]]]
            if o.before[o.template.carrier - 1] != "nopart" and len(o.robots) == 2
        ]
        labels = [label for label in labels if label != "nopart"]
        chosen = [(label, rng.randint(1, 3)) for label in rng.sample(labels, min(2, len(labels)))]
        try:
            found = branched(factory, *chosen)
        except InputError as error:
            assert "one robot brings" in str(error) or "room for 2" in str(error)
            continue
        made += 1
        verdict = verify(found.net)
        assert verdict.holds and not verdict.faults
        assert len(found.making) == found.period * len(factory.making)
        times = [rng.uniform(0.5, 3.0) for _ in factory.operations]
        number = {o.label: n for n, o in enumerate(factory.operations)}
        seconds = [times[number[o.written]] for o in found.operations]
        unit = cycle_time(found, seconds).seconds
        assert unit <= cycle_time(factory, times).seconds + 1e-9
        places = len(found.net.threaded.places)
        game = simulated_cycle(found.net, [*seconds, *[0.0] * (places - len(seconds))])
        assert game / found.period == pytest.approx(unit, rel=1e-2)
    assert made > 8


def test_a_station_out_of_turn_is_refused() -> None:
    """Two units of the output robot's program exchanged: dead, with a circuit that says so."""
    factory = branched(plain(beside()), ("sub2", 3))
    assert verify(factory.net).holds
    for one, other in ((0, 1), (1, 2), (0, 2)):
        verdict = verify(swapped(factory, 0, one, other))
        assert verdict.gear_train and not verdict.live
        assert "carries no token" in str(verdict.faults[0])


def test_copies_inside() -> None:
    """As many as without, and one more for each further branch."""
    pool = part_pool(replicated(3))
    assert sum(n for label, n in pool.items() if label.startswith("part1")) == 6


def test_programs_of_a_period() -> None:
    factory = replicated(2)
    output, first, second = (write_program(program_of(factory, robot)) for robot in (0, 1, 2))
    assert "If state_1 = nopart ∧ next_1 = part3@2\n" in output
    assert "Run ẋ_1 = π_1 ∘ insert(x_1, x_3) Until state_1 = sub3@2\n" in output
    assert "next_1 := part3\n" in output
    assert "Run ẋ_2 = wait Until state_1 = part3\n" in first
    assert "Run ẋ_3 = wait Until state_1 = part3@2\n" in second


@pytest.mark.parametrize("k", [2, 3])
def test_the_certificate_is_checked_by_the_other_program(k: int) -> None:
    net = replicated(k).net
    document = json.loads(json.dumps(certificate(net, verify(net))))
    assert check_certificate(document) == []


@pytest.mark.parametrize(
    ("label", "words", "hint"),
    [
        ("sub3", "is made by the output robot", "mate"),
        ("sub1", "it becomes 'sub2' on its robot", "name 'sub2'"),
        ("sub9", "there is no label 'sub9'", "did you mean"),
    ],
)
def test_what_has_no_branch_of_its_own(label: str, words: str, hint: str) -> None:
    with pytest.raises(InputError) as error:
        replicated(2, label)
    (diagnostic,) = error.value.diagnostics
    assert diagnostic.code == "Parallel" and words in diagnostic.message
    assert hint in diagnostic.hint


def test_a_mate_has_room_for_two_on_a_side() -> None:
    with pytest.raises(InputError, match="room for 2 branches"):
        in_parallel(plain(paper()), (("sub2", 3),))


# --- layout and runs -----------------------------------------------------------------------------


@cache
def project(k: int) -> Project:
    """That product with so many branches."""
    made = Project(slow(), all_templates(), load_catalogue())
    return with_branches(made, [("sub2", k)])


def carried_out(k: int, world: WorldName, units: int, **more: Any) -> Run:
    """A run of it, with a monitor where there are bodies."""
    made = project(k)
    request = RunRequest(world, units, settings=made.settings, **more)
    simulation = Simulation(made.layout, request)
    return simulation.run() if world == "ideal" else watched(simulation, every_tick=True)


def made_in_order(run: Run, k: int) -> bool:
    """Whether dropoffs come in turn."""
    names = ["dropoff_e", *(f"dropoff@{turn + 1}_e" for turn in range(1, k))]
    left = [e.transition for e in run.events if e.transition in names]
    return left == [names[unit % k] for unit in range(run.units)]


@pytest.mark.parametrize("k", [2, 3])
def test_layouts_are_certified_and_run_at_the_pace_of_the_net(k: int) -> None:
    layout = project(k).layout
    assert layout.certificate is not None and layout.certificate.holds
    sides = {layout.side(layout.factory.by_label[x]) for x in layout.factory.products}
    assert sides == {-1, +1}
    run = carried_out(k, "ideal", 36)
    assert run.succeeded and made_in_order(run, k)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)


def test_the_floor_and_the_bound_are_those_of_one_unit() -> None:
    layout = project(3).layout
    pace = Pace.of(project(3).settings)
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, pace)
    assert 10.0 / 3 < bound < cycle_of(layout, pace) < 5.0


def test_three_branches_in_mujoco() -> None:
    """No contact, each product is right, and the monitor explains the run."""
    run = carried_out(3, "mujoco", 12)
    assert run.succeeded and run.refines_net and made_in_order(run, 3)
    assert run.physics is not None and not run.physics.unintended_contacts
    assert run.physics.product_error_max_mm is not None
    assert run.physics.product_error_max_mm < 0.001
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.06)


@pytest.mark.parametrize("world", ["ideal", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_robots_that_run_their_own_programs(world: WorldName) -> None:
    run = carried_out(3, world, 7, distributed=True)
    assert run.succeeded and made_in_order(run, 3)


def test_a_bound_on_units_inside() -> None:
    run = carried_out(3, "ideal", 36, wip=2)
    assert run.bottleneck == "wip 2"
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)


def test_a_run_that_starts_in_the_middle() -> None:
    """One that has a part from a feeder with several; the next is not there yet."""
    start = legal_marking(project(3).layout.factory.net, "sub3@2, sub2")
    run = carried_out(3, "mujoco", 4, start=start)
    assert run.succeeded and run.refines_net


def test_products_out_of_order_are_no_run_of_the_net() -> None:
    """Two branches that had exchanged their stations would serve each other's units."""
    run = carried_out(3, "ideal", 6)
    other = {"sub3_": "sub3@2_", "sub3@2_": "sub3_"}
    names = [e.transition for e in run.events]
    exchanged = [
        next((name.replace(a, b) for a, b in other.items() if name.startswith(a)), name)
        for name in names
    ]
    net = project(3).layout.factory.net
    assert replay(net, names).refines and not replay(net, exchanged).refines


def test_a_part_in_the_wrong_branch_is_found() -> None:
    """A weld that takes a part of another unit."""
    made = project(2)
    request = RunRequest("mujoco", 2, settings=made.settings)
    simulation = Simulation(made.layout, request)
    parts = simulation.physical.parts
    welds, one, other = parts.holdings.weld, (2, "part1"), (3, "part1@2")
    welds[one], welds[other] = welds[other], welds[one]
    run = watched(simulation, max_time=15.0, every_tick=True)
    assert not run.succeeded and not run.refines_net


def test_analysis_tells_of_products() -> None:
    layout, settings = project(3).layout, project(3).settings
    timing = Timing(layout, settings, "ideal")
    net = timed_net(timing)
    run = carried_out(3, "ideal", 24)
    assert net.pace == pytest.approx(run.predicted_cycle_time_s, rel=1e-6)
    found = flow(timing, net, 24)
    assert found.last == pytest.approx(run.dropoffs[-1], rel=0.01)
    assert all(share.cycle == pytest.approx(3 * net.pace) for share in found.shares)
    assert timed_net(timing, wip=least_wip(timing)).pace == pytest.approx(net.pace)


def test_a_report_links_what_belongs_together() -> None:
    factory = project(2).layout.factory
    labels = labels_of(factory)
    assert [about(labels, x) for x in ("sub1", "sub1@2", "sub1/2@2", "x@2")] == [*["sub1"] * 3, ""]
    every = links(factory)
    assert every["robot"][1]["labels"] == every["robot"][2]["labels"] != []


# --- commands ------------------------------------------------------------------------------------


def hands_of(name: str, *branches: tuple[str, int]) -> dict[tuple[object, ...], list[Hand | None]]:
    """The hands that the robots of an example have, by what they take first, however they lie."""
    example = read(f"examples/{name}.pag")
    plain = (with_branches(example, branches) if branches else example).plain
    factory = judged(plain, example.product)
    hands = Hands(factory, repeated(example.product, factory))
    found: dict[tuple[object, ...], list[Hand | None]] = {}
    for robot, tours in enumerate(hands.tours.of):
        first = factory.first(robot).written
        for u, t in hands.holding.frames(tours[0]):
            hand = hands.hand(robot, u, t)
            same = replace(hand, covered=hand.covered[:1]) if hand else None
            found.setdefault(
                (first, factory.up(robot) and factory.lowering(robot), u, t), []
            ).append(same)
    return found


def branches_of(name: str) -> list[str]:
    """The labels of an example whose branch can be there twice."""
    factory, found = read(f"examples/{name}.pag").plain, []
    for label in dict.fromkeys(o.written for o in factory.operations[:-1]):
        with contextlib.suppress(InputError):
            in_parallel(factory, ((label, 2),))
            found.append(label)
    return found


@pytest.mark.parametrize(("name", "label", "most"), [("truck", "log2", 1.03), ("shelf", "back", 1)])
def test_a_second_branch_is_placed_for_all_units_together(
    name: str, label: str, most: float
) -> None:
    """The carrier stops at one of the branches in each unit, and goes past the other."""
    project = read(f"examples/{name}.pag")
    once, twice = project.draft, with_branches(project, [(label, 2)]).draft
    assert cycle_of(twice, Pace()) <= most * cycle_of(once, Pace())


EXAMPLES = ["chair", "chest", "gearbox", "lamp", "shelf", "stool", "truck"]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n == "stool" else pytest.mark.slow) for n in EXAMPLES]
)
def test_a_branch_that_is_there_twice_has_the_hands_of_one(name: str) -> None:
    """Hands are chosen by one rule, whether a robot does the same once or for each unit."""
    once, branches = hands_of(name), branches_of(name)
    assert branches
    for label in branches:
        for where, hands in hands_of(name, (label, 2)).items():
            assert all([hand] == once[where] for hand in hands), (label, where)


def test_stations_of_a_branch_are_passed_one_way() -> None:
    """A carrier goes ahead from stop to stop on each of its tours, though it meets the second
    branch in the second tour first after one that is further on."""
    factory = branched(plain(beside()), ("sub2", 3))
    carrier = factory.operations[factory.dropoffs[0].index].carrier
    stops, returns = stops_of(factory, carrier)
    places = {o.index: n for n, stop in enumerate(stops) for o in stop.operations}
    assert not returns
    assert [o.written for stop in stops for o in stop.unlike].count("sub3") == 3
    for tour in factory.tours[carrier]:
        way = [places[number] for number in tour if number in places]
        assert way == sorted(way)


TEXT = """root = sub3;
sub3 = insert ( part3, sub2 ); sub2 = weld ( sub1, dwell = 2 ); sub1 = insert ( part1, part2 );
part1 = atomic(); part2 = atomic(); part3 = atomic()
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """That product in a file."""
    path = tmp_path / "slow.pag"
    path.write_text(TEXT)
    return path


def test_the_option_and_the_table_say_the_same(run: Terminal, file: Path) -> None:
    one = run("check", file, "--json").json
    two = run("check", file, "--parallel", "sub2=2", "--json").json
    assert (one["robots"], two["robots"]) == (4, 7)
    assert two["live"] and two["safe"] and two["reversible"]
    file.with_name("factory.toml").write_text("[parallel]\nsub2 = 2\n")
    assert run("check", file, "--json").json == two
    assert run("check", file, "--parallel", "sub2=1", "--json").json == one


def test_a_branch_that_gains_nothing_is_named(run: Terminal, file: Path) -> None:
    """`analyze` says so where the factory with one branch is no slower, and only there."""
    alone = run("analyze", "examples/paper.pag", "--json").json["cycle_time_s"]
    for label in ("part3", "sub2"):  # that of sub2 takes long enough for two, by itself
        paper = run("analyze", "examples/paper.pag", "--parallel", f"{label}=2").out
        assert f"one branch for {label} would do: {alone:.3f} s with one" in paper
    file.write_text(TEXT.replace("dwell = 2", f"dwell = {DWELL}"))
    assert "would do" not in run("analyze", file, "--parallel", "sub2=2").out


@pytest.mark.parametrize(
    ("name", "label"), [("paper", "sub2"), pytest.param("truck", "log2", marks=pytest.mark.slow)]
)
def test_a_unit_waits_for_none_that_comes_after_it(name: str, label: str) -> None:
    """Units are made one after the other in the order by which machines are kept apart: the last
    unit that is asked for does not wait for a part of a unit that nobody asks for."""
    layout = with_branches(read(f"examples/{name}.pag"), [(label, 2)]).layout
    turns = [layout.factory.operations[number].turn for number in layout.factory.order]
    assert turns == sorted(turns)
    assert watched(Simulation(layout, RunRequest("ideal", units=1)), max_time=120.0).succeeded
