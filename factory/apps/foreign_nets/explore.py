"""Exploration of the state space of a small net of any shape, marking by marking."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from factory.api import MarkedNet
from factory.theory.problem.ids import TransitionId

LIMIT = 200_000
"""Greatest number of markings that are explored."""

Firing = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Exploration:
    """The number of `markings`, and firing sequences to those that violate a property.

    `complete`: whether these are all the reachable markings; `deadlock`: nothing is enabled;
    `unsafe`: a place has two tokens; `starved`: a transition can never fire again; `one_way`: the
    initial marking is unreachable.
    """

    markings: int
    complete: bool
    deadlock: Firing | None = None
    unsafe: tuple[Firing, int] | None = None
    starved: tuple[Firing, int] | None = None
    one_way: Firing | None = None


class StateSpace:
    """The reachability graph from m_0, of at most `limit` markings."""

    def __init__(self, net: MarkedNet, limit: int = LIMIT) -> None:
        self.net, self.limit = net, limit
        self.index: dict[bytes, int] = {}
        self.origin: list[tuple[int, int]] = []
        self.edges: list[list[tuple[int, int]]] = []
        self.unsafe: tuple[int, int] | None = None
        self.complete = self._grow()

    def _grow(self) -> bool:
        if max(self.net.tokens, default=0) > 254:
            return False
        self._note(bytes(self.net.tokens), -1, -1)
        markings = list(self.index)
        for number, marking in enumerate(markings):
            self.edges.append([])
            for event in self._enabled(marking):
                tokens = bytearray(marking)
                self.net.fire(tokens, event)
                after = bytes(tokens)
                if max(after) == 255 or (after not in self.index and len(markings) >= self.limit):
                    return False
                if after not in self.index:
                    self._note(after, number, event)
                    markings.append(after)
                self.edges[number].append((event, self.index[after]))
        return True

    def _note(self, marking: bytes, before: int, event: int) -> None:
        number = len(self.index)
        self.index[marking] = number
        self.origin.append((before, event))
        if self.unsafe is None and max(marking, default=0) > 1:
            self.unsafe = (number, marking.index(max(marking)))

    def _enabled(self, marking: bytes) -> list[int]:
        net, places = self.net.net, self.net.net.places
        near = {e for p, count in enumerate(marking) if count for e in places[p].right}
        near.update(TransitionId(e) for e, needs in enumerate(net.preset) if not needs)
        ready = (e for e in near if all(marking[p] for p in net.preset[e]))
        return sorted(e for e in ready if e not in self.net.blocked)

    def firing(self, number: int) -> Firing:
        """A sequence that leads to a marking."""
        events = []
        while self.origin[number][0] >= 0:
            number, event = self.origin[number]
            events.append(event)
        return tuple(reversed(events))

    def bottoms(self) -> list[list[int]]:
        """The strongly connected components that nothing leaves, by their first markings."""
        size = len(self.edges)
        before = np.repeat(np.arange(size), [len(out) for out in self.edges])
        after = np.fromiter((m for out in self.edges for _, m in out), np.intp)
        graph = csr_array((np.ones(len(after), bool), (before, after)), (size, size))
        _, part = connected_components(graph, connection="strong")
        left = {*part[before[part[before] != part[after]]].tolist()}
        bottoms: dict[int, list[int]] = {}
        for number, component in enumerate(part.tolist()):
            if component not in left:
                bottoms.setdefault(component, []).append(number)
        return list(bottoms.values())


def explore(net: MarkedNet, limit: int = LIMIT) -> Exploration:
    """Decide by exploring: liveness, safety, reversibility, deadlock; bounded by `limit` markings.

    A net is live where every transition fires in every component of markings that is never left,
    reversible where there is just one component.
    """
    space = StateSpace(net, limit)
    ends = (n for n, out in enumerate(space.edges[: None if space.complete else -1]) if not out)
    stop = next(ends, None)
    deadlock = None if stop is None else space.firing(stop)
    unsafe = space.unsafe and (space.firing(space.unsafe[0]), space.unsafe[1])
    if not space.complete:
        return Exploration(len(space.index), False, deadlock, unsafe)
    bottoms = space.bottoms()
    starved = next(filter(None, (_starved(space, part) for part in bottoms)), None)
    outside = next((part[0] for part in bottoms if part[0]), None)
    one_way = None if outside is None else space.firing(outside)
    return Exploration(len(space.index), True, deadlock, unsafe, starved, one_way)


def _starved(space: StateSpace, part: list[int]) -> tuple[Firing, int] | None:
    fired = {event for number in part for event, _ in space.edges[number]}
    never = set(range(len(space.net.net.transitions))) - fired
    return (space.firing(part[0]), min(never)) if never else None
