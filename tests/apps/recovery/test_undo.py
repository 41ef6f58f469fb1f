"""Failures as firing backwards: the greatest counts, where they lead, and what nothing holds."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from itertools import product

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from factory.apps.recovery.undo import tokens_after, undo
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.undone import Joins
from factory.theory.plant.factory import Factory
from tests.fold_values import random_fold
from tests.net_values import fair_run, random_marked_net
from tests.pag_values import factory_of, paper

Counts = tuple[int, ...]
randoms = st.randoms(use_true_random=False)


def fired_by(factory: Factory, steps: int, rng: random.Random) -> Counts:
    """How often each transition fires in a run."""
    record = fair_run(factory.net, factory.net.initial_marking, steps, rng)
    return tuple(record.count(event) for event in range(2 * len(factory.operations)))


def some_asked(fired: Counts, rng: random.Random) -> tuple[int, ...]:
    """One to three transitions that have fired, each once or twice."""
    have = [event for event, count in enumerate(fired) if count]
    chosen = rng.sample(have, min(len(have), rng.randint(1, 3)))
    return tuple(e for e in chosen for _ in range(rng.randint(1, min(2, fired[e]))))


def brute(net: MarkedNet, fired: Counts, asked: tuple[int, ...], made: Joins) -> Counts:
    """The greatest of all counts that are allowed; it is one of them."""
    tops = [count - asked.count(event) for event, count in enumerate(fired)]
    every = product(*(range(top + 1) for top in tops))
    found = [counts for counts in every if allowed(net, fired, counts, made)]
    top = tuple(map(max, zip(*found, strict=True)))
    assert top in found
    return top


def allowed(net: MarkedNet, fired: Counts, counts: Counts, made: Joins) -> bool:
    """Whether counts lead to a marking and take nothing apart."""
    undone = [was - now for was, now in zip(fired, counts, strict=True)]
    return min(tokens_after(net, counts)) >= 0 and all(
        undone[other] >= undone[end] for end, others in made.items() for other in others
    )


@given(st.integers(0, 400), randoms)
def test_it_is_the_greatest(seed: int, rng: random.Random) -> None:
    """Of all counts, on folds so small that all can be listed."""
    factory = random_fold(seed, 3)
    size = 2 * len(factory.operations)
    fired = fired_by(factory, rng.randint(1, 14 if size > 6 else 20), rng)
    net, made, asked = marked(factory.net), factory.joins, some_asked(fired, rng)
    assert undo(net, fired, asked, made) == brute(net, fired, asked, made)


@given(randoms)
def test_it_is_the_greatest_in_any_marked_graph(rng: random.Random) -> None:
    """With several tokens on a place, places without producer or consumer, and any material."""
    net = random_marked_net(rng)
    tokens, fired = list(net.tokens), [0] * len(net.net.transitions)
    for _ in range(12):
        events = enumerate(net.net.preset)
        ready = [e for e, needs in events if all(tokens[p] for p in needs) and fired[e] < 4]
        if not ready:
            break
        event = rng.choice(ready)
        fired[event] += 1
        tokens = list(tokens_after(net, fired))
    assume(any(fired))
    pairs = [(a, b) for a in range(len(fired)) for b in range(len(fired)) if fired[b] >= fired[a]]
    made = {a: (b,) for a, b in rng.sample(pairs, min(2, len(pairs)))}
    asked = some_asked(tuple(fired), rng)
    assert undo(net, fired, asked, made) == brute(net, tuple(fired), asked, made)


def test_what_cannot_be_undone() -> None:
    factory = factory_of(paper())
    nothing = [0] * len(factory.net.threaded.transitions)
    with pytest.raises(ValueError, match="part2_s is to be undone 1 times, and has fired 0"):
        undo(factory.net, nothing, (factory.by_label["part2"].start,), factory.joins)
    with pytest.raises(ValueError, match="no transition is asked"):
        undo(factory.net, nothing, (), factory.joins)


def failures(factory: Factory, fired: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """All that can be asked: to redo what is under way, and what to do about a lost pile."""
    for o in factory.operations:
        parent = factory.parents[o.index]
        if fired[o.start] > fired[o.end]:
            yield (o.start,)
        if parent >= 0 and fired[o.end] > fired[factory.operations[parent].end]:
            yield (o.end,)
