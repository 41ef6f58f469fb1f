"""The theorems of the paper, as properties of random PAGs of all shapes."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.foreign_nets.behaviour import analyse, play
from factory.theory.nets.history import firings
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.petri import Marking
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from tests.net_values import (
    fair_run,
    glued,
    legal_markings,
    random_legal_marking,
)
from tests.pag_values import SHAPES, factories, factory_of, paper, random_pag
from tests.state_space import explored
from tests.token_game import enabled, follower


def starting_at(factory: Factory, marking: Marking) -> MarkedNet:
    """The factory's net with another initial marking."""
    net = marked(factory.net)
    tokens = tuple(int(p in marking) for p in range(len(net.tokens)))
    return MarkedNet(net.net, tokens, net.gears, net.slots)


@given(factories(), st.randoms(use_true_random=False))
def test_theorem_3_1_live_and_3_2_reversible(factory: Factory, rng: random.Random) -> None:
    """Gear nets are live, and reversible, under any legal marking."""
    net = starting_at(factory, random_legal_marking(factory.net, rng))
    assert verify(net).holds


@given(factories(8), st.randoms(use_true_random=False))
@settings(max_examples=25)
def test_theorems_3_1_and_3_2_by_brute_force(factory: Factory, rng: random.Random) -> None:
    truth = explored(starting_at(factory, random_legal_marking(factory.net, rng)), 1_500)
    if truth is not None:
        assert truth.behaviour == (True, True, True)


def test_the_paper_has_342_markings_all_legal() -> None:
    factory = factory_of(paper())
    truth = explored(marked(factory.net))
    assert truth is not None
    assert len(truth.markings) == 342 == len(legal_markings(factory.net))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("arity", [2, 5, 8])
def test_theorem_5_1_every_shape(shape: str, arity: int) -> None:
    """Compiled nets are gear nets."""
    for seed in range(4):
        assert verify(factory_of(random_pag(60, seed, shape, arity)).net).holds


@given(factories(80))
def test_theorem_5_1(factory: Factory) -> None:
    assert verify(factory.net).holds


@given(factories(12), st.randoms(use_true_random=False), st.booleans())
@settings(max_examples=40)
def test_theorem_5_2(factory: Factory, rng: random.Random, elsewhere: bool) -> None:
    """In a fair run dropoff is reached again and again, from any legal marking."""
    net = factory.net
    start = random_legal_marking(net, rng) if elsewhere else net.initial_marking
    events = len(net.threaded.transitions)
    rounds = 6
    # In a live marked graph no event is more than `events` ahead of another (its pool bounds it).
    record = fair_run(net, start, rounds * events, rng)
    assert len(record) == rounds * events
    fired = Counter(record)
    third = len(record) // 3
    assert fired[factory.dropoff.start] >= 2
    assert all(fired[e] >= 1 for e in range(events))
    assert factory.dropoff.end in record[-2 * third :]


@given(factories(10), st.randoms(use_true_random=False))
def test_every_legal_marking_has_a_history(factory: Factory, rng: random.Random) -> None:
    """Any legal marking can be reached, by the least firings, and led back."""
    net = factory.net
    goal = random_legal_marking(net, rng)
    counts = firings(net, goal)
    assert min(counts.values()) == 0
    marking = net.initial_marking
    for event in play(marked(net), counts):
        assert event in enabled(net.threaded.net, marking)
        marking = follower(net.threaded.net, marking, (event,))
    assert marking == goal


@given(st.lists(factories(10), min_size=2, max_size=4), st.randoms(use_true_random=False))
@settings(max_examples=40)
def test_lemma_5_1(many: list[Factory], rng: random.Random) -> None:
    """Gear nets with one [a; b] of each identified are a gear net."""
    nets = [factory.net for factory in many]
    places = [rng.choice(factory.operations).place for factory in many]
    net = glued(nets, places)
    assert verify(net).holds
    subject = marked(net)
    assert analyse(MarkedNet(subject.net, subject.tokens)).holds


def test_gluing_along_two_places_is_no_gear_net() -> None:
    """What the lemma does not allow fails: gears that meet in two places."""
    factory = factory_of(paper())
    pair = glued([factory.net, factory.net], [factory.by_label["sub1"].place] * 2)
    subject = marked(pair)
    again = subject.net.place_index["1.part1"]
    first = subject.net.place_index["0.part1"]
    places = list(subject.net.places)
    moved = {places[again].left[0]: places[first].left[0]}
    moved[places[again].right[0]] = places[first].right[0]
    for i, place in enumerate(places):
        left = tuple(moved.get(e, e) for e in place.left)
        places[i] = replace(place, left=left, right=tuple(moved.get(e, e) for e in place.right))
    net = MarkedNet(replace(subject.net, places=tuple(places)), subject.tokens)
    assert analyse(net).gear_net is False
