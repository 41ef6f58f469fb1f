"""Pictures of a model's state, drawn by MuJoCo's classic renderer without a screen."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from factory.record.monitor.subject import MonitorSubject
from factory.render.camera import (
    PART,
    Array,
    Camera,
    Frame,
    View,
    fit,
    from_above,
    orbit,
    overview,
    towards,
)
from factory.render.following import Followed
from factory.render.subject import Snapshot, extent
from factory.support import gl
from factory.support.engine import mujoco
from factory.support.resource import Closing

Pixels = NDArray[np.uint8]

MANY = 110
"""Robots above which a film has no shadows: they cost a second pass over all geometry."""

SOFT = 0.11
"""Radius of the sun as a still sees it [rad]: the softness of shadows."""

LAG = 0.25
"""Time in which the camera goes from one product to the next [s]."""


class Painter(Closing):
    """Draws one model from one camera; it has a model and data of its own, so a run is not
    disturbed.

    `caption`: height of the strip below that is kept free, as a fraction of the picture's.
    `samples`: above 1 a picture is the mean of so many, each with the key light and the pixels'
    grid moved a little: soft shadows and smooth edges, for stills. Raises MissingError where there
    is no GL."""

    def __init__(
        self,
        m: mujoco.MjModel,
        size: tuple[int, int],
        camera: Camera,
        caption: float = 0.0,
        samples: int = 1,
        subject: MonitorSubject | None = None,
    ) -> None:
        gl.probe()
        self.width, self.height = size
        self.samples = samples
        self.camera = camera
        self.m = m = copy(m)
        m.vis.global_.offwidth, m.vis.global_.offheight = size
        if samples > 1:
            m.vis.quality.offsamples = 1
        m.opt.enableflags = int(m.opt.enableflags) & ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self.d = mujoco.MjData(m)
        mujoco.mj_kinematics(m, self.d)
        self.frame = Frame(self.width / self.height, below=0.03 + caption)
        self.points = extent(m, self.d)
        self.orbit = orbit(self.points, self.frame)
        self.followed = None
        if camera == "product" or camera.startswith(PART):
            assert subject is not None, "a camera that follows needs to know the factory"
            self.followed = Followed(m, subject, camera.removeprefix(PART) if ":" in camera else "")
        self.wanted: Array | None = None
        self.body = -1
        self.away, self.glide = np.zeros(3), np.zeros(3)
        self.shadows = int((m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE).sum()) <= MANY
        self.held = gl.context(*size)
        self.scene = mujoco.MjvScene(m, maxgeom=m.ngeom + 100)
        self.drawing = mujoco.MjrContext(m, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self.drawing)
        self.options, self.free = mujoco.MjvOption(), mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(m, self.free)
        self.rectangle = mujoco.MjrRect(0, 0, *size)
        self.pixels = np.empty((self.height, self.width, 3), np.uint8)

    def close(self) -> None:
        """Gives the GL context back."""
        if self.held is not None:
            self.held.make_current()
            self.drawing.free()
            self.held.free()
            self.held = None

    def paint(self, shown: Snapshot, elapsed: float = 0.0, time: float = 0.0) -> Pixels:
        """One picture (height, width, 3) at a time [s]. `elapsed` [s] since the last one: a camera
        that follows glides; with 0 it is where it wants to be."""
        view = self._pose(shown, elapsed, time)
        if self.samples == 1:
            self._draw(view, self.shadows)
            return np.ascontiguousarray(self.pixels[::-1])
        total = np.zeros(self.pixels.shape, np.float32)
        for n in range(self.samples):
            self._draw(view, True, (n, self.samples))
            total += self.pixels
        return np.ascontiguousarray((total / self.samples + 0.5).astype(np.uint8)[::-1])

    # --- where the camera stands ------------------------------------------------------------------

    def _pose(self, shown: Snapshot, elapsed: float, time: float) -> View:
        self.d.qpos[:] = shown.qpos
        mujoco.mj_kinematics(self.m, self.d)
        mujoco.mj_camlight(self.m, self.d)
        if self.camera == "overview":
            return overview(self.points, self.frame)
        if self.camera == "top":
            return from_above(self.points, self.frame)
        if self.camera == "orbit":
            return self.orbit(time)
        return self._following(shown, elapsed)

    def _following(self, shown: Snapshot, elapsed: float) -> View:
        assert self.followed is not None
        wanted, body = self._wanted(shown)
        if elapsed <= 0.0 or self.wanted is None:
            self.away, self.glide = np.zeros(3), np.zeros(3)
        else:
            if body != self.body:
                self.away = self.away + self.wanted - wanted
            self._glide(elapsed)
        self.wanted, self.body = wanted, body
        box = self.followed.box
        about = box.mean(axis=0) + 1.45 * (box - box.mean(axis=0))
        return fit(wanted + self.away + about, towards(-122.0, 44.0), self.frame)

    def _wanted(self, shown: Snapshot) -> tuple[Array, int]:
        """Where the camera should look, and the body it follows there. A product that nobody holds
        any more is let go: the camera stays until it is gone."""
        assert self.followed is not None
        found = self.followed.furthest(self.d, shown)
        if found is None:
            return (self.points.mean(axis=0) if self.wanted is None else self.wanted), self.body
        body, rank = found
        if rank == np.inf and body == self.body and self.wanted is not None:
            return self.wanted, body
        return self.followed.origin(self.d, body), body

    def _glide(self, elapsed: float) -> None:
        """The way still to go after a change of body, one step of a critically damped spring
        later."""
        decay, push = np.exp(-elapsed / LAG), (self.glide + self.away / LAG) * elapsed
        self.away = (self.away + push) * decay
        self.glide = (self.glide - push / LAG) * decay

    # --- drawing ----------------------------------------------------------------------------------

    def _draw(self, view: View, shadows: bool, sample: tuple[int, int] | None = None) -> None:
        scene, everything = self.scene, mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self.m, self.d, self.options, None, self.free, everything, scene)
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False
        shift = _halton(sample[0] + 1) - 0.5 if sample else np.zeros(2)
        self._aim(view, shift)
        self._light(view, sample)
        self.held.make_current()
        mujoco.mjr_render(self.rectangle, scene, self.drawing)
        mujoco.mjr_readPixels(self.pixels, None, self.rectangle, self.drawing)

    def _aim(self, view: View, shift: Array) -> None:
        """Set the scene's cameras to a view, moved by a fraction of a pixel."""
        near, far = view.range
        dx = shift[0] * 2 * view.wide / self.width
        dy = shift[1] * 2 * view.tall / self.height
        for camera in self.scene.camera:
            camera.pos, camera.forward, camera.up = view.position, view.axes[2], view.axes[1]
            camera.frustum_near, camera.frustum_far = near, far
            camera.frustum_width = near * view.wide
            camera.frustum_center = near * dx
            camera.frustum_bottom = near * (dy - view.tall)
            camera.frustum_top = near * (dy + view.tall)

    def _light(self, view: View, sample: tuple[int, int] | None) -> None:
        """The headlight shines from the camera, the key light over what is seen; a still moves
        it."""
        middle = view.position + view.distance * view.axes[2]
        self.drawing.shadowClip = 1.25 * view.distance * max(view.wide, view.tall) + view.depth
        for light in self.scene.lights[: self.scene.nlight]:
            if light.headlight:
                light.pos, light.dir = view.position, view.axes[2]
            elif light.castshadow:
                if sample is not None:
                    light.dir = _moved(np.asarray(light.dir, float), sample)
                light.pos = middle - sum(view.range) / 2 * np.asarray(light.dir, float)


def _moved(direction: Array, sample: tuple[int, int]) -> Array:
    """A direction moved inside a disc of radius SOFT, the samples evenly spread over it."""
    n, count = sample
    radius, angle = SOFT * ((n + 0.5) / count) ** 0.5, n * 2.399963
    side = np.cross(direction, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    other = np.cross(direction, side)
    moved = direction + radius * (np.cos(angle) * side + np.sin(angle) * other)
    return np.asarray(moved / np.linalg.norm(moved))


def _halton(n: int) -> Array:
    """The n-th point of an even sequence in the unit square."""
    return np.array([_radical(n, 2), _radical(n, 3)])


def _radical(n: int, base: int) -> float:
    value, weight = 0.0, 1.0
    while n:
        weight /= base
        n, digit = divmod(n, base)
        value += weight * digit
    return value
