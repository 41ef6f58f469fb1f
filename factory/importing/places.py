"""Placements: the frames of sub-assemblies and parts in the product."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import rotation
from factory.problem.pag import Parameter


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A frame in the product: a vertex v in it stands at turn · v + at [m]."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    at: Array = field(default_factory=lambda: np.zeros(3))
    moved: bool = False

    def inside(self, at: tuple[float, ...] | None, quat: tuple[float, ...] | None) -> Placement:
        """The frame at `at`, turned by `quat`, in this one; this one where neither is given."""
        if at is None and quat is None:
            return self
        there = self.turn @ np.array(at or (0.0, 0.0, 0.0)) + self.at
        unit = np.array(quat or (1.0, 0.0, 0.0, 0.0))
        unit /= np.abs(unit).max()
        return Placement(self.turn @ rotation(unit / np.linalg.norm(unit)), there, True)

    def parameters(
        self, at: tuple[float, ...] | None, quat: tuple[float, ...] | None
    ) -> list[Parameter]:
        """The parameters of a part at `at`, turned by `quat`, in this frame; these numbers
        unchanged where the frame is that of the product."""
        if self.moved:
            whole = self.inside(at, quat)
            at, quat = rounded(whole.at), quaternion(whole.turn)
            quat = None if quat == (1.0, 0.0, 0.0, 0.0) else quat
        given = (("pos", at), ("quat", quat))
        return [Parameter(name, value) for name, value in given if value is not None]


def rounded(numbers: Array) -> tuple[float, ...]:
    """Numbers to nine decimals: a nanometre."""
    return tuple(float(x) for x in np.round(numbers, 9) + 0.0)


def quaternion(turn: Array) -> tuple[float, ...]:
    """The unit quaternion (w, x, y, z), w >= 0, of the rotation nearest to a matrix."""
    from scipy.spatial.transform import Rotation

    return rounded(Rotation.from_matrix(turn).as_quat(canonical=True, scalar_first=True))
