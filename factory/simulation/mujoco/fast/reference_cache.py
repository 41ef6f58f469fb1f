"""What references do in some ticks, kept by where they begin them.

A reference depends on nothing that is measured, and steady production repeats itself to the last
bit: after some cycles every tick has been there before.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

import numpy as np

from factory.control.mode import Array, Index
from factory.simulation.mujoco.drives import Leg, Setpoints, Told, under_way

AHEAD = 0.0005
"""No robot is further ahead of its reference than this [m]."""

Way = tuple[Leg, Array, Array, bool]
"""A tick of axes, the positions [m] and speeds [m/s] that it leads to, and whether any of them may
be where it goes then."""

ROOM = 15_000_000
"""So many numbers are kept, of 8 bytes each: twice those of the cycles of 1,000 robots."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Some `ticks` of n axes: what their drives are `told`, with positions and speeds `after` it,
    which of them `moves` in any (the bytes of n truths), and whether any mode is `near` its goal
    then, as none is before; and the courses that come `then`, by how many ticks at most, if
    known."""

    ticks: int
    told: Told
    moves: bytes
    near: bool
    then: dict[int, Course] = field(default_factory=dict)


class Courses:
    """Courses by where they begin and how many ticks they may take; all are forgotten when there is
    no room for more."""

    def __init__(self, room: int = ROOM) -> None:
        self.room, self._left, self._count = room, room, 0
        self._kept: dict[Hashable, dict[int, Course]] = {}

    def __len__(self) -> int:
        return self._count

    def since(self, begin: Hashable) -> dict[int, Course]:
        """What is kept from a beginning, which says all that courses depend on: by how many ticks
        at most."""
        return self._kept.setdefault(begin, {})

    def of(self, begin: Hashable, ticks: int, made: Callable[[], Course]) -> Course:
        """The course from a beginning, of so many ticks at most: that of before, or what is `made`
        now."""
        course = self.since(begin).get(ticks)
        if course is None:
            course = made()
            size = course.told.setpoints.size
            if size > self._left:
                self._kept.clear()
                self._left, self._count = self.room, 0
            self._left -= size
            self._count += 1
            self.since(begin)[ticks] = course
        return course


def travelled(
    setpoints: Setpoints,
    axes: Index,
    begin: tuple[Array, Array],
    ticks: int,
    go: Callable[[Array, Array], Way],
) -> Course:
    """The course of axes from positions [m] and speeds [m/s], where `go` tells what they do in a
    tick from such: until one may be where it goes, for so many ticks at most."""
    (x, v), legs, moves, near = begin, list[Leg](), np.zeros(len(axes), bool), False
    while len(legs) < ticks and not near:
        leg, x, v, near = go(x, v)
        legs.append(leg)
        moves |= under_way(*leg[1:])
    return Course(len(legs), setpoints.of(axes, legs, x, v), moves.tobytes(), near)
