"""The theorems of the paper, as properties of random PAGs of all shapes."""

from __future__ import annotations

import random
from collections import Counter

from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.foreign_nets.behaviour import analyse
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from tests.net_values import fair_run, glued, legal_markings, random_legal_marking
from tests.pag_values import factories, factory_of, paper
from tests.state_space import explored


def starting_at(factory: Factory, marking: Marking) -> MarkedNet:
    """The factory's net with another initial marking."""
    net = MarkedNet.of(factory.net)
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
    truth = explored(MarkedNet.of(factory.net))
    assert truth is not None
    assert len(truth.markings) == 342 == len(legal_markings(factory.net))


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


@given(st.lists(factories(10), min_size=2, max_size=4), st.randoms(use_true_random=False))
@settings(max_examples=40)
def test_lemma_5_1(many: list[Factory], rng: random.Random) -> None:
    """Gear nets with one [a; b] of each identified are a gear net."""
    nets = [factory.net for factory in many]
    places = [rng.choice(factory.operations).place for factory in many]
    net = glued(nets, places)
    assert verify(net).holds
    subject = MarkedNet.of(net)
    assert analyse(MarkedNet(subject.net, subject.tokens)).holds
