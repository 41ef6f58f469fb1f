"""A legal marking that changes as transitions fire (Definitions 3.3 and 3.4)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from factory.nets.threaded import Slot, ThreadedNet

KEPT = 2000
"""The number of detached sets whose firing is kept: in steady production the same ones fire
repeatedly."""


@dataclass(frozen=True, slots=True)
class _Firing:
    """A detached set G: •G, G•, the slots of its robots `before` and `after`; of the transitions
    asked for those that gain or lose a token (`near`)."""

    preset: tuple[int, ...]
    postset: tuple[int, ...]
    before: tuple[Slot, ...]
    after: tuple[Slot, ...]
    near: frozenset[int]


class Threads:
    """(m, f_m) of a threaded net.

    `marked` (places,): m; `robots`: f_m, the robot in each slot of a marked place. `possible`:
    those of the transitions `asked` for whose presets are marked.
    """

    def __init__(self, net: ThreadedNet, robots: Mapping[Slot, int], asked: Iterable[int]) -> None:
        self.net, self.robots, self._asked = net, dict(robots), frozenset(asked)
        here = {place for place, _ in robots}
        self.marked = bytearray(place in here for place in range(len(net.places)))
        self.possible = self._possible(self._asked)
        self._firing = lru_cache(KEPT)(self._made)

    def fire(self, events: tuple[int, ...]) -> bool:
        """Fire a detached set G: m' = (m - •G) ∪ G•, f_m' = f_m ∘ d_e^-1. Whether any transition
        has become possible.

        Raises AssertionError, and fires none, where G is not detached, or not all of it is enabled,
        or the marking would not be legal again.
        """
        firing, marked, robots = self._firing(events), self.marked, self.robots
        if not self._all_marked(firing.preset) or any(map(marked.__getitem__, firing.postset)):
            raise AssertionError(f"not all are enabled that fire: {self._names(events)}")
        if not all(map(robots.__contains__, firing.before)) or not robots.keys().isdisjoint(
            firing.after
        ):
            raise AssertionError(f"the marking is not legal after {self._names(events)}")
        for place in firing.preset:
            marked[place] = 0
        for place in firing.postset:
            marked[place] = 1
        moved = [robots.pop(slot) for slot in firing.before]
        robots.update(zip(firing.after, moved, strict=True))
        possible = self._possible(firing.near)
        new = not possible <= self.possible
        self.possible = (self.possible - firing.near) | possible
        return new

    def _made(self, events: tuple[int, ...]) -> _Firing:
        net = self.net.net
        if not net.is_detached(events):
            raise AssertionError(f"not a detached set: {self._names(events)}")
        moves = [pair for event in events for pair in self.net.redistribution[event]]
        preset = tuple(place for event in events for place in net.preset[event])
        postset = tuple(place for event in events for place in net.postset[event])
        return _Firing(
            preset,
            postset,
            tuple(before for before, _ in moves),
            tuple(after for _, after in moves),
            self._asked.intersection(e for p in preset + postset for e in net.places[p].right),
        )

    def _possible(self, events: Iterable[int]) -> set[int]:
        return {event for event in events if self._all_marked(self.net.net.preset[event])}

    def _all_marked(self, places: Sequence[int]) -> bool:
        return all(map(self.marked.__getitem__, places))

    def _names(self, events: Sequence[int]) -> str:
        return ", ".join(self.net.transitions[event].name for event in events)
