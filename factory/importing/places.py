"""Placements: the frames of sub-assemblies and parts in the product."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import rotation
from factory.problem.pag import Parameter, Value

UNTURNED = (1.0, 0.0, 0.0, 0.0)
"""The quaternion of no rotation."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A frame in the product: a vertex v of it is at turn · v + at [m]. `moved`: whether it differs
    from that of the product."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    at: Array = field(default_factory=lambda: np.zeros(3))
    moved: bool = False

    def inside(self, values: Mapping[str, Value]) -> Placement:
        """The frame at `pos` [m], rotated by `quat`, in this frame; this frame if both are
        missing."""
        if not values.keys() & {"pos", "quat"}:
            return self
        there = self.turn @ np.array(values.get("pos", (0.0, 0.0, 0.0))) + self.at
        unit = np.array(values.get("quat", UNTURNED))
        unit /= np.abs(unit).max()
        return Placement(self.turn @ rotation(unit / np.linalg.norm(unit)), there, True)

    def parameters(self, values: Mapping[str, Value]) -> list[Parameter]:
        """`pos` and `quat` of a part in this frame; unchanged if the frame is the product's."""
        if self.moved:
            whole = self.inside(values)
            turn = quaternion(whole.turn)
            values = {"pos": rounded(whole.at)} | ({} if turn == UNTURNED else {"quat": turn})
        return [Parameter(name, values[name]) for name in ("pos", "quat") if name in values]


def rounded(numbers: Array) -> tuple[float, ...]:
    """Numbers rounded to nine decimals: to a nanometre."""
    return tuple(float(x) for x in np.round(numbers, 9) + 0.0)


def quaternion(turn: Array) -> tuple[float, ...]:
    """The unit quaternion (w, x, y, z), w >= 0, of the rotation nearest to a matrix."""
    from scipy.spatial.transform import Rotation

    return rounded(Rotation.from_matrix(turn).as_quat(canonical=True, scalar_first=True))
