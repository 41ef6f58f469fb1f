"""Pictures of a model's state, drawn by MuJoCo's classic renderer without a screen."""

from __future__ import annotations

from functools import cache
from typing import ClassVar

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.mjcf.scene import FILL, KEY
from factory.engine.record.subject import MonitorSubject
from factory.film.action import Fading, Snapshot
from factory.film.filament import Filament
from factory.film.following import Lookout, Viewpoint
from factory.film.marks import Mark, Marks
from factory.film.picture import Camera
from factory.film.spotlight import Spotlight
from factory.film.studio import GOLDEN, moved, sun
from factory.support import gl
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.ink import Pixels
from factory.support.pictures.sight import Framing, View
from factory.support.pictures.smoothing import smooth
from factory.support.pictures.video import Size
from factory.support.resource import Closing

MANY = 110
"""Robots above which a film has no shadows: they cost a second pass over all geometry."""

STILL_SHADOWS, FILM_SHADOWS = 4096, 2048
"""Texels along an edge of the shadow map."""

SOFT = 0.04
"""Radius of the sun as a still sees it [rad]: the softness of shadows."""


Sample = tuple[int, int]
"""The number of one of several pictures that a still is the mean of, and how many there are."""


class Painter(Closing):
    """Draws one model from one camera; it has a model and data of its own, so a run is not
    disturbed.

    `framing`: the margins that are kept free, that of the caption too. `samples`: above 1 a picture
    is the mean of so many, each with the key light and the pixels' grid moved a little: soft
    shadows and smooth edges, for stills; edges of a film's are smoothed afterwards. Raises
    MissingError where there is no GL."""

    def __init__(
        self,
        m: mujoco.MjModel,
        size: Size,
        camera: Camera,
        subject: MonitorSubject,
        framing: Framing,
        samples: int = 1,
        renderer: type[Renderer | Filament] | None = None,
    ) -> None:
        gl.probe()
        self.replica, self.samples = Replica(m), samples
        _facet(self.replica.m)
        quality = self.replica.m.vis
        quality.global_.offwidth, quality.global_.offheight = size
        quality.quality.offsamples = 0
        quality.quality.shadowsize = STILL_SHADOWS if samples > 1 else FILM_SHADOWS
        self.viewpoint: Lookout = Viewpoint(self.replica, camera, framing, subject, samples > 1)
        self.fading, self.spotlight = Fading(self.replica), Spotlight(self.replica)
        joints = (names.kind(m.joint(n).name) for n in range(m.njnt))
        self.shadows = sum(kind == "robot" for kind in joints) <= MANY
        self.renderer = (renderer or Renderer)(self.replica, size)

    def close(self) -> None:
        """Gives the GL context back."""
        self.renderer.close()

    def paint(
        self,
        shown: Snapshot,
        elapsed: float = 0.0,
        time: float = 0.0,
        marks: Marks | None = None,
    ) -> Pixels:
        """One picture (height, width, 3) at a time [s], with `marks` on the floor. `elapsed` [s]
        since the last one: a camera that follows glides; with 0 it is at its goal at once."""
        self.replica.place(shown.qpos)
        self.renderer.marks = [] if marks is None else [*marks.at(shown, time)]
        mujoco.mj_camlight(self.replica.m, self.replica.d)
        view = self.viewpoint.view(shown, elapsed, time)
        self.fading.fade(view, self.viewpoint.watched)
        self.spotlight.aim(self.viewpoint.concerned, shown)
        if self.samples == 1:
            return smooth(np.ascontiguousarray(self.renderer.draw(view, self.shadows)[::-1]))
        return self.renderer.mean(view, self.samples)


class Renderer(Closing):
    """Draws a replica as a view has it, with a GL context of its own.

    Attributes:
        KEY: direction of the light that casts the shadows.
        FILL: direction of the other light.
    """

    KEY: ClassVar[tuple[float, float, float]] = KEY
    FILL: ClassVar[tuple[float, float, float]] = FILL

    def __init__(self, replica: Replica, size: Size) -> None:
        self.replica, m = replica, replica.m
        self.held = gl.context(*size)
        self.scene = mujoco.MjvScene(m, maxgeom=m.ngeom + 100)
        self.drawing = mujoco.MjrContext(m, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self.drawing)
        self.options, self.free = mujoco.MjvOption(), mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(m, self.free)
        self.rectangle = mujoco.MjrRect(0, 0, *size)
        self.pixels = np.empty((size[1], size[0], 3), np.uint8)
        self.marks: list[Mark] = []
        self.sun: Array | None = None

    def close(self) -> None:
        """Gives the GL context back."""
        if self.held is not None:
            self.held.make_current()
            self.drawing.free()
            self.held.free()
            self.held = None

    def draw(self, view: View, shadows: bool, sample: Sample | None = None) -> Pixels:
        """The pixels, from the lowest row up; they are written over by the next picture."""
        scene, everything = self.scene, mujoco.mjtCatBit.mjCAT_ALL.value
        m, d, nothing = self.replica.m, self.replica.d, None
        mujoco.mjv_updateScene(m, d, self.options, nothing, self.free, everything, scene)
        for mark in self.marks:
            mark.add_to(scene)
        flags = mujoco.mjtRndFlag
        scene.flags[flags.mjRND_SHADOW], scene.flags[flags.mjRND_SKYBOX] = shadows, view.has_sky
        for unused in (flags.mjRND_REFLECTION, flags.mjRND_HAZE, flags.mjRND_POST_PROCESSING):
            scene.flags[unused] = False
        self._aim(view, _spread(sample[1])[sample[0]] - 0.5 if sample else np.zeros(2))
        self._light(view, sample)
        self.held.make_current()
        mujoco.mjr_render(self.rectangle, scene, self.drawing)
        mujoco.mjr_readPixels(self.pixels, None, self.rectangle, self.drawing)
        return self.pixels

    def mean(self, view: View, samples: int) -> Pixels:
        """The mean of so many pictures, from the highest row down: a still."""
        total = np.zeros(self.pixels.shape, np.float32)
        for n in range(samples):
            total += self.draw(view, True, (n, samples))
        return np.ascontiguousarray((total / samples + 0.5).astype(np.uint8)[::-1])

    def _aim(self, view: View, shift: Array) -> None:
        """Set the scene's cameras to a view, moved by a fraction of a pixel."""
        near, far = view.range
        dx = shift[0] * 2 * view.wide / self.rectangle.width
        dy = shift[1] * 2 * view.tall / self.rectangle.height
        for camera in self.scene.camera:
            camera.pos, camera.forward, camera.up = view.position, view.axes[2], view.axes[1]
            camera.frustum_near, camera.frustum_far = near, far
            camera.frustum_width = near * view.wide
            camera.frustum_center = near * dx
            camera.frustum_bottom = near * (dy - view.tall)
            camera.frustum_top = near * (dy + view.tall)

    def _light(self, view: View, sample: Sample | None) -> None:
        """The headlight shines from the camera, the key light, beside where the first camera
        stands, over what is seen; a still moves it."""
        if self.sun is None:
            self.sun = sun(view.axes)
        middle = view.position + view.distance * view.axes[2]
        self.drawing.shadowClip = 1.25 * view.distance * max(view.wide, view.tall) + view.depth
        for light in self.scene.lights[: self.scene.nlight]:
            if light.headlight:
                light.pos, light.dir = view.position, view.axes[2]
            elif light.castshadow:
                light.dir = -self.sun if sample is None else _spread_sun(self.sun, sample)
                light.pos = middle - sum(view.range) / 2 * np.asarray(light.dir, float)


ROUND = (
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
)
"""Shapes that are curved in both directions."""


def _facet(m: mujoco.MjModel) -> None:
    """Let the engine draw no more facets than are seen: flat faces whole, cylinders of two rings.
    By itself it cuts a face into 16, and a cylinder into 16 rings."""
    m.vis.quality.numquads = 1
    if not np.isin(m.geom_type[m.geom_group < SHOWN], ROUND).any():
        m.vis.quality.numstacks = 2


def _spread_sun(towards: Array, sample: Sample) -> Array:
    """The way of the light from one place of a sun of radius SOFT, evenly spread over it."""
    n, count = sample
    return moved(-towards, SOFT * ((n + 0.5) / count) ** 0.5, n * GOLDEN)


@cache
def _spread(count: int) -> Array:
    """Halton points (count, 2): spread evenly over the unit square, all within it. (Those of SciPy
    are the same, but its statistics take longer to import than a still takes to draw.)"""
    return np.array([[_inverse(n, base) for base in (2, 3)] for n in range(1, count + 1)])


def _inverse(number: int, base: int) -> float:
    """The radical inverse: the digits of a number in a base, mirrored at the point."""
    mirrored, place = 0.0, 1.0 / base
    while number:
        number, digit = divmod(number, base)
        mirrored += digit * place
        place /= base
    return mirrored
