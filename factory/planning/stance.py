"""The orientation of a product on the floor: which of its axes is vertical, and along which axis
the last inputs come."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from factory.geometry.meshes import Array

ROOT_AXIS = 1
"""The axis of the floor along which the inputs of the finished product come: y."""


@dataclass(frozen=True, slots=True)
class Stance:
    """The axes of the product that lie along x, y and z of the floor, and whether z of the floor is
    the upper side (+1) of its axis, or the lower one (-1)."""

    axes: tuple[int, int, int] = (0, 1, 2)
    up: int = +1

    @property
    def upright(self) -> bool:
        """Whether the product stands as it was drawn, or turned about the vertical."""
        return self.axes[2] == 2 and self.up > 0

    @property
    def rotation(self) -> Array:
        """The rotation (3, 3) from the frame of the product to that of the floor: the one of two
        that turns by the smaller angle."""
        turned = [np.zeros((3, 3)) for _ in range(2)]
        for matrix, side in zip(turned, (+1.0, -1.0), strict=True):
            matrix[0, self.axes[0]] = side
            matrix[1, self.axes[1]] = 1.0
            matrix[2, self.axes[2]] = self.up
            if np.linalg.det(matrix) < 0:
                matrix[1, self.axes[1]] = -1.0
        return max(turned, key=lambda m: float(np.trace(m)))


def stances(up: tuple[int, int] | None = None) -> tuple[Stance, ...]:
    """The twelve stances, or those with an axis and side `up`. Of the 24 rotations, two that differ
    by half a turn about the vertical are one stance. The stance as drawn comes first, the other
    upright one second."""
    every = [Stance(axes, up) for axes in permutations(range(3)) for up in (+1, -1)]  # type: ignore[arg-type]
    if up is not None:
        every = [stance for stance in every if (stance.axes[2], stance.up) == up]
    return tuple(sorted(every, key=lambda s: (not s.upright, s.axes[2] != 2, -s.up, s.axes)))
