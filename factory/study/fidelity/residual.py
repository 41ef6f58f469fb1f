"""How far welds give: the distance between the frames that each joins, under load."""

from __future__ import annotations

from typing import Any

import numpy as np

from factory.control.mode import REST, Array
from factory.study.fidelity.histogram import Histogram
from factory.study.fidelity.welds import Velocities

ROWS = 6
"""Of a weld among the engine's constraints: three of place, three of turn."""


class Residual:
    """Residuals [m] of active, awake welds at the end of ticks: the `largest` of all, and the
    distribution of those whose holder goes faster than the speed at which robots hand over. Who
    stands may be asleep or not, and is of no weight there."""

    def __init__(self, world: Any, velocities: Velocities) -> None:
        self.m, self.d, self.velocities = world.m, world.d, velocities
        self.largest, self.moving = 0.0, Histogram()

    def tick(self, v: Array) -> None:
        """Speeds at the end of a tick (nv,)."""
        rows = self.d.ne
        if not rows:
            return
        position = self.d.efc_pos[:rows].reshape(-1, ROWS)[:, :3]
        length = np.sqrt(np.einsum("ij,ij->i", position, position))
        self.largest = max(self.largest, float(length.max()))
        holder = self.m.eq_obj1id[self.d.efc_id[:rows:ROWS]]
        speed = np.linalg.norm(self.velocities.of_holders(v, holder), axis=1)
        self.moving.add(length[speed > REST])
