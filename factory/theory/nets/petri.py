"""Petri nets as the paper defines them (Definition 3.1), with places that have identity.

Transitions and places are numbered by their index in the tuples. The paper's P is a subset of
2^T x 2^T, which would merge two places of equal pre- and postset (two tools of one operation);
here they stay two.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from factory.support.errors import Position
from factory.theory.problem.ids import PlaceId, TransitionId

Marking = frozenset[int]
"""m, a subset of P: the indices of the marked places."""


@dataclass(frozen=True, slots=True)
class Transition:
    """An element of T: a discrete change of the dynamics (Definition 3.1).

    Attributes:
        name: unique in its net.
        position: the user's line; not compared.
    """

    name: str
    position: Position | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Place:
    """p = [left; right]: the transitions that mark it and those that unmark it (Definition 3.1).

    Attributes:
        name: unique in its net.
        left: transitions (index) that mark it.
        right: transitions (index) that unmark it.
        mode: the controlled dynamics: an operation, `wait` or `hold`.
        label: the sub-assembly that it is about.
        size: l_p, the number of robots that the mode acts on.
        position: the user's line; not compared.
    """

    name: str
    left: tuple[TransitionId, ...]
    right: tuple[TransitionId, ...]
    mode: str = ""
    label: str = ""
    size: int = 1
    position: Position | None = field(default=None, compare=False)


@dataclass(frozen=True)
class PetriNet:
    """A Petri net (T, P) (Definition 3.1). It may have choice: nothing here assumes a marked graph.

    Attributes:
        transitions: T.
        places: P, by indices into T.
    """

    transitions: tuple[Transition, ...]
    places: tuple[Place, ...]

    @cached_property
    def preset(self) -> tuple[tuple[PlaceId, ...], ...]:
        """For each transition e the places of its preset, •e."""
        return self._around[0]

    @cached_property
    def postset(self) -> tuple[tuple[PlaceId, ...], ...]:
        """For each transition e the places of its postset, e•."""
        return self._around[1]

    @cached_property
    def place_index(self) -> dict[str, PlaceId]:
        """Place indices by name."""
        return {place.name: PlaceId(i) for i, place in enumerate(self.places)}

    @cached_property
    def transition_index(self) -> dict[str, TransitionId]:
        """Transition indices by name."""
        return {event.name: TransitionId(i) for i, event in enumerate(self.transitions)}

    @cached_property
    def _around(self) -> tuple[tuple[tuple[PlaceId, ...], ...], tuple[tuple[PlaceId, ...], ...]]:
        """All presets, and all postsets, which share the numbers of places."""
        numbers = [*map(PlaceId, range(len(self.places)))]
        before = self._adjacent((place.right for place in self.places), numbers)
        return before, self._adjacent((place.left for place in self.places), numbers)

    def _adjacent(
        self, sides: Iterable[tuple[TransitionId, ...]], numbers: Sequence[PlaceId]
    ) -> tuple[tuple[PlaceId, ...], ...]:
        adjacent: list[list[PlaceId]] = [[] for _ in self.transitions]
        for number, events in zip(numbers, sides, strict=True):
            for event in events:
                adjacent[event].append(number)
        return tuple(map(tuple, adjacent))

    def is_detached(self, events: Iterable[int]) -> bool:
        """Whether the presets are pairwise disjoint, and the postsets too (section 3.1)."""
        chosen = tuple(events)
        before = [p for e in chosen for p in self.preset[e]]
        after = [p for e in chosen for p in self.postset[e]]
        return len(before) == len(set(before)) and len(after) == len(set(after))
