"""Hands that operations wait for: whether they are clear of what is about to move."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Index
from factory.layout.hands.leaving import leavings
from factory.layout.layout import Layout
from factory.plant.factory import Operation
from factory.support.engine import mujoco


class HandsAway:
    """The axes of robots, `qpos` (axes,) of their addresses, and what each operation waits for.

    `waiting`: whether an operation has been held up since this was last asked.
    """

    def __init__(self, d: mujoco.MjData, layout: Layout, qpos: Index) -> None:
        self._d, self._qpos, self._leavings = d, qpos, leavings(layout)
        self.waiting = False

    def hold_up(self, operation: Operation) -> bool:
        """Whether a hand is still in the way of what an operation moves."""
        awaited = self._leavings.get(operation.index, ())
        waits = bool(np.any([self._d.qpos[self._qpos[a.axis]] < a.least for a in awaited]))
        self.waiting |= waits
        return waits
