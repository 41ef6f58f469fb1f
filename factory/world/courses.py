"""What references do in a tick, kept by where they begin it.

A reference depends on nothing that is measured, and steady production repeats itself to the last
bit: after some cycles every tick has been there before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from factory.control.mode import Array, Index
from factory.control.navigation import Bundle

ROOM = 8_000_000
"""So many numbers are kept, of 8 bytes each: those of a cycle with 1,000 robots."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A tick of n axes: positions `x` [m] and speeds `v` [m/s] (n,) at its end, the `setpoints` at
    each of its steps and at its end (steps + 1, 3 n), the axes that are `slow` in it, and whether
    any mode is `near` its goal then."""

    x: Array
    v: Array
    setpoints: Array
    slow: Index
    near: bool


class Courses:
    """The courses of the modes of bundles; all are forgotten when there is no room for more."""

    def __init__(self, room: int = ROOM) -> None:
        self.room, self._left = room, room
        self._kept: dict[tuple[Bundle, bytes, bytes], Course] = {}

    def __len__(self) -> int:
        return len(self._kept)

    def of(self, bundle: Bundle, x: Array, v: Array, made: Callable[[], Course]) -> Course:
        """The course of a bundle's modes from x [m] at speeds v [m/s]: that of before, or what is
        `made` now."""
        key = bundle, x.tobytes(), v.tobytes()
        course = self._kept.get(key)
        if course is None:
            course = made()
            self._left -= course.setpoints.size
            if self._left < 0:
                self._kept.clear()
                self._left = self.room - course.setpoints.size
            self._kept[key] = course
        return course
