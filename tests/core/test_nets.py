"""Definitions 3.1 to 3.6 as values, and the counts of the compiled net."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.theory.compiler.expanding import expand
from factory.theory.nets import threaded
from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.nets.threaded import Slot, ThreadedNet, Threads
from factory.theory.plant.factory import Factory
from tests.net_values import legal_markings, random_legal_marking
from tests.pag_values import TEMPLATES, factories, factory_of, paper
from tests.token_game import ThreadedMarking, enabled, follower

_T = (Transition("a"), Transition("b"))
_RING = PetriNet(_T, (Place("p", (0,), (1,)), Place("q", (1,), (0,))))


def test_presets_and_postsets() -> None:
    assert _RING.preset == ((1,), (0,))
    assert _RING.postset == ((0,), (1,))
    assert _RING.place_index == {"p": 0, "q": 1}
    assert _RING.transition_index == {"a": 0, "b": 1}


def test_an_event_needs_its_preset_and_an_empty_postset() -> None:
    assert enabled(_RING, frozenset({1})) == (0,)
    assert enabled(_RING, frozenset({0})) == (1,)
    assert enabled(_RING, frozenset({0, 1})) == ()
    assert follower(_RING, frozenset({1}), (0,)) == frozenset({0})


def test_a_gear_of_one_place_is_dead() -> None:
    net = PetriNet((Transition("a"),), (Place("p", (0,), (0,)),))
    assert enabled(net, frozenset({0})) == ()


def test_equal_places_stay_two() -> None:
    net = PetriNet(_T, (Place("p", (0,), (1,)), Place("q", (0,), (1,))))
    assert net.preset[1] == (0, 1)


def test_detached_sets() -> None:
    net = PetriNet(
        (*_T, Transition("c")),
        (Place("p", (0,), (1, 2)), Place("q", (1,), (0,)), Place("r", (2,), (0,))),
    )
    assert net.is_detached((0, 1))
    assert not net.is_detached((1, 2))


@pytest.mark.parametrize(
    "pairs",
    [((), ()), ((((1, 0), (0, 1)),), (((0, 0), (1, 0)),)), ((((0, 0), (0, 0)),), ())],
)
def test_redistribution_is_a_bijection(pairs: object) -> None:
    with pytest.raises(ValueError, match="not a bijection"):
        ThreadedNet(_RING, pairs)  # type: ignore[arg-type]


def test_a_follower_carries_the_robots_along() -> None:
    net = ThreadedNet(_RING, ((((1, 0), (0, 0)),), (((0, 0), (1, 0)),)))
    before = ThreadedMarking({(1, 0): 0})
    assert before.is_legal(net, 1)
    assert before.follower(net, (0,)).threads == {(0, 0): 0}
    with pytest.raises(ValueError, match="not enabled"):
        before.follower(net, (1,))
    assert not ThreadedMarking({}).is_legal(net, 1)


def test_the_papers_example() -> None:
    factory = factory_of(paper())
    net = factory.net
    assert (len(factory.robots), len(net.threaded.transitions)) == (6, 14)
    assert len(net.threaded.places) == 19
    places = net.threaded.places
    gears = [
        " · ".join(f"{places[p].mode} {places[p].label}".strip() for p in gear.places)
        for gear in net.gears
    ]
    assert gears == [
        "wait nopart · mate sub3 · wait sub3 · dropoff",
        "wait nopart · atomic part3 · wait part3 · mate sub3",
        "wait nopart · mate sub1 · hold sub1 · weld sub2 · wait sub2 · mate sub3",
        "wait nopart · weld sub2",
        "wait nopart · atomic part1 · wait part1 · mate sub1",
        "wait nopart · atomic part2 · wait part2 · mate sub1",
    ]
    by_label = factory.by_label
    assert [r + 1 for r in by_label["sub1"].robots] == [5, 6, 3]
    assert [r + 1 for r in by_label["sub2"].robots] == [3, 4]
    assert [r + 1 for r in by_label["sub3"].robots] == [3, 2, 1]
    assert len(legal_markings(net)) == 342


@given(factories())
def test_counts_of_section_3(factory: Factory) -> None:
    nodes = expand(factory.pag, TEMPLATES)
    operations = len(nodes)
    robots = 1 + sum(len(node.template.robots) - 1 for node in nodes.values())
    net = factory.net.threaded
    assert len(factory.robots) == len(factory.net.gears) == robots
    assert len(net.transitions) == 2 * operations + 2
    assert len(net.places) == 2 * operations + robots + 1
    assert len(factory.net.initial_marking) == robots


@given(factories())
def test_the_initial_marking_is_legal(factory: Factory) -> None:
    net = factory.net
    marking = ThreadedMarking(net.threads_of(net.initial_marking))
    assert marking.is_legal(net.threaded, len(net.gears))
    assert all(net.threaded.places[p].label == "nopart" for p in net.initial)


def threads_of(factory: Factory, marked: frozenset[int]) -> Threads:
    starts = [operation.start for operation in factory.operations]
    return Threads(factory.net.threaded, factory.net.threads_of(marked), starts)


@given(factories(), st.integers(0, 2**32))
def test_sets_fire_as_definition_3_4_says(factory: Factory, seed: int) -> None:
    """Maximal detached sets of enabled transitions, again and again, from any legal marking: the
    marking, the robot in each slot, and which operations may start are those of the follower."""
    rng, net = random.Random(seed), factory.net.threaded
    marking = random_legal_marking(factory.net, rng)
    here = ThreadedMarking(factory.net.threads_of(marking))
    kept = rng.choice((1, 2, 100))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threaded, "KEPT", kept)
        threads = threads_of(factory, marking)
    for _ in range(20):
        can = enabled(net.net, here.marked)
        ready = [event for event in can if event % 2 == 0]
        assert threads.possible == {*ready}
        chosen = list[int]()
        for event in rng.sample(can, len(can)):
            if net.net.is_detached((*chosen, event)) and (not chosen or rng.random() < 0.7):
                chosen.append(event)
        if not chosen:
            return
        there = here.follower(net, chosen)
        new = {event for event in enabled(net.net, there.marked) if event % 2 == 0} - {*ready}
        assert threads.fire(tuple(chosen)) == bool(new)
        assert threads.robots == there.threads
        assert {p for p, marked in enumerate(threads.marked) if marked} == there.marked
        assert threads._firing.cache_info().currsize <= kept
        here = there


def test_what_may_not_fire_does_not() -> None:
    factory = factory_of(paper())
    by_label = factory.by_label
    threads = threads_of(factory, factory.net.initial_marking)
    before, start = dict(threads.robots), by_label["part1"].start
    for events, words in (
        ((by_label["part1"].end,), "not all are enabled"),
        ((start, by_label["sub1"].start), "not all are enabled"),
        ((start, start), "not a detached set"),
    ):
        with pytest.raises(AssertionError, match=words):
            threads.fire(events)
        assert threads.robots == before
    threads.fire((start,))
    with pytest.raises(AssertionError, match="not all are enabled"):
        threads.fire((start,))


@pytest.mark.parametrize("robots", [{(1, 0): 0}, {}, {(0, 0): 0, (1, 0): 1}])
def test_a_robot_that_is_not_where_its_token_is_does_not_fire(robots: dict[Slot, int]) -> None:
    """Elsewhere, nowhere, or where another is already."""
    net = ThreadedNet(_RING, ((((1, 0), (0, 0)),), (((0, 0), (1, 0)),)))
    threads = Threads(net, robots, (1,))
    threads.marked[:] = bytes([1, 0])
    with pytest.raises(AssertionError, match="not legal"):
        threads.fire((1,))


def test_who_takes_the_token_leaves_none_for_others() -> None:
    """Nets with choice are no gear nets, and yet one cannot have what another took."""
    places = (Place("p", (), (0, 1)), Place("q", (0,), ()), Place("r", (1,), ()))
    moves = ((((0, 0), (1, 0)),), (((0, 0), (2, 0)),))
    net = ThreadedNet(PetriNet(_T, places), moves)
    threads = Threads(net, {(0, 0): 7}, (0, 1))
    assert threads.possible == {0, 1}
    threads.fire((1,))
    assert threads.possible == set() and threads.robots == {(2, 0): 7}
