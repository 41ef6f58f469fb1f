"""The token game as the paper defines it (Definitions 3.1 to 3.4), written out."""

from __future__ import annotations

from collections.abc import Iterable

from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking, PetriNet


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
