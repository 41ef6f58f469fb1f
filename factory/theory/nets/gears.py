"""Gears and gear nets as values: Definitions 3.5, 3.6; `factory.theory.nets.verify` checks them."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from heapq import heappop, heappush
from itertools import count, pairwise

from factory.support.showing import Pictured
from factory.theory.nets.petri import Marking, PetriNet
from factory.theory.nets.threaded import Redistribution, Slot, ThreadedNet, Threads
from factory.theory.problem.ids import PlaceId, TransitionId


@dataclass(frozen=True, slots=True)
class Gear:
    """The cycle of places and transitions that is one robot's program (Definition 3.5).

    Attributes:
        robot: its name, r1, r2, ...
        type: the robot's type.
        places: in their order, the first of which is `wait(nopart)`.
        transitions: `places[i]` leads from `transitions[i]` to `transitions[i + 1]`, cyclically.
    """

    robot: str
    type: str
    places: tuple[PlaceId, ...]
    transitions: tuple[TransitionId, ...]

    def waiting(self, step: int) -> PlaceId:
        """The place in which the robot waits for an operation of its program, counted from 0."""
        return self.places[2 * step]

    def step_of(self, place: int) -> int:
        """Which operation of its program, counted from 0, the robot waits for or is in when it is
        in a place."""
        return self.places.index(PlaceId(place)) // 2

    def step_in(self, marking: Container[int]) -> tuple[int, bool]:
        """Which operation of its program, counted from 0, the robot waits for or is in, in a
        marking; whether it is in it."""
        step = next(step for step, place in enumerate(self.places) if place in marking)
        return step // 2, step % 2 == 1


@dataclass(frozen=True)
class GearNet(Pictured):
    """A threaded net with the claim that it is composed of gears, one for each robot (Definition
    3.6).

    Attributes:
        threaded: the threaded net (Definition 3.5).
        gears: the gears.
        initial: the marked place of each gear, in the gears' order.
        slots: for each place, the robot (an index into `gears`) of each slot of its operation.

    A claim only: `verify` proves it.
    """

    threaded: ThreadedNet
    gears: tuple[Gear, ...]
    initial: tuple[PlaceId, ...]
    slots: tuple[tuple[int, ...], ...] = field(repr=False)

    @classmethod
    def of(
        cls,
        net: PetriNet,
        moves: tuple[Redistribution, ...],
        gears: tuple[Gear, ...],
        initial: tuple[PlaceId, ...],
        slots: tuple[tuple[int, ...], ...],
    ) -> GearNet:
        """The net with the redistribution function of each event (`moves`). Raises ValueError where
        one is no bijection."""
        return cls(ThreadedNet(net, moves), gears, initial, slots)

    def __repr__(self) -> str:
        net = self.threaded.net
        counts = f"{len(net.places)} places, {len(net.transitions)} transitions"
        return f"<GearNet: {len(self.gears)} gears, {counts}>"

    @cached_property
    def initial_marking(self) -> Marking:
        """m_0."""
        return frozenset(self.initial)

    @cached_property
    def is_tree(self) -> bool:
        """Whether the incidence graph of gears and the places that they share is a tree, if it
        hangs together: that of a gear net is, of any other gear train not."""
        gears = sum(bool(gear.places) for gear in self.gears)
        return sum(len(on) - 1 for on in self.slots if on) == gears - 1

    def threads_of(self, marked: Marking) -> dict[Slot, int]:
        """f_m of a marking: every slot holds the robot that owns it (Definition 3.3)."""
        return {
            (PlaceId(p), i): robot for p in sorted(marked) for i, robot in enumerate(self.slots[p])
        }

    def threads(self, marked: Marking, asked: Iterable[int]) -> Threads:
        """A marking (m, f_m) that changes as transitions fire; it tells which of those `asked`
        about are possible."""
        return Threads(self.threaded, self.threads_of(marked), asked)


def ascending(programs: Iterable[Sequence[int]], turns: Sequence[int]) -> tuple[int, ...]:
    """The operations, numbered from 0, in an order in which every program of operations ascends,
    those of earlier `turns` first. Raises ValueError where there is none: then the gears of these
    programs are not live."""
    waits, onward = [0] * len(turns), [list[int]() for _ in turns]
    for program in programs:
        for before, number in pairwise(program):
            onward[before].append(number)
            waits[number] += 1
    came, ordered, ready = count(), list[int](), list[tuple[int, int, int]]()

    def free(number: int) -> None:
        heappush(ready, (turns[number], next(came), number))

    for number, left in enumerate(waits):
        if not left:
            free(number)
    while ready:
        *_, number = heappop(ready)
        ordered.append(number)
        for after in onward[number]:
            waits[after] -= 1
            if not waits[after]:
                free(after)
    if len(ordered) < len(turns):
        raise ValueError("the robots' programs wait for each other: the net is not live")
    return tuple(ordered)
