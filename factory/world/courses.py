"""What references do in some ticks, kept by where they begin them.

A reference depends on nothing that is measured, and steady production repeats itself to the last
bit: after some cycles every tick has been there before.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from factory.world.setpoints import Told

ROOM = 15_000_000
"""So many numbers are kept, of 8 bytes each: those of a cycle with 1,000 robots."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Some `ticks` of n axes: what their drives are `told`, with positions and speeds `after` it,
    which of them `moves` (the bytes of n truths), and whether any mode is `near` its goal then, as
    none is before; and the courses that come `then`, of at most so many ticks, if known."""

    ticks: int
    told: Told
    moves: bytes
    near: bool
    then: dict[int, Course] = field(default_factory=dict)


class Courses:
    """Courses by where they begin; all are forgotten when there is no room for more."""

    def __init__(self, room: int = ROOM) -> None:
        self.room, self._left = room, room
        self._kept: dict[Hashable, Course] = {}

    def __len__(self) -> int:
        return len(self._kept)

    def of(self, begin: Hashable, made: Callable[[], Course]) -> Course:
        """The course from a beginning, which says all that it depends on: that of before, or what
        is `made` now."""
        course = self._kept.get(begin)
        if course is None:
            course = made()
            size = course.told.setpoints.size + course.told.after.size
            if size > self._left:
                self._kept.clear()
                self._left = self.room
            self._left -= size
            self._kept[begin] = course
        return course
