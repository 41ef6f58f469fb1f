"""The geoms of a model as triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array

if TYPE_CHECKING:
    from factory.support.engine import mujoco

ROUND = 28
"""Sides of a cylinder."""


def half_sizes(m: mujoco.MjModel, geom: int) -> Array:
    """Half the sides (3,) of a box, or of the box round a geom of another shape [m]."""
    from factory.support.engine import mujoco

    box = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
    return np.asarray(m.geom_size[geom] if box else m.geom_aabb[geom, 3:], float)


def triangles(m: mujoco.MjModel, geom: int) -> tuple[Array, NDArray[np.int64]]:
    """A geom's vertices (n, 3), in its own frame [m], and faces (k, 3)."""
    from trimesh import creation

    from factory.api import Geoms
    from factory.support.engine import mujoco

    kind, size = mujoco.mjtGeom(m.geom_type[geom]), m.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return Geoms(m).mesh(geom)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        made = creation.icosphere(subdivisions=2, radius=size[0])
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        made = creation.cylinder(size[0], 2 * size[1], sections=ROUND)
    else:
        made = creation.box(extents=2 * half_sizes(m, geom))
    return np.asarray(made.vertices, float), np.asarray(made.faces, np.int64)
