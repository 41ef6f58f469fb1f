"""The state of a factory that a picture shows, and the shapes of what is in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from factory.geometry.sight import Array
from factory.mjcf import names
from factory.mjcf.replica import mesh_of
from factory.support.engine import mujoco

SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a model that a picture shows: `qpos`, and the constraints that are active, by
    number, with the bodies they are aimed at."""

    qpos: Array
    active: NDArray[np.int32]
    body2: NDArray[np.int32]

    @classmethod
    def of(cls, qpos: Array, welds: NDArray[np.integer]) -> Snapshot:
        """That of positions and active constraints (k, 3), as of an `Observation`."""
        return cls(qpos, *welds[:, [0, 2]].T.astype(np.int32))


def corners(m: mujoco.MjModel, geom: int) -> Array:
    """The corners (8, 3) of a geom's box in its own frame, or the vertices of its mesh."""
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        return mesh_of(m, geom)[0]
    box = m.geom_aabb[geom]
    return np.asarray(box[:3] + SIGNS * box[3:])


def placed(m: mujoco.MjModel, d: mujoco.MjData, geom: int) -> Array:
    """The corners (8, 3) of a geom's box where it is [m]."""
    box = m.geom_aabb[geom]
    turn = d.geom_xmat[geom].reshape(3, 3)
    return np.asarray((box[:3] + SIGNS * box[3:]) @ turn.T + d.geom_xpos[geom])


def held(m: mujoco.MjModel, shown: Snapshot) -> bool:
    """Whether the output robot, the first, holds a product."""
    grip = names.grip("r1", "")
    return any(m.equality(e).name.startswith(grip) for e in shown.active.tolist())
