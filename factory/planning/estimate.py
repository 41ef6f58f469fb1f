"""Expected cycle times of a tree before it is laid out, from the sizes of what robots carry.
Layouts decide among the best trees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.geometry.meshes import Array
from factory.layout.durations import Pace
from factory.plant.approaches import MARGIN

STATION = 0.06
"""The distance between two stations on a guidepath beyond the size of a sub-assembly [m]."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Times [s] at the `pace` of robots, elementwise for arrays of lengths [m]."""

    pace: Pace

    def rest(self, way: Array) -> Array:
        """From rest to rest."""
        speed, acceleration = self.pace.speed, self.pace.acceleration
        short = 2 * np.sqrt(np.maximum(way, 0.0) / acceleration)
        return np.where(way < speed**2 / acceleration, short, way / speed + speed / acceleration)

    def delivering(self, size: Array) -> Array:
        """The time of a robot to deliver something of this size and return."""
        return 2 * self.rest(size + STATION) + self.pace.lost

    def stop(self, size: Array) -> Array:
        """The time of a carrier to take something of this size."""
        return self.rest(size + STATION) + self.pace.lost

    def step(self, size: Array) -> Array:
        """The additional time to move on to the next station."""
        return (size + STATION) / self.pace.speed

    def lift(self, stroke: Array) -> Array:
        """The waiting time while a part is lowered by a stroke."""
        return self.rest(np.maximum(stroke, 0.0) + MARGIN)
