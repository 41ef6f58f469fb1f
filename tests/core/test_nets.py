"""Definitions 3.1 to 3.6 as values, and the counts of the compiled net."""

from __future__ import annotations

import pytest

from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.nets.threaded import ThreadedNet, Threads
from factory.theory.plant.factory import Factory
from tests.pag_values import factory_of, paper
from tests.token_game import enabled, follower

_T = (Transition("a"), Transition("b"))
_RING = PetriNet(_T, (Place("p", (0,), (1,)), Place("q", (1,), (0,))))


def test_an_event_needs_its_preset_and_an_empty_postset() -> None:
    assert enabled(_RING, frozenset({1})) == (0,)
    assert enabled(_RING, frozenset({0})) == (1,)
    assert enabled(_RING, frozenset({0, 1})) == ()
    assert follower(_RING, frozenset({1}), (0,)) == frozenset({0})


def threads_of(factory: Factory, marked: frozenset[int]) -> Threads:
    starts = [operation.start for operation in factory.operations]
    return Threads(factory.net.threaded, factory.net.threads_of(marked), starts)


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


def test_a_robot_that_is_not_where_its_token_is_does_not_fire() -> None:
    """Elsewhere, nowhere, or where another is already."""
    net = ThreadedNet(_RING, ((((1, 0), (0, 0)),), (((0, 0), (1, 0)),)))
    threads = Threads(net, {(0, 0): 0, (1, 0): 1}, (1,))
    threads.marked[:] = bytes([1, 0])
    with pytest.raises(AssertionError, match="not legal"):
        threads.fire((1,))
