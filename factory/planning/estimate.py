"""What a tree is expected to cost before anything is laid out: cycles from the sizes of what robots
carry. Layouts decide among the best trees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.geometry.meshes import Array
from factory.layout.durations import Pace
from factory.plant.approaches import MARGIN

STATION = 0.06
"""What lies on a guidepath beside a sub-assembly, from one station to the next [m]."""


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
        """The way out and back of a robot that delivers something of this size."""
        return 2 * self.rest(size + STATION) + self.pace.lost

    def stop(self, size: Array) -> Array:
        """What a carrier spends to take something of this size."""
        return self.rest(size + STATION) + self.pace.lost

    def step(self, size: Array) -> Array:
        """What it spends to go on to the next station besides."""
        return (size + STATION) / self.pace.speed

    def lift(self, stroke: Array) -> Array:
        """What it waits for something that is lowered so far over what stands."""
        return self.rest(np.maximum(stroke, 0.0) + MARGIN)
