"""A legal marking that changes as transitions fire (Definitions 3.3 and 3.4). What a detached set
changes is computed once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate

from factory.nets.threaded import Slot, ThreadedMarking, ThreadedNet

VACANT = -1
"""What stands in a slot of a place that is not marked, in place of a robot."""

KEPT = 2000
"""The number of detached sets that are kept: in steady production the same ones fire repeatedly."""


@dataclass(frozen=True, slots=True)
class _Firing:
    """A detached set G: •G, G•, the slots of its robots `before` and `after`; of the transitions
    asked for those that lose a token (`robbed`), and those that get one, with presets (`fed`)."""

    preset: tuple[int, ...]
    postset: tuple[int, ...]
    before: tuple[int, ...]
    after: tuple[int, ...]
    robbed: frozenset[int]
    fed: tuple[tuple[int, tuple[int, ...]], ...]


class Threads:
    """(m, f_m) of a threaded net, at first that of `start`.

    `marked` (places,): m. `possible`: those of the transitions `asked` for whose presets are
    marked.
    """

    def __init__(self, net: ThreadedNet, start: ThreadedMarking, asked: Iterable[int]) -> None:
        self.net, self._asked = net, frozenset(asked)
        self._first = [*accumulate((place.size for place in net.places), initial=0)]
        self.marked = bytearray(p in start.marked for p in range(len(net.places)))
        self._robot = [VACANT] * self._first[-1]
        for slot, robot in start.threads.items():
            self._robot[self._slot(slot)] = robot
        preset = net.net.preset
        self.possible = {event for event in self._asked if self._all_marked(preset[event])}
        self._kept: dict[tuple[int, ...], _Firing] = {}

    def fire(self, events: tuple[int, ...]) -> bool:
        """Fire a detached set G: m' = (m - •G) ∪ G•, f_m' = f_m ∘ d_e^-1. Whether any transition
        has become possible.

        Raises AssertionError, and fires none, where G is not detached, or not all of it is enabled,
        or the marking would not be legal again.
        """
        firing = self._kept.get(events) or self._keep(events)
        marked, robot = self.marked, self._robot
        if not self._all_marked(firing.preset) or any(map(marked.__getitem__, firing.postset)):
            raise AssertionError(f"not all are enabled that fire: {self._names(events)}")
        moved = [robot[slot] for slot in firing.before]
        if VACANT in moved or any(robot[slot] != VACANT for slot in firing.after):
            raise AssertionError(f"the marking is not legal after {self._names(events)}")
        for place in firing.preset:
            marked[place] = 0
        for place in firing.postset:
            marked[place] = 1
        for slot in firing.before:
            robot[slot] = VACANT
        for slot, number in zip(firing.after, moved, strict=True):
            robot[slot] = number
        new = [event for event, preset in firing.fed if self._all_marked(preset)]
        self.possible -= firing.robbed
        self.possible.update(new)
        return bool(new)

    def threads(self) -> ThreadedMarking:
        """(m, f_m) now."""
        slots = [(p, i) for p, place in enumerate(self.net.places) for i in range(place.size)]
        held = zip(slots, self._robot, strict=True)
        return ThreadedMarking({slot: robot for slot, robot in held if robot != VACANT})

    def _keep(self, events: tuple[int, ...]) -> _Firing:
        net = self.net.net
        if not net.is_detached(events):
            raise AssertionError(f"not a detached set: {self._names(events)}")
        moves = [pair for event in events for pair in self.net.redistribution[event]]
        preset = [place for event in events for place in net.preset[event]]
        postset = [place for event in events for place in net.postset[event]]
        robbed, fed = (
            self._asked & {event for place in places for event in net.places[place].right}
            for places in (preset, postset)
        )
        if len(self._kept) >= KEPT:
            self._kept.clear()
        self._kept[events] = firing = _Firing(
            tuple(preset),
            tuple(postset),
            tuple(self._slot(slot) for slot, _ in moves),
            tuple(self._slot(slot) for _, slot in moves),
            robbed,
            tuple((event, net.preset[event]) for event in fed),
        )
        return firing

    def _all_marked(self, places: Sequence[int]) -> bool:
        return all(map(self.marked.__getitem__, places))

    def _slot(self, slot: Slot) -> int:
        place, component = slot
        return self._first[place] + component

    def _names(self, events: Sequence[int]) -> str:
        return ", ".join(self.net.transitions[event].name for event in events)
