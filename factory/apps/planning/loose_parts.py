"""Parts that lie by themselves, as a model without a factory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.api import Model, Replica
from factory.film.painter import Renderer
from factory.support.arrays import Array, Indices
from factory.support.engine import mujoco
from factory.support.gl import probe
from factory.support.pictures.sight import Framing
from factory.support.pictures.video import Size
from factory.support.resource import Closing

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
    spec = mujoco.MjSpec.from_string(Model.SKELETON.read_text("utf-8"))
    world = spec.worldbody
    ground = {"name": "floor", "type": mujoco.mjtGeom.mjGEOM_PLANE, "material": "floor"}
    world.add_geom(**ground, size=(FLOOR * size, FLOOR * size, 0.1), pos=(0, 0, floor))
    kind = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    lights = ("key", Renderer.KEY, True, 0.5), ("fill", Renderer.FILL, False, 0.15)
    for name, ray, shadow, diffuse in lights:
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


LOOSE_SAMPLES = 12
"""A still of loose parts, which is drawn while a user waits, is the mean of so many pictures."""


class LooseParts(Closing):
    """Draws the parts of a product alone, moved from their places, with a GL context of its own, by
    one sample a pixel. Its arguments are those of `loose_parts`. Raises MissingError where there is
    no GL."""

    def __init__(
        self,
        surfaces: Mapping[str, tuple[Array, Indices]],
        colours: Sequence[tuple[float, ...]],
        floor: float,
        extent: float,
        size: Size,
    ) -> None:
        probe()
        model = loose_parts(surfaces, colours, floor, extent)
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        model.vis.quality.offsamples = 0
        self.replica = Replica(model)
        self.framing = Framing(size[0] / size[1], 0.06, 0.06, 0.06)
        self.renderer = Renderer(self.replica, size)

    def close(self) -> None:
        """Give the GL context back."""
        self.renderer.close()

    def move(self, offsets: Array) -> None:
        """Move each part by an offset (n, 3) [m] from its place in the product."""
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(offsets), 1))
        self.replica.place(np.hstack([offsets, upright]).ravel())
        mujoco.mj_camlight(self.replica.m, self.replica.d)
