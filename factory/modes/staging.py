"""Staging: a robot that waits empty-handed for others goes ahead to where they need it.

The paper's `wait` stands still. Here its field may be that of the operation to come, as far as it
moves this robot; its goal is still everything, so the net is the same, and is proved as before. It
needs no certificate of its own: a carriage, its mast and arm, below all payloads, may be anywhere
on their guidepath in any mode (`layout/clearance.py`). Nothing else may: a payload is kept away
from those it is to meet until their mode begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.control.mode import ROUNDING, Array, Mode
from factory.layout.layout import Layout
from factory.modes.modes import operation_starts
from factory.support.settings import Settings


@dataclass(frozen=True, slots=True)
class HeadStart:
    """The way of a robot ahead of one of its operations: the `mode` that moves its carriage alone,
    to the goal of its `slot` there, and where it `starts` in the long run [m]."""

    robot: int
    operation: int
    slot: int
    mode: Mode = field(repr=False)
    start: float

    @property
    def goal(self) -> float:
        """Where it goes, an arc length [m]."""
        return float(self.mode.goals[0])


def stages(layout: Layout, modes: Sequence[Mode]) -> tuple[HeadStart, ...]:
    """Every way that a robot can go ahead: it brings nothing and has others to wait for, and none
    of them comes near it on its way, whatever their speeds."""
    found = []
    starts = operation_starts(layout)
    for operation, mode, start in zip(layout.factory.operations, modes, starts, strict=True):
        homes = start.copy()
        homes[: len(operation.robots)] = [layout.home(r, operation.index) for r in operation.robots]
        if not all(map(mode.clear_from, (start, homes))):
            continue
        for slot, robot in enumerate(operation.robots):
            way = abs(float(start[slot] - mode.goals[slot]))
            if operation.awaits_empty(slot) and mode.gate[slot] < 0 and way > ROUNDING:
                own = slice(slot, slot + 1)
                alone = Mode(mode.goals[own], mode.lower[own], mode.upper[own], mode.eps)
                found.append(HeadStart(robot, operation.index, slot, alone, float(start[slot])))
    return tuple(found)


def stages_of(layout: Layout, modes: Sequence[Mode], settings: Settings) -> tuple[HeadStart, ...]:
    """Those, where the settings ask for them."""
    return stages(layout, modes) if settings.stage else ()


def staged(starts: Sequence[Array], ahead: Sequence[HeadStart]) -> list[Array]:
    """Where the axes of each operation are when it starts, if those that go ahead are there."""
    found = [np.array(start) for start in starts]
    for stage in ahead:
        found[stage.operation][stage.slot] = stage.goal
    return found
