"""Parts alone, without a factory, as a model of the engine: for pictures of a product."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.engine.mjcf.model import SKELETON
from factory.engine.mjcf.scene import FILL, KEY
from factory.support.arrays import Array, Indices
from factory.support.engine import mujoco

FLOOR = 20.0
"""The floor is so many times as large as the product."""


def loose_parts(
    surfaces: Mapping[str, tuple[Array, Indices]],
    colours: Sequence[tuple[float, ...]],
    floor: float,
    size: float,
) -> mujoco.MjModel:
    """Bodies that are free to move, in the order of `surfaces`: vertices (n, 3) [m] and faces
    (m, 3) by label. `floor`: its height; `size`: that of the product [m]."""
    spec = mujoco.MjSpec.from_string(SKELETON.read_text("utf-8"))
    world = spec.worldbody
    ground = {"name": "floor", "type": mujoco.mjtGeom.mjGEOM_PLANE, "material": "floor"}
    world.add_geom(**ground, size=(FLOOR * size, FLOOR * size, 0.1), pos=(0, 0, floor))
    kind = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    for name, ray, shadow, diffuse in (("key", KEY, True, 0.5), ("fill", FILL, False, 0.15)):
        at = -3.0 * size * np.asarray(ray)
        light = {"name": name, "dir": ray, "pos": at, "type": kind, "castshadow": shadow}
        world.add_light(**light, diffuse=[diffuse] * 3, specular=[0.1 * shadow] * 3)
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    for (label, (vertices, faces)), colour in zip(surfaces.items(), colours, strict=True):
        spec.add_mesh(name=label, uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
        body = world.add_body(name=label, mass=1.0, inertia=(1.0, 1.0, 1.0), explicitinertial=True)
        body.add_freejoint()
        shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": label, "rgba": colour}
        body.add_geom(**shape, contype=0, conaffinity=0, mass=0, group=1)
    return spec.compile()
