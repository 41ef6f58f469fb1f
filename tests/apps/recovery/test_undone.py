"""Records with failures: what a replay accepts, and what it refuses."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

from hypothesis import assume, given
from hypothesis import strategies as st

from factory.apps.recovery.undo import marking_after, tokens_after, undo
from factory.theory.nets.replay import ReplayVerdict, replay
from factory.theory.nets.undone import Entry, Joins, Undone, lasting
from factory.theory.plant.factory import Factory
from tests.apps.recovery.test_undo import failures
from tests.fold_values import random_fold, three_robots

seeds = st.integers(0, 10**6)
randoms = st.randoms(use_true_random=False)


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
    left = replay(factory.net, [story.entries[at] for at in lasting(story.entries)])
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
    assert lasting(["a", "b", "a", undone, "b"]) == [0, 1, 4]
    assert lasting(["a", undone, undone, "a", "b"]) == [3, 4]
