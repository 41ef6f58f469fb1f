"""A copy of the engine's state that no run uses: to draw and to measure."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array
from factory.support.engine import mujoco

SHOWN = 3
"""Geoms of groups below this one are drawn."""

ROUND = 28
"""Sides of a cylinder."""


class Replica:
    """A model `m` and data `d` of its own, in which nothing sleeps, at the model's start."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m = copy(m)
        self.m.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self.d = mujoco.MjData(self.m)
        mujoco.mj_kinematics(self.m, self.d)

    def place(self, qpos: NDArray[Any]) -> None:
        """Put the joints at their positions `qpos` (nq,), the bodies and geoms where these have
        them."""
        self.d.qpos[:] = qpos
        mujoco.mj_kinematics(self.m, self.d)

    def switch(self, active: NDArray[np.int32]) -> None:
        """Make these constraints active and no others: rows (n, 3) of a constraint's number and its
        two bodies."""
        self.d.eq_active[:] = 0
        self.d.eq_active[active[:, 0]] = 1
        self.m.eq_obj1id[active[:, 0]] = active[:, 1]
        self.m.eq_obj2id[active[:, 0]] = active[:, 2]

    def exclude_nothing(self) -> None:
        """Let no pair of bodies be left out of contact."""
        self.m.exclude_signature[:] = -1

    def mask(
        self, geoms: NDArray[Any], bodies: NDArray[Any], contype: int, conaffinity: int
    ) -> None:
        """Give geoms and the bodies that they are of these masks."""
        self.m.geom_contype[geoms], self.m.geom_conaffinity[geoms] = contype, conaffinity
        self.m.body_contype[bodies], self.m.body_conaffinity[bodies] = contype, conaffinity


def shown(m: mujoco.MjModel, body: int) -> Iterator[int]:
    """The geoms of a body that are drawn: no planes, nothing hidden."""
    first = int(m.body_geomadr[body])
    for geom in range(first, first + int(m.body_geomnum[body])):
        plane = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
        if m.geom_group[geom] < SHOWN and not plane:
            yield geom


def paint(m: mujoco.MjModel, geom: int) -> Array:
    """The colour (4,) of a geom or of its material, from 0 to 1."""
    material = m.geom_matid[geom]
    return np.asarray(m.mat_rgba[material] if material >= 0 else m.geom_rgba[geom], float)


def half_sizes(m: mujoco.MjModel, geom: int) -> Array:
    """Half the sides (3,) of a box, or of the box round a geom of another shape [m]."""
    box = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
    return np.asarray(m.geom_size[geom] if box else m.geom_aabb[geom, 3:], float)


def mesh_of(m: mujoco.MjModel, geom: int) -> tuple[Array, NDArray[np.int64]]:
    """The vertices (n, 3) [m] and faces (k, 3) of a geom's mesh, in its frame."""
    mesh = m.mesh(int(m.geom_dataid[geom]))
    first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
    vertices = np.asarray(m.mesh_vert[first : first + count], float)
    first, count = int(mesh.faceadr[0]), int(mesh.facenum[0])
    return vertices, np.asarray(m.mesh_face[first : first + count], np.int64)


def triangles(m: mujoco.MjModel, geom: int) -> tuple[Array, NDArray[np.int64]]:
    """A geom's vertices (n, 3), in its own frame [m], and faces (k, 3)."""
    from trimesh import creation

    kind, size = mujoco.mjtGeom(m.geom_type[geom]), m.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return mesh_of(m, geom)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        made = creation.icosphere(subdivisions=2, radius=size[0])
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        made = creation.cylinder(size[0], 2 * size[1], sections=ROUND)
    else:
        made = creation.box(extents=2 * half_sizes(m, geom))
    return np.asarray(made.vertices, float), np.asarray(made.faces, np.int64)
