"""The proof, against brute force and against planted faults."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from factory.apps.foreign_nets.behaviour import analyse
from factory.apps.foreign_nets.explore import explore
from factory.support.errors import RunError
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.verdict import Verdict, Witness
from factory.theory.nets.verify import proved, verify
from factory.theory.plant.factory import Factory
from tests.net_values import (
    PHILOSOPHERS,
    crossed_twice,
    doubled_token,
    lost_token,
    missing_producer,
    net_from,
    planted,
    random_marked_net,
    unclosed_gear,
)
from tests.pag_values import SHAPES, factories, factory_of, paper, random_pag
from tests.state_space import explored


def bare(net: GearNet | MarkedNet) -> MarkedNet:
    """The net without any word about gears."""
    return replace(marked(net), gears=(), slots=())


def witness(verdict: Verdict, kind: str) -> Witness:
    """The first witness of a kind."""
    kinds = [w.kind for w in verdict.witness]
    assert kind in kinds, verdict.witness
    return verdict.witness[kinds.index(kind)]


@pytest.mark.parametrize("shape", SHAPES)
def test_ten_thousand_labels(shape: str) -> None:
    assert verify(factory_of(random_pag(2_500, 1, shape)).net).holds


def test_a_chain_without_recursion() -> None:
    factory = factory_of(random_pag(10_000, 3, "chain"))
    assert verify(factory.net).holds
    found = analyse(bare(factory.net))
    assert found.holds
    assert len(found.gears) == len(factory.robots)


@given(factories())
def test_the_gears_of_a_bare_net_are_found(factory: Factory) -> None:
    found = analyse(bare(factory.net))
    assert found.holds
    wanted = {frozenset(gear.places) for gear in factory.net.gears}
    assert {frozenset(gear.places) for gear in found.gears} == wanted


@given(factories(9))
@settings(max_examples=25)
def test_agrees_with_brute_force(factory: Factory) -> None:
    truth = explored(marked(factory.net), 2_000)
    assume(truth is not None)
    assert truth is not None
    assert truth.behaviour == (True, True, True)
    found = explore(marked(factory.net))
    assert found.markings == len(truth.markings)
    assert found.complete
    assert (found.deadlock, found.unsafe, found.starved, found.one_way) == (None,) * 4


@given(st.integers(0, 10**9))
@settings(max_examples=400)
def test_broken_marked_graphs_agree_with_brute_force(seed: int) -> None:
    net = random_marked_net(random.Random(seed))
    truth = explored(net, 1_500)
    verdict = analyse(net)
    assert verdict.method == "structure"
    if truth is None:
        assert verdict.safe is False
        return
    assert (verdict.live, verdict.safe, verdict.reversible) == truth.behaviour


@given(factories(7), st.randoms(use_true_random=False), st.integers(0, 3))
@settings(max_examples=60)
def test_broken_factories_agree_with_brute_force(
    factory: Factory, rng: random.Random, which: int
) -> None:
    net = factory.net
    broken = planted(net, rng, which)
    truth = explored(broken, 1_500, 3)
    verdict = analyse(broken)
    assert not (verdict.gear_net and verdict.legal)
    if truth is None:
        return
    assert (verdict.live, verdict.safe, verdict.reversible) == truth.behaviour


@given(factories(20), st.randoms(use_true_random=False), st.integers(0, 4))
def test_the_linear_proof_claims_nothing_else(
    factory: Factory, rng: random.Random, which: int
) -> None:
    """Of a broken factory it proves no more than that: the rest is undecided, with a witness. Gears
    that cross twice can be a gear train, of which all is decided."""
    broken = planted(factory.net, rng, which)
    proof, truth = verify(broken), analyse(broken)
    assert not (proof.gear_net and proof.legal)
    assert (proof.gear_net, proof.gear_train, proof.legal) == (
        truth.gear_net,
        truth.gear_train,
        truth.legal,
    )
    if proof.gear_train and proof.legal:
        assert which == 3
        assert (proof.live, proof.safe, proof.reversible) == (
            truth.live,
            truth.safe,
            truth.reversible,
        )
        return
    assert not proof.holds
    assert (proof.live, proof.safe, proof.reversible) == (None, None, None)
    undecided = [w for w in proof.witness if w.kind == "undecided"]
    assert [w.property for w in undecided] == ["live", "safe", "reversible"]
    decided = [w for w in truth.witness if w.property in ("gear_net", "gear_train", "legal")]
    assert [w for w in proof.witness if w not in undecided] == decided


def test_what_is_not_proved_is_refused() -> None:
    net = factory_of(paper()).net
    assert proved(net) == verify(net)
    with pytest.raises(RunError, match="NotProved") as caught:
        proved(replace(net, initial=net.initial[1:]))
    assert "5 initial places are given for 6 robots" in str(caught.value)


@given(factories(), st.randoms(use_true_random=False))
def test_a_lost_token_is_named(factory: Factory, rng: random.Random) -> None:
    robot = rng.randrange(len(factory.robots))
    verdict = analyse(lost_token(factory.net, robot))
    assert (verdict.gear_net, verdict.live, verdict.safe, verdict.legal) == (
        True,
        False,
        True,
        False,
    )
    found = witness(verdict, "lost token")
    assert found.robots == (factory.robots[robot].name,)
    assert found.labels
    assert all(line.startswith("test.pag:") for line in found.lines)
    assert found.lines
    assert factory.robots[robot].name in witness(verdict, "token-free circuit").robots


@given(factories(), st.randoms(use_true_random=False))
def test_a_doubled_token_is_named(factory: Factory, rng: random.Random) -> None:
    robot = rng.randrange(len(factory.robots))
    verdict = analyse(doubled_token(factory.net, robot))
    assert (verdict.gear_net, verdict.safe, verdict.legal) == (True, False, False)
    assert witness(verdict, "doubled token").robots == (factory.robots[robot].name,)
    assert witness(verdict, "two tokens").lines


@given(factories(), st.randoms(use_true_random=False))
def test_an_unclosed_gear_is_named(factory: Factory, rng: random.Random) -> None:
    net = factory.net
    robot = rng.randrange(len(net.gears))
    step = rng.randrange(len(net.gears[robot].places))
    after = net.threaded.places[net.gears[robot].places[step]].right[0]
    event = (after + 1 + rng.randrange(len(net.threaded.transitions) - 1)) % len(
        net.threaded.transitions
    )
    verdict = analyse(unclosed_gear(net, robot, step, event))
    assert verdict.gear_net is False
    found = witness(verdict, "unclosed gear")
    assert factory.robots[robot].name in {r for w in verdict.witness for r in w.robots}
    assert found.lines
    assert "should be [" in found.reason


@given(factories(), st.randoms(use_true_random=False))
def test_a_missing_producer_is_named(factory: Factory, rng: random.Random) -> None:
    net = factory.net
    place = rng.randrange(len(net.threaded.places))
    verdict = analyse(missing_producer(net, place))
    assert (verdict.gear_net, verdict.live) == (False, False)
    found = witness(verdict, "missing producer")
    assert found.places == (net.threaded.places[place].name,)
    assert set(found.robots) <= {net.gears[g].robot for g in net.slots[place]}
    assert found.lines


@given(factories(), st.randoms(use_true_random=False))
def test_gears_that_cross_twice_are_named(factory: Factory, rng: random.Random) -> None:
    net = factory.net
    pairs = [(a, b) for a, b in _meeting(net) if crossed_twice(net, a, b)]
    assume(pairs)
    one, other = rng.choice(pairs)
    broken = crossed_twice(net, one, other)
    assert broken is not None
    verdict = analyse(broken)
    assert verdict.gear_net is False
    found = witness(verdict, "two gears cross twice")
    assert set(found.robots) == {net.gears[one].robot, net.gears[other].robot}
    assert len(found.places) == 2
    assert found.lines
    assert analyse(bare(broken)).gear_net is False


def _meeting(net: GearNet) -> list[tuple[int, int]]:
    shared = (own for own in net.slots if len(own) > 1)
    return [(a, b) for own in shared for a in own for b in own if a != b]


def test_a_ring_of_three_gears() -> None:
    places = [("a0", "a1", 0), ("b0", "b1", 0), ("c0", "c1", 0)]
    places += [("a1", "b0", 1), ("b1", "a0", 1), ("b1", "c0", 1), ("c1", "b0", 1)]
    places += [("c1", "a0", 1), ("a1", "c0", 1)]
    net = net_from(places)
    events = net.net.transition_index
    gears = tuple(
        Gear(robot, "dot", ps, tuple(events[e] for e in names.split()))
        for robot, ps, names in (
            ("r1", (0, 3, 1, 4), "a0 a1 b0 b1"),
            ("r2", (1, 5, 2, 6), "b0 b1 c0 c1"),
            ("r3", (2, 7, 0, 8), "c0 c1 a0 a1"),
        )
    )
    verdict = analyse(replace(net, gears=gears))
    found = witness(verdict, "two gears cross twice")
    assert set(found.robots) == {"r1", "r2", "r3"}
    assert set(found.places) == {"p0", "p1", "p2"}
    assert "form a ring" in found.reason


def test_gears_apart() -> None:
    net = net_from([("a", "b", 1), ("b", "a", 0), ("c", "d", 1), ("d", "c", 0)])
    gears = (Gear("r1", "dot", (0, 1), (0, 1)), Gear("r2", "dot", (2, 3), (2, 3)))
    verdict = analyse(replace(net, gears=gears))
    assert witness(verdict, "gears apart").robots == ("r2",)
    assert (verdict.live, verdict.safe, verdict.reversible) == (True, True, True)
    assert analyse(net).gear_net is False


def test_a_gear_of_one_place() -> None:
    net = net_from([("a", "a", 1)])
    for verdict in (analyse(replace(net, gears=(Gear("r1", "", (0,), (0,)),))), analyse(net)):
        assert (verdict.gear_net, verdict.live, verdict.reversible) == (False, False, True)
        assert witness(verdict, "1-gear").reason


def test_a_place_in_no_gear() -> None:
    subject = marked(factory_of(paper()).net)
    net = replace(subject, gears=subject.gears[:-1])
    verdict = analyse(net)
    assert verdict.gear_net is False
    assert witness(verdict, "place in no gear").labels


def test_gears_that_share_a_transition_only() -> None:
    net = net_from([("a", "b", 1), ("b", "a", 0), ("a", "c", 1), ("c", "a", 0)])
    gears = (Gear("r1", "", (0, 1), (0, 1)), Gear("r2", "", (2, 3), (0, 2)))
    assert witness(analyse(replace(net, gears=gears)), "no shared place").transitions == ("a",)
    assert witness(analyse(net), "no shared place").transitions == ("a",)


def test_initial_places_of_a_gear_net() -> None:
    net = factory_of(paper()).net
    for initial in (net.initial[1:], net.initial[:1] + net.initial, (net.initial[1],) * 6):
        verdict = analyse(replace(net, initial=initial))
        assert verdict.legal is False
        assert verdict.gear_net


def test_a_robot_in_another_robots_slot() -> None:
    net = factory_of(paper()).net
    slots = list(net.slots)
    slots[0] = slots[0][::-1]
    verdict = analyse(replace(net, slots=tuple(slots)))
    assert verdict.gear_net is False
    assert "belongs to another robot" in witness(verdict, "slots").reason
    slots[0] = (0, 1)
    assert "acts on 3 robots" in witness(analyse(replace(net, slots=tuple(slots))), "slots").reason


@pytest.mark.parametrize("slots", [(), (-1,), (1,), (2, 2), (2, -1)])
def test_slots_of_a_marked_place_that_are_not_of_the_robots_there(slots: tuple[int, ...]) -> None:
    net = factory_of(paper()).net
    place = net.initial[2]
    changed = (*net.slots[:place], slots, *net.slots[place + 1 :])
    for subject in (replace(net, slots=changed), replace(marked(net), slots=changed)):
        verdict = analyse(subject)
        assert verdict.legal is False
        last = verdict.witness[-1]
        assert (last.property, last.kind) == ("legal", "slots")
        assert "the robots that start there are r3" in last.reason


def test_a_marked_place_of_another_size() -> None:
    subject = marked(factory_of(paper()).net)
    places = tuple(replace(p, size=2) if "nopart" in p.name else p for p in subject.net.places)
    verdict = analyse(replace(subject, net=replace(subject.net, places=places)))
    assert verdict.legal is False
    assert "acts on 2 robots with slots for r1" in witness(verdict, "slots").reason


def test_the_verdict_as_json() -> None:
    verdict = analyse(lost_token(factory_of(paper()).net, 4))
    document = verdict.as_json()
    assert document["live"] is False
    first = verdict.witness[0].as_json()
    assert first["robots"] == ["r5"]
    assert first["lines"] == ["test.pag:6", "test.pag:5"]
    assert set(first) >= {"property", "reason", "labels", "places", "transitions"}


def test_a_net_with_choice_is_explored() -> None:
    net = net_from([("b c", "a", 1), ("a", "b c", 0)])
    verdict = analyse(net)
    assert verdict.method == "exploration"
    assert (verdict.gear_net, verdict.live, verdict.safe) == (False, True, True)
    assert (verdict.reversible, verdict.legal) == (True, None)
    assert "has choice" in witness(verdict, "choice").reason


def test_a_deadlock_is_shown_by_a_firing_sequence() -> None:
    net = net_from([("b", "a c", 1), ("a", "b", 0)])
    verdict = analyse(net)
    assert (verdict.live, verdict.safe, verdict.reversible) == (False, True, False)
    assert witness(verdict, "deadlock").transitions == ("c",)
    assert witness(verdict, "no way back").transitions == ("c",)
    told = witness(analyse(net_from(PHILOSOPHERS)), "deadlock").reason
    assert told == "after takeA1, takeB1 nothing is enabled any more, with tokens in p4, p5"


def test_what_needs_what_it_gives_back_never_fires() -> None:
    assert explore(net_from([("a", "b", 1), ("b", "a", 0), ("b", "b", 1)])).deadlock == ()


def test_a_marked_graph_says_how_it_comes_to_a_stop() -> None:
    """One with a circuit that never fires; and nothing of a stop where the rest goes on."""
    stuck = [("a", "b", 0), ("b", "a", 0)]
    told = witness(analyse(net_from([*stuck, ("a", "c", 1)])), "token-free circuit").reason
    assert told.endswith("after c nothing is enabled any more")
    going = [("c", "d", 1), ("d", "c", 0)]
    assert ";" not in witness(analyse(net_from([*stuck, *going])), "token-free circuit").reason


def test_a_livelock_starves_a_transition() -> None:
    net = net_from([("b", "a c", 1), ("a", "b", 0), ("c e", "d", 0), ("d", "e", 0)])
    verdict = analyse(net)
    assert (verdict.live, verdict.reversible) == (False, False)
    assert "never fire again" in witness(verdict, "dead transition").reason


def test_an_unbounded_net_with_choice_is_unsafe_and_otherwise_undecided() -> None:
    net = net_from([("", "x", 3), ("a", "b c", 0), ("b c x", "a", 1), ("a", "", 0)])
    verdict = analyse(net, limit=50)
    assert verdict.safe is False
    assert verdict.live is None
    assert witness(verdict, "undecided").reason.startswith("undecided: ")


def test_exploring_stops_at_its_limit() -> None:
    rows = [
        row for i in range(9) for row in ((f"a{i} c{i}", f"b{i}", 1), (f"b{i}", f"a{i} c{i}", 0))
    ]
    verdict = analyse(net_from(rows), limit=100)
    assert (verdict.live, verdict.safe, verdict.reversible) == (None, None, None)
    assert not verdict.holds


def test_a_net_of_nothing() -> None:
    assert analyse(net_from([])).gear_net is False
    with pytest.raises(ValueError, match="one number of tokens"):
        replace(net_from([("a", "b", 1)]), tokens=(-1,))
