"""The token game as the paper defines it (Definitions 3.1 to 3.4), written out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking, PetriNet
from factory.theory.nets.threaded import Slot, ThreadedNet


def enabled(net: PetriNet, marking: Marking) -> tuple[int, ...]:
    """The transitions e with •e inside m and e• outside m (Definition 3.4, condition 1)."""
    pairs = enumerate(zip(net.preset, net.postset, strict=True))
    return tuple(e for e, (a, b) in pairs if marking.issuperset(a) and marking.isdisjoint(b))


def follower(net: PetriNet, marking: Marking, events: Iterable[int]) -> Marking:
    """m' = (m - •G) ∪ G• for a detached set G of enabled events (section 3.1)."""
    chosen = tuple(events)
    before = {p for e in chosen for p in net.preset[e]}
    after = {p for e in chosen for p in net.postset[e]}
    return (marking - before) | after


@dataclass(frozen=True)
class ThreadedMarking:
    """(m, f_m): the marked places and the robot in each of their slots (Definition 3.3)."""

    threads: Mapping[Slot, int]

    @cached_property
    def marked(self) -> Marking:
        """m."""
        return frozenset(place for place, _ in self.threads)

    def is_legal(self, net: ThreadedNet, robots: int) -> bool:
        """Whether f_m is a bijection from the slots of m to the robots 0 .. robots - 1."""
        slots = sum(net.places[p].size for p in self.marked)
        return (
            slots == len(self.threads) == robots
            and all(0 <= i < net.places[p].size for p, i in self.threads)
            and sorted(self.threads.values()) == list(range(robots))
        )

    def follower(self, net: ThreadedNet, events: Iterable[int]) -> ThreadedMarking:
        """The follower marking with respect to a detached set G of enabled events.

        f_m'(q, j) = f_m(q, j) for q outside G•, else f_m(d_e^-1(q, j)), where e is the event in
        •q ∩ G (the paper's text has q•). Raises ValueError where G is not detached or not enabled.
        """
        chosen = tuple(events)
        if not net.net.is_detached(chosen):
            raise ValueError("the events are not detached")
        if not {*chosen} <= {*enabled(net.net, self.marked)}:
            raise ValueError("some event is not enabled")
        threads = dict(self.threads)
        moves = [pair for e in chosen for pair in net.redistribution[e]]
        carried = [(after, threads.pop(before)) for before, after in moves]
        threads.update(carried)
        return ThreadedMarking(threads)


def dates(net: MarkedNet, seconds: list[float], rounds: int) -> list[list[float]]:
    """When each transition of a marked graph fires, for so many times, all as soon as they can: a
    token game in which each token says when it is ready, which begins with what is enabled."""
    here: list[list[float]] = [[0.0] * count for count in net.tokens]
    fired: list[list[float]] = [[] for _ in net.net.transitions]
    ready = list(range(len(fired)))
    while ready:
        event = ready.pop()
        needs = net.net.preset[event]
        while len(fired[event]) < rounds and all(here[p] for p in needs):
            now = max(here[p].pop(0) for p in needs)
            fired[event].append(now)
            for place in net.net.postset[event]:
                here[place].append(now + seconds[place])
                ready += net.net.places[place].right
    return fired
