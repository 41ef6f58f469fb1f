"""Folds: their nets are live gear trains, as exploring says, and no other order of tours is."""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from factory.apps.analyze.analysing import operation_slacks
from factory.apps.analyze.timed import timed_net
from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.listing import digest
from factory.apps.exports.certificate.writer import certificate
from factory.apps.exports.pnml import write_pnml
from factory.apps.exports.program_text import write_program
from factory.apps.few_robots import folding
from factory.apps.few_robots.folding import (
    Line,
    fold,
    folded,
    kept_apart,
    line_of,
    lines_of_labels,
)
from factory.apps.foreign_nets.behaviour import analyse, play
from factory.apps.foreign_nets.pnml_reader import read_pnml
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import CycleTime, cycle_time
from factory.engine.timing.timing import Timing
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.bounds import _Bound
from factory.floor.layout.durations import Pace, cycle_of
from factory.support.errors import InputError, RunError
from factory.support.settings import Settings
from factory.theory.compiler.assigning import shared
from factory.theory.lang import write_pag
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.history import firings, legal_marking, unreached
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.petri import Marking
from factory.theory.nets.verdict import BEHAVIOUR
from factory.theory.nets.verify import proved, verify
from factory.theory.plant.factory import Factory
from factory.theory.plant.programs import program_of
from tests.command_line import Terminal
from tests.fold_values import (
    fold_layout,
    inserted,
    lines_of_one_side,
    pairs_of_tours,
    plain,
    random_fold,
    random_lines,
    robot_of,
    simulated_cycle,
    swapped,
    table_of,
    three_robots,
    with_sides,
)
from tests.layout_values import table_pag
from tests.net_values import legal_markings, lost_token, net_from, random_legal_marking
from tests.pag_values import SHAPES, catalogue, paper, random_pag
from tests.state_space import explored

Json = dict[str, Any]
SMALL = 1_200
"""So many markings are explored at most."""


def starting_at(net: GearNet, marking: Marking) -> MarkedNet:
    subject = marked(net)
    tokens = tuple(int(place in marking) for place in range(len(subject.tokens)))
    return MarkedNet(subject.net, tokens, subject.gears, subject.slots)


def judged(net: GearNet | MarkedNet) -> tuple[bool | None, ...]:
    found = verify(net)
    return found.live, found.safe, found.reversible


# --- Theorem 2 -----------------------------------------------------------------------------------


def folds_are_live(seeds: range, size: int) -> tuple[int, int]:
    """How many of these random folds have robots with several tours, and how many were explored."""
    shared = small = 0
    for seed in seeds:
        factory = random_fold(seed, size)
        verdict = verify(factory.net)
        assert verdict.holds and not verdict.faults, seed
        assert verdict.gear_train and verdict.gear_net is factory.net.is_tree
        assert factory.folded is not factory.net.is_tree
        assert sorted(factory.order) == list(range(len(factory.operations)))
        assert factory.order[-1] == factory.dropoff.index
        shared += factory.folded
        if len(factory.operations) < 12:
            truth = explored(marked(factory.net), SMALL)
            assert truth is None or truth.behaviour == (True, True, True), seed
            small += truth is not None
    return shared, small


@pytest.mark.parametrize(
    "block", [*range(3), *(pytest.param(n, marks=pytest.mark.slow) for n in range(3, 10))]
)
def test_a_thousand_random_folds_are_live_safe_and_reversible(block: int) -> None:
    shared, small = folds_are_live(range(100 * block, 100 * block + 100), 30)
    assert shared > 30 and small > 10


@pytest.mark.slow
@pytest.mark.parametrize("block", range(20))
def test_many_large_folds(block: int) -> None:
    folds_are_live(range(10_000 + 500 * block, 10_000 + 500 * block + 500), 120)


def swapped_tours_are_refused(seeds: range, size: int) -> tuple[int, int, int]:
    """How many pairs of tours were exchanged, how many of them tools', how many explored."""
    pairs = tools = small = 0
    for seed in seeds:
        factory = random_fold(seed, size)
        for robot, one, other in pairs_of_tours(factory):
            net = swapped(factory, robot, one, other)
            verdict = verify(net)
            assert (verdict.gear_train, verdict.legal, verdict.safe) == (True, True, True)
            assert verdict.live is False, (seed, robot, one, other)
            witness = next(w for w in verdict.faults if w.property == "live")
            assert witness.kind == "token-free circuit"
            assert factory.robots[robot].name in witness.robots
            assert_token_free(net, witness.places)
            pairs += 1
            tools += factory.robots[robot].type == "tool"
            if len(factory.operations) < 12 and small < 400:
                truth = explored(marked(net), SMALL)
                assert truth is None or truth.behaviour == judged(net), (seed, robot, one, other)
                small += truth is not None
    return pairs, tools, small


def assert_token_free(net: GearNet, names: tuple[str, ...]) -> None:
    """That places form a circuit without a token."""
    places = [net.threaded.net.place_index[name] for name in names]
    ends = [(net.threaded.places[p].left[0], net.threaded.places[p].right[0]) for p in places]
    assert all(a[1] == b[0] for a, b in zip(ends, ends[1:] + ends[:1], strict=True))
    assert not set(places) & set(net.initial)


def test_every_swapped_pair_of_tours_is_refused_with_its_circuit() -> None:
    pairs, tools, small = swapped_tours_are_refused(range(60), 8)
    assert pairs > 100 and tools > 10 and small > 5


@pytest.mark.slow
@pytest.mark.parametrize("block", range(10))
def test_many_swapped_tours(block: int) -> None:
    swapped_tours_are_refused(range(5_000 + 100 * block, 5_100 + 100 * block), 40)


def test_tools_on_a_line_follow_their_line() -> None:
    """Where one robot brings several welded parts, one tool welds them, in its order."""
    table = [("x", "insert", ("u", "w")), ("u", "insert", ("p", "v"))]
    table += [("v", "weld", ("a",)), ("w", "weld", ("b",))]
    table += [(part, "atomic", ()) for part in "pab"]
    factory = plain(table_of(table))
    tools = [robot.index for robot in factory.robots if robot.type == "tool"]
    lines = [(robot_of(factory, "v"), robot_of(factory, "w")), tuple(tools)]
    made = folded(factory, lines, catalogue())
    tool = next(robot for robot in made.robots if robot.type == "tool")
    assert [made.operations[n].label for n in tool.operations] == ["v", "w"]
    assert verify(made.net).holds
    assert verify(swapped(made, tool.index, 0, 1)).live is False


def test_two_tools_of_one_operation_stay_two() -> None:
    table = [("z", "clamp", ("y",)), ("y", "clamp", ("x",)), ("x", "insert", ("u", "c"))]
    table += [("u", "insert", ("a", "b"))] + [(part, "atomic", ()) for part in "abc"]
    factory = plain(table_of(table))
    plan = fold(factory, lines_of_labels(factory, [("b", "c")]), catalogue())
    made = shared(factory, plan, catalogue())
    does = [[made.operations[n].label for n in robot.operations] for robot in made.robots[1:]]
    assert sorted(does) == [["b", "u", "c", "x"], ["y", "z"], ["y", "z"]]
    assert verify(made.net).holds


def test_a_dead_train_is_refused() -> None:
    net = swapped(three_robots(), 1, 0, 1)
    verdict = verify(net)
    assert (verdict.live, verdict.safe, verdict.reversible) == (False, True, False)
    assert verdict.properties[0] == "gear_train" and not verdict.holds
    assert {w.property for w in verdict.faults} == {"live", "reversible"}
    assert verdict.as_json()["gear_train"] is True
    with pytest.raises(RunError, match=r"NotProved not live: the circuit .* no token") as caught:
        proved(net)
    assert "gear net" not in str(caught.value)


def test_a_train_with_a_lost_token_is_undecided() -> None:
    verdict = verify(lost_token(three_robots().net, 1))
    assert (verdict.gear_train, verdict.legal, verdict.live) == (True, False, None)
    assert not verdict.holds


def without_waits() -> MarkedNet:
    """Two robots go from one shared operation into another, which a third one is in, too."""
    rows = [("a", "b", 0), ("b", "c", 0), ("c", "a", 1), ("c", "a", 1), ("c", "b", 1)]
    net = net_from(rows)
    gears = (
        Gear("r1", "", (2, 0, 1), (2, 0, 1)),
        Gear("r2", "", (3, 0, 1), (2, 0, 1)),
        Gear("r3", "", (4, 1), (2, 1)),
    )
    return MarkedNet(net.net, net.tokens).with_gears(gears)


def test_a_missing_wait() -> None:
    verdict = verify(without_waits())
    assert (verdict.gear_net, verdict.gear_train, verdict.live) == (False, False, None)
    found = [w for w in verdict.witness if w.kind == "missing wait"]
    assert [w.robots for w in found] == [("r1",), ("r2",)]
    assert found[0].reason == "r1 comes from p0 to p1 without a wait of its own"
    assert not verdict.holds


# --- certificates --------------------------------------------------------------------------------


def certified(net: GearNet | MarkedNet) -> Json:
    found: Json = json.loads(json.dumps(certificate(net, verify(net))))
    return found


def seal(document: Json) -> Json:
    return {**document, "digest": digest(document)}


def test_certificates_of_folds_pass() -> None:
    for seed in range(80):
        factory = random_fold(seed)
        document = certified(factory.net)
        assert check_certificate(document) == [], seed
        assert ("gear_train" in document) is factory.folded
        assert document["live"]["holds"] is True
        for robot, one, other in list(pairs_of_tours(factory))[:3]:
            dead = certified(swapped(factory, robot, one, other))
            assert check_certificate(dead) == []
            assert dead["live"]["holds"] is False and dead["gear_train"]["order"] is None


def test_two_transitions_exchanged_in_the_order_are_refused() -> None:
    document = certified(three_robots().net)
    for robot in document["robots"]:
        events = [document["net"]["transitions"][e]["name"] for e in robot["transitions"]]
        for one in events:
            for other in events:
                if one == other:
                    continue
                names = {one: other, other: one}
                order = [names.get(name, name) for name in document["gear_train"]["order"]]
                forged = seal({**document, "gear_train": {"holds": True, "order": order}})
                faults = check_certificate(forged)
                assert any(f.startswith("gear_train: the order has ") for f in faults)


def swap(document: Json) -> None:
    """The net of other programs."""
    document |= {key: certified(_dead())[key] for key in ("net", "robots")}


def _dead() -> GearNet:
    return swapped(three_robots(), 1, 0, 1)


def lose_token(document: Json) -> None:
    next(place for place in document["net"]["places"] if place["tokens"])["tokens"] = 0


def lose_wait(document: Json) -> None:
    """r1 goes from sub1 into sub2 at once."""
    names = [place["name"] for place in document["net"]["places"]]
    wait = names.index("r1:sub1")
    robot = document["robots"][0]
    step = robot["places"].index(wait)
    del robot["places"][step], robot["transitions"][step]


def leave_out_one(document: Json) -> None:
    del document["gear_train"]["order"][3]


def name_no_order(document: Json) -> None:
    document["gear_train"]["order"] = None


def name_one_twice(document: Json) -> None:
    document["gear_train"]["order"][3] = document["gear_train"]["order"][4]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (swap, r"gear_train: the order has \w+ before \w+, which r2 does after it"),
        (lose_token, "gear_train: r1 does not carry one token"),
        (lose_wait, "gear_train: some robot's gear is no cycle"),
        (leave_out_one, "gear_train: the order does not name every transition once"),
        (name_one_twice, "gear_train: the order does not name every transition once"),
        (name_no_order, "gear_train: a live train has an order"),
    ],
)
def test_planted_faults_are_refused(change: Callable[[Json], None], fault: str) -> None:
    document = certified(three_robots().net)
    assert check_certificate(document) == []
    change(document)
    faults = check_certificate(seal(document))
    assert any(re.match(fault, found) for found in faults), faults


def test_a_missing_wait_is_refused() -> None:
    """As a gear train: the claim of a net in which robots have no wait between operations."""
    document = certified(without_waits())
    assert check_certificate(document) == []
    document["gear_train"] = {"holds": True, "order": ["a", "b", "c"]}
    faults = check_certificate(seal(document))
    assert "gear_train: r1 has no wait of its own before each operation" in faults


def test_changes_of_the_net_are_refused() -> None:
    """Any number of the net or a gear that changes is seen by the claim of the gear train alone."""
    document = certified(three_robots().net)
    for key in ("net", "robots"):
        rows = document[key]["places"] if key == "net" else document[key]
        for row in range(len(rows)):
            for name in ("left", "right", "tokens", "slots", "places", "transitions"):
                changed = copy.deepcopy(document)
                place = (changed[key]["places"] if key == "net" else changed[key])[row]
                if name not in place:
                    continue
                if name == "tokens":
                    place[name] += 1
                else:
                    place[name][0] = (place[name][0] + 1) % 3
                assert check_certificate(seal(changed)) != [], (key, row, name)


# --- markings ------------------------------------------------------------------------------------


def test_of_fifty_legal_markings_of_three_robots_24_are_dead() -> None:
    net = three_robots().net
    markings = legal_markings(net)
    dead = 0
    for marking in markings:
        names = ", ".join(net.threaded.places[p].name for p in sorted(marking))
        subject = starting_at(net, marking)
        truth = explored(subject)
        assert truth is not None and truth.behaviour == judged(subject)
        if verify(subject).live:
            assert legal_marking(net, names) == marking
            assert set(firings(net, marking)) == set(range(len(net.threaded.transitions)))
            continue
        dead += 1
        with pytest.raises(InputError, match="BadMarking the marking is unreachable"):
            legal_marking(net, names)
        with pytest.raises(ValueError, match="contradicts the others"):
            firings(net, marking)
    assert (len(markings), dead) == (50, 24)
    truth = explored(marked(net))
    assert truth is not None and len(truth.markings) == 26


def test_what_the_error_says() -> None:
    with pytest.raises(InputError) as caught:
        legal_marking(three_robots().net, "r1:part1, r2:nopart/part3")
    found = caught.value.diagnostics[0]
    assert found.message.startswith("the marking is unreachable: the circuit through sub3")
    assert found.message.endswith("would carry no tokens instead of 1")
    assert found.hint == "say where each of r1, r2, r3 is"


def test_a_marking_is_reached_where_no_circuit_speaks_against_it() -> None:
    for seed in range(25):
        net, rng = random_fold(seed, 14).net, random.Random(seed)
        places = net.threaded.places
        for _ in range(10):
            marking = random_legal_marking(net, rng)
            circuit = unreached(net, marking)
            if not circuit:
                counts = firings(net, marking)
                tokens = list(marked(net).tokens)
                for event in play(marked(net), counts):
                    for place in net.threaded.net.preset[event]:
                        tokens[place] -= 1
                    for place in net.threaded.net.postset[event]:
                        tokens[place] += 1
                assert {p for p, count in enumerate(tokens) if count} == marking
                continue
            ends = [(places[p].left[0], places[p].right[0]) for p in circuit]
            assert all(a[1] == b[0] for a, b in zip(ends, ends[1:] + ends[:1], strict=True))
            here, always = (sum(p in m for p in circuit) for m in (marking, net.initial_marking))
            assert here != always
            with pytest.raises(ValueError, match="contradicts"):
                firings(net, marking)


# --- cycle times ---------------------------------------------------------------------------------


def test_the_cycle_time_is_that_of_the_token_game() -> None:
    for seed in range(20):
        factory, rng = random_fold(seed, 16), random.Random(seed)
        seconds = [float(rng.randint(0, 9)) for _ in factory.net.threaded.places]
        found = cycle_time(factory, seconds)
        assert found.seconds == pytest.approx(simulated_cycle(factory.net, seconds), rel=1e-9)
        assert found.bottleneck in {robot.name for robot in factory.robots}
        assert cycle_time(factory.net, seconds) == found
        sums = [sum(seconds[p] for p in gear.places) for gear in factory.net.gears]
        assert found.seconds >= max(sums)


def test_a_bottleneck_of_two_robots() -> None:
    """From sub1 to sub3 with r1, and from there with r2: longer than the gear of either."""
    factory = three_robots()
    delays = {"part1": 1.0, "part2": 5.0, "part3": 4.0, "sub1": 2.0, "sub2": 7.0, "sub3": 2.0}
    assert cycle_time(factory, delays) == CycleTime(16.0, "r1")
    assert cycle_time(factory, {**delays, "part2": 14.0}) == CycleTime(25.0, "r2")
    assert cycle_time(factory, {}).seconds == 0.0
    ways = {(2, factory.by_label["sub2"].index): 30.0}
    assert cycle_time(factory, delays, ways).bottleneck == "r3"


def test_a_dead_train_has_no_cycle_time() -> None:
    with pytest.raises(ValueError, match="live"):
        cycle_time(_dead(), {})


@pytest.mark.parametrize("seed", [2, 5, 19, 56])
def test_the_ideal_world_has_the_predicted_cycle_time(seed: int) -> None:
    """Within the tick that each operation of the critical circuit may wait for; and prediction and
    analysis are one. The layout's estimate, without ticks, is below by no more than these."""
    settings = Settings(stage=seed % 2)
    layout = fold_layout(seed, settings)
    simulation = Simulation(layout, RunRequest("ideal", 24, settings=settings))
    simulation.run()
    left = simulation.world.dropoffs
    measured, predicted = (left[-1] - left[-13]) / 12, simulation.cycle.seconds
    net = timed_net(Timing(layout, settings, "ideal"))
    assert net.pace == pytest.approx(predicted)
    ticks = len(net.critical[0].places) * settings.tick
    assert predicted - 1e-6 <= measured <= predicted + ticks
    assert left[-1] <= simulation.duration + 24 * ticks
    engine = timed_net(Timing(layout, settings, "mujoco"))
    assert engine.pace - ticks <= cycle_of(layout, Pace.of(settings)) <= engine.pace + 1e-6


@pytest.mark.parametrize("seed", [6, 33, 51, 53])
def test_the_slack_of_an_operation_on_a_fold(seed: int) -> None:
    """So much longer it may take, and no longer, until the cycle is longer."""
    settings = Settings()
    timing = Timing(fold_layout(seed, settings), settings, "ideal")
    net = timed_net(timing)
    assert " with " in net.critical[0].name
    slacks = operation_slacks(timing, net)
    assert min(slacks) == 0.0 < max(slacks)
    for number, slack in enumerate(slacks):
        for more, longer in ((slack, False), (slack + 0.02, True)):
            seconds = list(net.seconds)
            seconds[number] += more
            pace = max_cycle_ratio(net.net, seconds).seconds
            assert (pace > net.pace + 1e-6) is longer


# --- what is no fold, and programs ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("labels", "message", "hint"),
    [
        ([("part2", "part9")], "no robot brings 'part9' to another", "did you mean 'part"),
        ([("part1", "part2")], "no robot brings 'part1' to another", ""),
        ([("part2", "part3"), ("part3",)], "'part3' is on two lines", "name each label once"),
    ],
)
def test_labels_that_make_no_line(labels: list[tuple[str, ...]], message: str, hint: str) -> None:
    with pytest.raises(InputError) as caught:
        lines_of_labels(plain(inserted(paper())), labels)
    found = caught.value.diagnostics[0]
    assert (found.code, found.message) == ("BadLine", message)
    assert hint in found.hint


@pytest.mark.parametrize(
    ("share", "labels", "message"),
    [
        (0.0, ("sub2", "part2"), "they deliver to different robots"),
    ],
)
def test_what_is_no_fold(share: float, labels: tuple[str, ...], message: str) -> None:
    factory = plain(inserted(paper(), share))
    with pytest.raises(InputError) as caught:
        fold(factory, lines_of_labels(factory, [labels]), catalogue())
    found = caught.value.diagnostics[0]
    assert found.code == "BadLine"
    assert found.message == f"'{labels[0]}' and '{labels[1]}' cannot share a robot: {message}"
    assert found.position is not None


def test_what_is_taken_and_what_is_inserted_share_no_robot() -> None:
    parts = ((x, "atomic", "", {}) for x in "abc")
    factory = plain(table_pag("s", ("s", "mate", "a b c", {}), *parts))
    with pytest.raises(InputError, match="'c' and 'a' cannot share a robot: they begin or end"):
        fold(factory, lines_of_labels(factory, [("a", "c")]), catalogue())


def test_the_output_robot_and_tools_share_no_line() -> None:
    factory = plain(inserted(paper()))
    tool = next(robot.index for robot in factory.robots if robot.type == "tool")
    part = robot_of(factory, "part2")
    for line, message in (
        ((0, part), "the output robot has a line of its own"),
        ((tool, part), "no robot type fits both"),
    ):
        with pytest.raises(InputError, match=message):
            fold(factory, [line], catalogue())


REASON = re.compile("(.*) and (.*) cannot share a robot: (.*)")


def told_apart(factory: Factory, lines: list[Line]) -> dict[tuple[str, str], str]:
    """What is said to keep lines apart, by what their first robots bring."""
    said = (REASON.fullmatch(words) for words in kept_apart(factory, lines, catalogue()))
    return {(found[1], found[2]): found[3] for found in said if found}


def apart(factory: Factory, lines: list[Line]) -> dict[tuple[str, str], str]:
    """Why one line in place of two is no fold: of each two that follow each other at one robot, and
    do not come there at once, by what their first robots bring."""
    on, found = line_of(len(factory.robots), lines), dict[tuple[str, str], str]()
    heads: dict[int, list[int]] = {}
    for line in sorted(lines)[1:]:
        if factory.robots[line[0]].type != "tool":
            heads.setdefault(on[factory.last(line[0]).carrier], []).append(line[0])
    for one, other in (pair for group in heads.values() for pair in pairwise(group)):
        both = tuple(robot for robot in range(len(on)) if on[robot] in (one, other))
        rest = [line for line in lines if line[0] not in both]
        reason = refusal(factory, [*rest, both])
        if reason and factory.last(one) is not factory.last(other):
            found[brought(factory, one), brought(factory, other)] = reason
    return found


def refusal(factory: Factory, lines: list[Line]) -> str:
    """Why lines are no fold: what no two of one line have in common, or no side for all."""
    try:
        fold(factory, lines, catalogue())
    except InputError as error:
        messages = [found.message for found in error.diagnostics]
        pairs = [found[3] for found in map(REASON.fullmatch, messages) if found]
        sides = any("cannot all come from one side" in message for message in messages)
        return (pairs or ["they cannot come from one side"] * sides or [""])[0]
    return ""


def brought(factory: Factory, robot: int) -> str:
    """What a robot brings, in quotes."""
    last = factory.last(robot)
    return f"'{last.before[last.robots.index(robot)]}'"


def random_sides(seed: int) -> tuple[Factory, list[Line]]:
    rng = random.Random(seed)
    pag = random_pag(rng.randint(5, 14), seed, rng.choice(("any", "chain", "balanced")), 3)
    factory = with_sides(plain(inserted(pag, rng.choice((0.5, 1.0)), seed)), rng)
    return factory, lines_of_one_side(factory, catalogue(), rng)


def test_what_keeps_lines_apart_is_why_they_are_no_fold_as_one() -> None:
    reasons: set[str] = set()
    for seed in range(200):
        factory, lines = random_sides(seed)
        truth = apart(factory, lines)
        assert told_apart(factory, lines) == truth, seed
        reasons.update(truth.values())
    assert reasons == {"they cannot come from one side", "they begin or end in different ways"}


@pytest.mark.parametrize(
    ("name", "planted"),
    [
        ("sides_of", lambda *_: {-1, +1}),
        ("mismatch", lambda *_: ""),
        ("mismatch", lambda *_: "no robot type fits both"),
    ],
)
def test_what_is_wrongly_said_to_keep_lines_apart_is_found(
    monkeypatch: pytest.MonkeyPatch, name: str, planted: Callable[..., object]
) -> None:
    made = [random_sides(seed) for seed in range(200)]
    truth = [apart(*one) for one in made]
    monkeypatch.setattr(folding, name, planted)
    assert [told_apart(*one) for one in made] != truth


def test_two_inputs_of_one_operation_share_no_robot() -> None:
    factory = plain(paper())
    one, other = robot_of(factory, "part1"), robot_of(factory, "part2")
    with pytest.raises(InputError) as caught:
        fold(factory, [(one, other)], catalogue())
    messages = [found.message for found in caught.value.diagnostics]
    assert any("needs two inputs of one robot at once" in message for message in messages)


def test_without_lines_nothing_changes() -> None:
    for shape in SHAPES:
        factory = plain(random_pag(20, 3, shape))
        for lines in ([], [(robot.index,) for robot in factory.robots]):
            assert shared(factory, fold(factory, lines, catalogue()), catalogue()) == factory
        assert list(factory.order) == [
            *reversed(range(len(factory.operations) - 1)),
            factory.dropoff.index,
        ]


def test_the_same_lines_from_labels() -> None:
    factory = plain(inserted(paper()))
    plan = fold(factory, lines_of_labels(factory, [("part3", "part2")]), catalogue())
    made = shared(factory, plan, catalogue())
    assert made == three_robots()
    assert [robot.name for robot in made.robots] == ["r1", "r2", "r3"]
    assert made.deliveries(1) == ("part2", "part3")
    assert {"r2:nopart/part2", "r2:nopart/part3"} <= set(made.net.threaded.net.place_index)


def test_random_lines_are_folds() -> None:
    """Each tour is on one line."""
    factory = plain(inserted(random_pag(30, 5, "any")))
    lines = random_lines(factory, random.Random(1))
    assert sorted(tour for line in lines for tour in line) == list(range(len(factory.robots)))


def test_programs_of_a_robot_with_two_tours() -> None:
    factory = three_robots()
    text = write_program(program_of(factory, 1))
    assert text == "\n".join(
        [
            "// r2",
            "Loop:",
            "  If state_2 = nopart ∧ next_2 = part2",
            "    Run ẋ_2 = wait Until a part is at the feeder",
            "    Run ẋ_2 = π_1 ∘ atomic(x_2) Until state_2 = part2",
            "    Break",
            "  If state_2 = part2",
            "    Run ẋ_2 = wait Until state_1 = part1",
            "    Run ẋ_2 = π_2 ∘ insert(x_1, x_2) Until state_2 = nopart",
            "    next_2 := part3",
            "    Break",
            "  If state_2 = nopart ∧ next_2 = part3",
            "    Run ẋ_2 = wait Until a part is at the feeder",
            "    Run ẋ_2 = π_1 ∘ atomic(x_2) Until state_2 = part3",
            "    Break",
            "  If state_2 = part3",
            "    Run ẋ_2 = wait Until state_1 = sub2",
            "    Run ẋ_2 = π_2 ∘ insert(x_1, x_2) Until state_2 = nopart",
            "    next_2 := part2",
            "    Break",
            "End Loop",
        ]
    )
    assert "next" not in write_program(program_of(factory, 0))


def test_nets_from_elsewhere_that_are_trains() -> None:
    """A train that names its gears is known as one, by its structure."""
    net = three_robots().net
    for subject in (net, read_pnml(write_pnml(net))):
        verdict = analyse(subject)
        assert verdict.holds and verdict.gear_train and verdict.gear_net is False


def test_the_commands(run: Terminal, tmp_path: Path) -> None:
    file, proof = tmp_path / "example.pag", tmp_path / "proof.json"
    file.write_text(write_pag(inserted(paper())))
    (tmp_path / "factory.toml").write_text('[lines]\nside = ["part2", "part3"]\n')
    said = run("check", file, "--certificate", proof)
    assert said.status == 0
    verdict = "gear train: yes, live: yes, safe: yes, reversible: yes, legal: yes\n"
    assert verdict in said.out and "not gear net" not in said.out
    done = run("check", file, "--against", proof, "--json")
    assert (done.json["gear_net"], done.json["gear_train"]) == (False, True)
    claims = {"gear_net": False, **dict.fromkeys((*BEHAVIOUR, "gear_train"), True)}
    assert done.json["certificate"] == {"file": str(proof), **claims}
    said = run("check", file, "--against", proof)
    assert said.out.endswith("it proves safe, live, reversible, legal, gear train\n")
    document = json.loads(proof.read_text())
    document["gear_train"]["order"].reverse()
    proof.write_text(json.dumps(seal(document)))
    done = run("check", file, "--against", proof, "--json")
    assert done.status == 1 and set(done.codes) == {"BadProof"}
    assert "the order has" in done.json["errors"][0]["message"]
    done = run("run", file, "--world", "ideal", "--from", "r1:sub1", "--json")
    assert set(done.codes) == {"BadMarking"}
    start = "r1:sub1, r2:nopart/part3"
    assert run("run", file, "--world", "ideal", "--from", start, "--units", "3").status == 0


@pytest.mark.parametrize("ahead", [None, 1.0])
def test_the_bound_of_two_tours_is_the_sum_of_their_operations(ahead: float | None) -> None:
    """One that begins with going ahead may do so while it waits in the other tour."""
    folded = three_robots()
    pace = Pace(ahead=ahead)
    bound = _Bound(folded, product_geometry(folded.pag), 0.02, pace)
    (two,) = (r for r in folded.robots if len(folded.tours[r.index]) == 2)
    spent = (folded.operations[o].dwell + pace.lost + bound.moving[o] for o in two.operations)
    assert bound.gear(two.index) == pytest.approx(sum(spent))
