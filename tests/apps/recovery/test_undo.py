"""Failures as firing backwards: the greatest counts, where they lead, and what nothing holds."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from factory.apps.foreign_nets.behaviour import play
from factory.apps.recovery.undo import marking_after, tokens_after, undo
from factory.theory.nets.history import firings
from factory.theory.nets.marked import MarkedNet, marked, token_free
from factory.theory.nets.petri import Marking
from factory.theory.nets.undone import Joins, Undone
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART
from tests.fold_values import inserted, plain, random_fold, three_robots
from tests.net_values import fair_run, random_marked_net
from tests.pag_values import factory_of, paper
from tests.token_game import enabled, follower

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


# --- the greatest, by brute force ----------------------------------------------------------------


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


# --- Theorem 5, at every marking -----------------------------------------------------------------


def reachable(factory: Factory) -> set[Marking]:
    """Every marking, by the token game."""
    net, start = factory.net.threaded.net, factory.net.initial_marking
    seen, todo = {start}, [start]
    for marking in todo:
        there = {follower(net, marking, (event,)) for event in enabled(net, marking)}
        todo += there - seen
        seen |= there
    return seen


def failures(factory: Factory, fired: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """All that can be asked: to redo what is under way, and what to do about a lost pile."""
    for o in factory.operations:
        parent = factory.parents[o.index]
        if fired[o.start] > fired[o.end]:
            yield (o.start,)
        if parent >= 0 and fired[o.end] > fired[factory.operations[parent].end]:
            yield (o.end,)


def held(factory: Factory, marking: Marking) -> dict[int, str]:
    """What each robot has, by the place that it is at."""
    found = {}
    for number, gear in enumerate(factory.net.gears):
        step = next(i for i, place in enumerate(gear.places) if place in marking)
        operation = factory.operations[factory.robots[number].operations[step // 2]]
        found[number] = operation.before[operation.robots.index(number)]
    return found


def wanting(factory: Factory, fired: Counts, after: Counts, asked: Iterable[int] = ()) -> list[str]:
    """What robots would have to hold after an undo that they did not hold before it, or have lost:
    that of which the end is asked to be undone."""
    lost = {factory.operations[event // 2].label for event in asked if event % 2}
    had, has = (held(factory, marking_after(factory.net, n)) for n in (fired, after))
    pairs = has.items()
    return [x for robot, x in pairs if x != NOPART and (x != had[robot] or x in lost)]


PAPER: list[tuple[Callable[[], Factory], int, int]] = [
    (three_robots, 26, 49),
    (lambda: plain(inserted(paper())), 78, 199),
    (lambda: factory_of(paper()), 342, 1_377),
]


@pytest.mark.parametrize(("made", "markings", "undos"), PAPER)
def test_every_failure_at_every_marking(
    made: Callable[[], Factory], markings: int, undos: int
) -> None:
    """None leaves the reachable set, or asks a robot to hold what it had not."""
    factory = made()
    net, seen, count, bad = marked(factory.net), reachable(factory), 0, 0
    for marking in seen:
        least = firings(factory.net, marking)
        fired = tuple(least[event] + 3 for event in range(len(least)))
        for asked in failures(factory, fired):
            after = undo(net, fired, asked, factory.joins)
            assert marking_after(net, after) in seen
            assert wanting(factory, fired, after, asked) == []
            bad += bool(wanting(factory, fired, undo(net, fired, asked, {})))
            count += 1
    assert (len(seen), count) == (markings, undos)
    assert bad > 0, "without the material rule no robot would be asked for what it had not"


@given(st.integers(0, 10**6), randoms)
def test_undos_of_folds(seed: int, rng: random.Random) -> None:
    """The marking is reached by firing so often, nothing is stuck there, and no robot is asked to
    hold what it had not; so again for a second failure."""
    factory = random_fold(seed, 16)
    net, made = marked(factory.net), factory.joins
    fired = fired_by(factory, rng.randint(1, 8 * len(factory.operations)), rng)
    for _ in range(2):
        every = [*failures(factory, fired)]
        if not every:
            return
        asked = rng.choice(every)
        after = undo(net, fired, asked, made)
        assert all(after[event] < fired[event] for event in asked)
        assert wanting(factory, fired, after, asked) == []
        check_reached(net, after)
        fired = after


def check_reached(net: MarkedNet, fired: Counts) -> None:
    """That the counts can be fired from m_0, and that no circuit is then free of tokens."""
    tokens = tokens_after(net, fired)
    played = [*play(net, dict(enumerate(fired)))]
    assert tuple(played.count(event) for event in range(len(fired))) == fired
    assert token_free(MarkedNet(net.net, tokens)).stuck == ()


def test_how_often_each() -> None:
    """A pile is lost with all that made it; what was made for the next unit is not."""
    factory = factory_of(paper())
    names = [t.name for t in factory.net.threaded.transitions]
    twice, once = {"part1_s", "part1_e"}, {"part2_s", "part2_e", "sub1_s", "sub1_e"}
    fired = tuple(2 * (name in twice) + (name in once) for name in names)
    after = undo(factory.net, fired, (factory.by_label["sub1"].end,), factory.joins)
    undone = Undone.between(factory.net, (1.0, "sub1", "lost"), (), fired, after)
    assert sorted(undone.transitions) == sorted(twice | once)
