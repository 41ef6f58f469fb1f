"""Folds: their nets are live gear trains, as exploring says, and no other order of tours is."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.listing import digest
from factory.apps.exports.certificate.writer import certificate
from factory.apps.exports.program_text import write_program
from factory.apps.few_robots.folding import (
    Line,
    fold,
    kept_apart,
    line_of,
    lines_of_labels,
)
from factory.apps.runs.start import legal_marking
from factory.engine.record.history import firings
from factory.engine.timing.cycle_time import CycleTime
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.bounds import _Bound
from factory.floor.layout.durations import Pace
from factory.support.errors import InputError, RunError
from factory.support.settings import Settings
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking
from factory.theory.nets.verify import proved, verify
from factory.theory.plant.factory import Factory
from factory.theory.plant.programs import Program
from tests.fold_values import (
    fold_layout,
    inserted,
    lines_of_one_side,
    pairs_of_tours,
    plain,
    random_fold,
    robot_of,
    swapped,
    three_robots,
    with_sides,
)
from tests.net_values import legal_markings, net_from
from tests.pag_values import catalogue, paper, random_pag
from tests.slow import slow_but
from tests.state_space import explored

Json = dict[str, Any]
SMALL = 1_200
"""So many markings are explored at most."""


def starting_at(net: GearNet, marking: Marking) -> MarkedNet:
    subject = MarkedNet.of(net)
    tokens = tuple(int(place in marking) for place in range(len(subject.tokens)))
    return MarkedNet(subject.net, tokens, subject.gears, subject.slots)


def judged(net: GearNet | MarkedNet) -> tuple[bool | None, ...]:
    found = verify(net)
    return found.live, found.safe, found.reversible


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
            truth = explored(MarkedNet.of(factory.net), SMALL)
            assert truth is None or truth.behaviour == (True, True, True), seed
            small += truth is not None
    return shared, small


@pytest.mark.parametrize("block", slow_but([0], range(10)))
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
                truth = explored(MarkedNet.of(net), SMALL)
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


def certified(net: GearNet | MarkedNet) -> Json:
    found: Json = json.loads(json.dumps(certificate(net, verify(net))))
    return found


def seal(document: Json) -> Json:
    return {**document, "digest": digest(document)}


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
    truth = explored(MarkedNet.of(net))
    assert truth is not None and len(truth.markings) == 26


def test_what_the_error_says() -> None:
    with pytest.raises(InputError) as caught:
        legal_marking(three_robots().net, "r1:part1, r2:nopart/part3")
    found = caught.value.diagnostics[0]
    assert found.message.startswith("the marking is unreachable: the circuit through sub3")
    assert found.message.endswith("would carry no tokens instead of 1")
    assert found.hint == "say where each of r1, r2, r3 is"


def test_a_bottleneck_of_two_robots() -> None:
    """From sub1 to sub3 with r1, and from there with r2: longer than the gear of either."""
    factory = three_robots()
    delays = {"part1": 1.0, "part2": 5.0, "part3": 4.0, "sub1": 2.0, "sub2": 7.0, "sub3": 2.0}
    assert CycleTime.of(factory, delays) == CycleTime(16.0, "r1")
    assert CycleTime.of(factory, {**delays, "part2": 14.0}) == CycleTime(25.0, "r2")
    assert CycleTime.of(factory, {}).seconds == 0.0
    ways = {(2, factory.by_label["sub2"].index): 30.0}
    assert CycleTime.of(factory, delays, ways).bottleneck == "r3"


def test_a_dead_train_has_no_cycle_time() -> None:
    with pytest.raises(ValueError, match="live"):
        CycleTime.of(_dead(), {})


@pytest.mark.parametrize(
    ("labels", "message", "hint"),
    [([("part2", "part3"), ("part3",)], "'part3' is on two lines", "name each label once")],
)
def test_labels_that_make_no_line(labels: list[tuple[str, ...]], message: str, hint: str) -> None:
    with pytest.raises(InputError) as caught:
        lines_of_labels(plain(inserted(paper())), labels)
    found = caught.value.diagnostics[0]
    assert (found.code, found.message) == ("BadLine", message)
    assert hint in found.hint


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


def test_two_inputs_of_one_operation_share_no_robot() -> None:
    factory = plain(paper())
    one, other = robot_of(factory, "part1"), robot_of(factory, "part2")
    with pytest.raises(InputError) as caught:
        fold(factory, [(one, other)], catalogue())
    messages = [found.message for found in caught.value.diagnostics]
    assert any("needs two inputs of one robot at once" in message for message in messages)


def test_programs_of_a_robot_with_two_tours() -> None:
    factory = three_robots()
    text = write_program(Program.of(factory, 1))
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
    assert "next" not in write_program(Program.of(factory, 0))


def test_folds_are_laid_out() -> None:
    """Seed 139: a pile overlapped the housing as it came back to its tool."""
    assert fold_layout(179, Settings()).certificate is not None


@pytest.mark.parametrize("ahead", [None, 1.0])
def test_the_bound_of_two_tours_is_the_sum_of_their_operations(ahead: float | None) -> None:
    """One that begins with going ahead may do so while it waits in the other tour."""
    folded = three_robots()
    pace = Pace(ahead=ahead)
    bound = _Bound(folded, product_geometry(folded.pag), 0.02, pace)
    (two,) = (r for r in folded.robots if len(folded.tours[r.index]) == 2)
    spent = (folded.operations[o].dwell + pace.lost + bound.moving[o] for o in two.operations)
    assert bound.gear(two.index) == pytest.approx(sum(spent))
