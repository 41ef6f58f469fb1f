"""Hands that operations wait for: whether they are clear of what is about to move, and how soon."""

from __future__ import annotations

from collections.abc import Container, Iterable

from factory.control.mode import Index
from factory.layout.hands.leaving import Leaving, leavings
from factory.layout.layout import Layout
from factory.plant.factory import Operation
from factory.simulation.mujoco.courses import AHEAD, Follower
from factory.support.engine import mujoco


class HandsAway:
    """The axes of robots, `qpos` (axes,) of their addresses, and what each operation waits for.

    A robot that `holds` something (index) has been at home since it delivered: nothing waits for
    it. One that holds nothing gets out of the way whatever others do, so every wait ends."""

    def __init__(
        self, d: mujoco.MjData, layout: Layout, qpos: Index, holds: Container[int]
    ) -> None:
        self._d, self._qpos, self._leavings = d, qpos, leavings(layout)
        self._holds = holds
        self._robots = (*range(len(layout.factory.robots)), *layout.lifts)
        self._held: dict[int, tuple[Leaving, ...]] = {}

    def hold_up(self, operation: Operation) -> bool:
        """Whether a hand is still in the way of what an operation moves."""
        awaited = self._leavings.get(operation.index, ())
        if not awaited:
            return False
        if left := self._in_the_way(awaited):
            self._held[operation.index] = left
        else:
            self._held.pop(operation.index, None)
        return bool(left)

    def awaited(self, operations: Iterable[int]) -> set[int]:
        """The axes of hands that operations (index) have waited for, and need to stay away."""
        return {one.axis for number in operations for one in self._leavings.get(number, ())}

    def soonest(self, robots: Follower) -> int:
        """How many ticks of their course are to come until one that was held up may go on; where
        none of them may, all, and at least one. 0 where none was held up."""
        waits = (
            max(robots.until(one.axis, one.least - AHEAD) for one in awaited)
            for awaited in self._held.values()
        )
        return max(min(waits), 1) if self._held else 0

    def gone(self) -> bool:
        """Whether one that was held up may go on: it is to be asked for again."""
        over = [number for number, left in self._held.items() if not self._in_the_way(left)]
        for number in over:
            del self._held[number]
        return bool(over)

    def _in_the_way(self, awaited: Iterable[Leaving]) -> tuple[Leaving, ...]:
        at = self._d.qpos
        return tuple(
            one
            for one in awaited
            if at[self._qpos[one.axis]] < one.least and self._robots[one.axis] not in self._holds
        )
