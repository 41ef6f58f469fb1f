"""A legal marking that changes as transitions fire (Definitions 3.3 and 3.4), kept in arrays: a
detached set costs no more than one transition."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, chain

import numpy as np
from numpy.typing import NDArray

from factory.nets.threaded import Slot, ThreadedMarking, ThreadedNet

Numbers = NDArray[np.intp]

NOBODY = -1
"""The robot in a slot of a place that is not marked."""

KEPT = 2000
"""So many detached sets are kept: in steady production the same fire again and again."""


@dataclass(frozen=True, slots=True, eq=False)
class _Presets:
    """Of some transitions, all places of their presets, and where each one's begin."""

    events: Numbers
    places: Numbers
    starts: Numbers

    @classmethod
    def of(cls, net: ThreadedNet, events: Sequence[int]) -> _Presets:
        presets = [net.net.preset[event] for event in events]
        starts = accumulate(map(len, presets[:-1]), initial=0) if presets else ()
        return cls(_listed(events), _listed(chain(*presets)), _listed(starts))

    def marked(self, marked: NDArray[np.uint8]) -> Numbers:
        """Those whose presets are in a marking."""
        if not len(self.events):
            return self.events
        return self.events[np.logical_and.reduceat(marked[self.places], self.starts)]


@dataclass(frozen=True, slots=True, eq=False)
class _Firing:
    """A detached set G: •G, G•, the slots that robots are in `before` and `after`, and those of
    the transitions asked for that G• may enable."""

    preset: Numbers
    postset: Numbers
    before: Numbers
    after: Numbers
    fed: _Presets


class Threads:
    """(m, f_m) of a threaded net, at first that of `start`.

    `marked` (places,): m. `asked`: the transitions that `possible` and `fire` tell of, each with a
    preset.
    """

    def __init__(self, net: ThreadedNet, start: ThreadedMarking, asked: Sequence[int]) -> None:
        self.net = net
        self._first = [0, *accumulate(place.size for place in net.places)]
        self.marked = np.zeros(len(net.places), np.uint8)
        self.marked[[*start.marked]] = 1
        self._robot = np.full(self._first[-1], NOBODY)
        self._robot[[self._slot(slot) for slot in start.threads]] = [*start.threads.values()]
        self._asked, self._presets = frozenset(asked), _Presets.of(net, asked)
        self._kept: dict[tuple[int, ...], _Firing] = {}

    def possible(self) -> Numbers:
        """The transitions asked for whose presets are marked, in their order."""
        return self._presets.marked(self.marked)

    def fire(self, events: tuple[int, ...]) -> bool:
        """Fire a detached set G: m' = (m - •G) ∪ G•, f_m' = f_m ∘ d_e^-1. Whether the preset of any
        transition asked for is marked now that was not.

        Raises AssertionError, and fires none, where G is not detached, or not all of it is enabled,
        or the marking would not be legal again.
        """
        firing = self._kept.get(events) or self._keep(events)
        marked, robot = self.marked, self._robot
        if not marked[firing.preset].all() or marked[firing.postset].any():
            raise AssertionError(f"{self._names(events)} fire but are not all enabled")
        moved = robot[firing.before]
        if (moved == NOBODY).any() or (robot[firing.after] != NOBODY).any():
            raise AssertionError(f"after {self._names(events)} the marking is not legal")
        marked[firing.preset], marked[firing.postset] = 0, 1
        robot[firing.before], robot[firing.after] = NOBODY, moved
        return len(firing.fed.marked(marked)) > 0

    def threads(self) -> ThreadedMarking:
        """(m, f_m) now."""
        slots = [(p, i) for p, place in enumerate(self.net.places) for i in range(place.size)]
        held = zip(slots, self._robot.tolist(), strict=True)
        return ThreadedMarking({slot: robot for slot, robot in held if robot != NOBODY})

    def _keep(self, events: tuple[int, ...]) -> _Firing:
        net = self.net.net
        if not net.is_detached(events):
            raise AssertionError(f"{self._names(events)} are not a detached set")
        moves = [pair for event in events for pair in self.net.redistribution[event]]
        postset = [place for event in events for place in net.postset[event]]
        fed = {event for place in postset for event in net.places[place].right} & self._asked
        if len(self._kept) == KEPT:
            self._kept.clear()
        self._kept[events] = firing = _Firing(
            _listed(place for event in events for place in net.preset[event]),
            _listed(postset),
            _listed(self._slot(slot) for slot, _ in moves),
            _listed(self._slot(slot) for _, slot in moves),
            _Presets.of(self.net, sorted(fed)),
        )
        return firing

    def _slot(self, slot: Slot) -> int:
        place, component = slot
        return self._first[place] + component

    def _names(self, events: Sequence[int]) -> str:
        return ", ".join(self.net.transitions[event].name for event in events)


def _listed(numbers: Iterable[int]) -> Numbers:
    return np.array([*numbers], np.intp)
