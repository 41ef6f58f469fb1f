"""The proof, against brute force and against planted faults."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from factory.apps.foreign_nets.behaviour import analyse
from factory.apps.foreign_nets.explore import explore
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.marked import FEW, MarkedNet
from factory.theory.nets.verdict import Verdict, Witness
from factory.theory.plant.factory import Factory
from tests.net_values import PHILOSOPHERS, crossed_twice, net_from, planted
from tests.pag_values import factories, factory_of, paper
from tests.state_space import explored


def bare(net: GearNet | MarkedNet) -> MarkedNet:
    """The net without any word about gears."""
    return replace(MarkedNet.of(net), gears=(), slots=())


def witness(verdict: Verdict, kind: str) -> Witness:
    """The first witness of a kind."""
    kinds = [w.kind for w in verdict.witness]
    assert kind in kinds, verdict.witness
    return verdict.witness[kinds.index(kind)]


@given(factories(9))
@settings(max_examples=25)
def test_agrees_with_brute_force(factory: Factory) -> None:
    truth = explored(MarkedNet.of(factory.net), 2_000)
    assume(truth is not None)
    assert truth is not None
    assert truth.behaviour == (True, True, True)
    found = explore(MarkedNet.of(factory.net))
    assert found.markings == len(truth.markings)
    assert found.complete
    assert (found.deadlock, found.unsafe, found.starved, found.one_way) == (None,) * 4


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


def test_slots_of_a_marked_place_that_are_not_of_the_robots_there() -> None:
    net = factory_of(paper()).net
    place = net.initial[2]
    changed = (*net.slots[:place], (), *net.slots[place + 1 :])
    for subject in (replace(net, slots=changed), replace(MarkedNet.of(net), slots=changed)):
        verdict = analyse(subject)
        assert verdict.legal is False
        last = verdict.witness[-1]
        assert (last.property, last.kind) == ("legal", "slots")
        assert "the robots that start there are r3" in last.reason


def test_a_marked_place_has_room_for_the_robots_that_start_there() -> None:
    net = MarkedNet.of(factory_of(paper()).net)
    place, places = net.tokens.index(1), [*net.net.places]
    places[place] = replace(places[place], size=2)
    verdict = analyse(replace(net, net=replace(net.net, places=tuple(places))))
    assert verdict.legal is False
    assert "acts on 2 robots" in witness(verdict, "slots").reason
    assert {"gear_net", "legal"} <= {one.property for one in verdict.witness}


def test_all_gears_through_a_place_are_its_owners() -> None:
    """More than `FEW` of them, too, of which others are alone."""
    gears = tuple(Gear(f"r{n}", "dot", (0, n + 1), (0, 1)) for n in range(2 * FEW))
    net = net_from([("a", "b", 0), *[("b", "a", 1)] * len(gears)])
    assert replace(net, gears=gears).owners == ((*range(2 * FEW),), *((n,) for n in range(2 * FEW)))


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


def test_a_marked_graph_says_how_it_comes_to_a_stop() -> None:
    """One with a circuit that never fires; and nothing of a stop where the rest goes on."""
    stuck = [("a", "b", 0), ("b", "a", 0)]
    told = witness(analyse(net_from([*stuck, ("a", "c", 1)])), "token-free circuit").reason
    assert told.endswith("after c nothing is enabled any more")
    going = [("c", "d", 1), ("d", "c", 0)]
    assert ";" not in witness(analyse(net_from([*stuck, *going])), "token-free circuit").reason


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
