"""Failures as firing backwards: the greatest counts, where they lead, and what nothing holds."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from factory.apps.recovery.undo import marking_after, tokens_after, undo
from factory.engine.record.replay import ReplayVerdict, replay
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.undone import Entry, Joins, Undone
from factory.theory.plant.factory import Factory
from tests.fold_values import random_fold, three_robots
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
    net, made, asked = MarkedNet.of(factory.net), factory.joins, some_asked(fired, rng)
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


seeds = st.integers(0, 10**6)


@dataclass
class Story:
    """A run that is written as it goes: firings at random, and failures."""

    factory: Factory
    rng: random.Random
    fired: list[int] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.fired = [0] * len(self.factory.net.threaded.transitions)

    def run(self, steps: int) -> None:
        net = self.factory.net.threaded
        for _ in range(steps):
            here = tokens_after(self.factory.net, self.fired)
            needs = net.net.preset
            ready = [e for e in range(len(needs)) if all(here[p] for p in needs[e])]
            event = self.rng.choice(ready)
            self.fired[event] += 1
            self.entries.append(net.transitions[event].name)

    def fail(self) -> bool:
        """Whether there was something to fail."""
        every = [*failures(self.factory, self.fired)]
        if every:
            asked = self.rng.choice(every)
            after = undo(self.factory.net, self.fired, asked, self.factory.joins)
            what = 0.0, "x", "lost"
            self.entries.append(Undone.between(self.factory.net, what, asked, self.fired, after))
            self.fired = [*after]
        return bool(every)


def judged(story: Story, first: Factory) -> ReplayVerdict:
    return replay(first.net, story.entries, None, first.joins)


def story_of(factory: Factory, rng: random.Random) -> Story:
    """A run with up to three failures."""
    story = Story(factory, rng)
    for _ in range(3):
        story.run(rng.randint(0, 3 * len(factory.operations)))
        story.fail()
    story.run(5)
    return story


@given(seeds, randoms)
def test_a_run_with_failures_replays(seed: int, rng: random.Random) -> None:
    """To the marking of its counts; so does what is left of it without what was undone."""
    factory = random_fold(seed, 12)
    story = story_of(factory, rng)
    found = judged(story, factory)
    assert (found.refines, found.reason) == (True, "")
    assert found.events == len(story.entries)
    assert found.marking == marking_after(factory.net, story.fired)
    left = replay(factory.net, [story.entries[at] for at in Undone.lasting(story.entries)])
    assert (left.refines, left.marking) == (True, found.marking)


@given(seeds, randoms, st.integers(0, 4))
def test_any_other_undo_is_refused(seed: int, rng: random.Random, how: int) -> None:
    """A transition less, one more, one in place of another, nothing, something else asked for."""
    factory = random_fold(seed, 10)
    story = story_of(factory, rng)
    undone = [(at, entry) for at, entry in enumerate(story.entries) if isinstance(entry, Undone)]
    assume(undone)
    at, entry = rng.choice(undone)
    names = [t.name for t in factory.net.threaded.transitions]
    other = rng.choice(names)
    gone = rng.randrange(len(entry.transitions))
    kept = entry.transitions[:gone] + entry.transitions[gone + 1 :]
    assume(how != 2 or other != entry.transitions[gone])
    bad = (
        replace(entry, transitions=kept),
        replace(entry, transitions=(*entry.transitions, other)),
        replace(entry, transitions=(*kept, other)),
        replace(entry, transitions=()),
        replace(entry, asked=()),
    )[how]
    story.entries[at] = bad
    found = judged(story, factory)
    assert not found.refines
    assert found.index == at
    assert "the undo of x" in found.reason


def test_the_reasons() -> None:
    factory = three_robots()
    made = factory.joins
    undone = Undone(0.0, "part1", "lost", ("part1_s",), ("part1_s",))

    def reason(entry: Undone, material: Joins | None = made) -> str:
        found = replay(factory.net, [entry], None, material)
        assert not found.refines and found.marking == factory.net.initial_marking
        return found.reason

    assert reason(undone) == "part1_s is to be undone, and has not fired so often"
    assert "no material is known" in reason(undone, None)
    assert "no transition 'y_s'" in reason(replace(undone, asked=("y_s",)))
    assert "asks for nothing" in reason(replace(undone, asked=()))


def test_the_latest_firings_are_undone() -> None:
    undone = Undone(0.0, "x", "", ("a",), ("a",))
    assert Undone.lasting(["a", "b", "a", undone, "b"]) == [0, 1, 4]
    assert Undone.lasting(["a", undone, undone, "a", "b"]) == [3, 4]
