"""What the cameras look at, read from a model alone: the factory's extent, and its state."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from factory.mjcf import names
from factory.mjcf.replica import mesh_of
from factory.render.camera import Array
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
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> Snapshot:
        """The present state of a running model."""
        active = np.flatnonzero(d.eq_active).astype(np.int32)
        return cls(d.qpos.copy(), active, m.eq_obj2id[active].copy())


UNSEEN = ("part", "ground", names.COMPASS)
"""Kinds of bodies that do not count for what a picture of the factory has to show."""


def extent(m: mujoco.MjModel, d: mujoco.MjData) -> Array:
    """Points (n, 3) round everything that stands in a factory and its robots at both ends of their
    rails."""
    robots = {m.body(j.bodyid[0]).name: j for j in map(m.joint, range(m.njnt)) if j.type[0] == 2}
    found = []
    for g in range(m.ngeom):
        name = m.body(int(m.body_rootid[m.geom_bodyid[g]])).name
        if m.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE or names.kind(name) in UNSEEN:
            continue
        points = corners(m, g) @ d.geom_xmat[g].reshape(3, 3).T + d.geom_xpos[g]
        found.append(points)
        if name in robots:
            found.append(points + _travel(m, d, name, int(robots[name].id)))
    return np.concatenate(found) if found else SIGNS.copy()


def corners(m: mujoco.MjModel, geom: int) -> Array:
    """The corners (8, 3) of a geom's box in its own frame, or the vertices of its mesh."""
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        return mesh_of(m, geom)[0]
    box = m.geom_aabb[geom]
    return np.asarray(box[:3] + SIGNS * box[3:])


def _travel(m: mujoco.MjModel, d: mujoco.MjData, carriage: str, joint: int) -> Array:
    """The way of a robot from the B end of its rail to the A end (3,) [m]."""
    robot = carriage.partition("/")[0]
    try:
        rail, own = m.geom(f"{robot}/rail"), m.geom(carriage)
    except KeyError:
        return np.zeros(3)
    return np.asarray(-d.xaxis[joint] * 2 * (rail.size[0] - own.size[0]))


def held(m: mujoco.MjModel, shown: Snapshot) -> bool:
    """Whether the output robot, the first, holds a product."""
    grip = names.grip("r1", "")
    return any(m.equality(e).name.startswith(grip) for e in shown.active.tolist())
