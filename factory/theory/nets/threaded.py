"""Threaded Petri Nets and their legal markings (Definitions 3.2 to 3.4).

The dynamics F_p, domain D_p and goal G_p of a place are found by its mode and label in the factory
(`factory.theory.plant.factory`); the net itself keeps what the theory needs: sizes and
redistribution.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.problem.ids import PlaceId

Slot = tuple[PlaceId, int]
"""(p, i): component i of the mode of place p; both counted from 0."""

Redistribution = tuple[tuple[Slot, Slot], ...]
"""d_e as pairs (slot before, slot after), sorted (Definition 3.2, item 4)."""

KEPT = 2000
"""Greatest number of detached sets whose firing is cached; in steady production they recur."""


@dataclass(frozen=True)
class ThreadedNet:
    """A Threaded Petri Net (Definition 3.2): a net and a redistribution function for each event.

    Raises ValueError where some d_e is not a bijection from the slots of •e to those of e•.
    """

    net: PetriNet
    redistribution: tuple[Redistribution, ...] = field(repr=False)

    def __post_init__(self) -> None:
        sizes = [place.size for place in self.net.places]
        sides = self.net.preset, self.net.postset
        for event, (pairs, pre, post) in enumerate(zip(self.redistribution, *sides, strict=True)):
            before = [slot for slot, _ in pairs]
            after = [slot for _, slot in pairs]
            before.sort()
            after.sort()
            if before != [(p, i) for p in pre for i in range(sizes[p])] or after != [
                (q, i) for q in post for i in range(sizes[q])
            ]:
                name = self.net.transitions[event].name
                raise ValueError(f"the redistribution function of {name} is not a bijection")

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """T."""
        return self.net.transitions

    @property
    def places(self) -> tuple[Place, ...]:
        """P."""
        return self.net.places


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
    """A legal marking (m, f_m) of a threaded net, which changes as transitions fire.

    Args:
        net: the net.
        robots: the marking at first: the robot in each slot of a marked place.
        asked: the transitions of which `possible` tells.

    Attributes:
        marked: m, 1 for a marked place (places,).
        robots: f_m, the robot in each slot of a marked place.
        possible: those transitions of `asked` whose presets are marked.
    """

    def __init__(self, net: ThreadedNet, robots: Mapping[Slot, int], asked: Iterable[int]) -> None:
        self.net, self.robots, self._asked = net, dict(robots), frozenset(asked)
        here = {place for place, _ in robots}
        self.marked = bytearray(place in here for place in range(len(net.places)))
        self.possible = self._possible(self._asked)
        self._firing = lru_cache(KEPT)(self._made)

    def fire(self, events: tuple[int, ...]) -> bool:
        """Fire a detached set G: m' = (m - •G) ∪ G•, f_m' = f_m ∘ d_e^-1. Returns whether any
        transition has become possible.

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
