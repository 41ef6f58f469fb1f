"""Threaded Petri Nets: Definitions 3.2 to 3.4.

The dynamics F_p, domain D_p and goal G_p of a place are found by its mode and label in the factory
(`factory.plant.factory`); the net itself keeps what the theory needs: sizes and redistribution.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from factory.nets.petri import Marking, PetriNet, Place, Transition

Slot = tuple[int, int]
"""(p, i): component i of the mode of place p; both counted from 0."""

Redistribution = tuple[tuple[Slot, Slot], ...]
"""d_e as pairs (slot before, slot after), sorted (Definition 3.2, item 4)."""


@dataclass(frozen=True)
class ThreadedNet:
    """A Threaded Petri Net (Definition 3.2): a net and a redistribution function for each event.

    Raises ValueError where some d_e is not a bijection from the slots of •e to those of e•.
    """

    net: PetriNet
    redistribution: tuple[Redistribution, ...] = field(repr=False)

    def __post_init__(self) -> None:
        sizes = [place.size for place in self.net.places]
        preset, postset = self.net.preset, self.net.postset
        for event, pairs in enumerate(self.redistribution):
            before = [slot for slot, _ in pairs]
            after = [slot for _, slot in pairs]
            wanted = [(p, i) for p in preset[event] for i in range(sizes[p])]
            reached = [(q, i) for q in postset[event] for i in range(sizes[q])]
            if sorted(before) != wanted or sorted(after) != reached:
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


@dataclass(frozen=True)
class ThreadedMarking:
    """(m, f_m): the marked places and the robot in each of their slots (Definition 3.3)."""

    threads: Mapping[Slot, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "threads", MappingProxyType(dict(self.threads)))

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
        if not all(net.net.is_enabled(e, self.marked) for e in chosen):
            raise ValueError("some event is not enabled")
        threads = dict(self.threads)
        moves = [pair for e in chosen for pair in net.redistribution[e]]
        carried = [(after, threads.pop(before)) for before, after in moves]
        threads.update(carried)
        return ThreadedMarking(threads)
