"""Pictures by Filament, the physically based renderer that comes with MuJoCo, without a screen.

It needs Vulkan: `fault` says what is missing. A picture is not the same to the bit each time. A
second context in another thread blocks the process, so all pictures of one come from one thread.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import get_ident
from typing import Any

import numpy as np

from factory.engine.mjcf.replica import SHOWN, Replica
from factory.film.marks import THIN, Mark
from factory.film.picture import RendererName
from factory.film.studio import GOLDEN, SIZE, environment, moved, sun
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError, MissingError
from factory.support.gl import loads
from factory.support.pictures.ink import Pixels
from factory.support.pictures.sight import View
from factory.support.pictures.video import Size
from factory.support.resource import Closing

AROUND, KEY = 9_500.0, 60_000.0
"""The light of the studio and of the sun [lux]."""

SUNLIGHT, BACKGROUND = [1.0, 0.975, 0.94], [0.80, 0.81, 0.83]
"""The colours of the sun and of what is behind everything, linear."""

BULB = 0.15
"""Radius of the sun in its own shadows [m]."""

SHADOWS = 4096
"""Texels along an edge of the shadow map."""

SCALE = 10.0
"""What is drawn is so much larger: ambient occlusion reaches 0.3 units, which would blacken the
metals of a machine of 0.4 m, and so it reaches 3 cm."""

SOFT = 0.045
"""Radius of the sun as a still sees it [rad]."""

NOTHING = 1e-4
"""What is left out is so many times as large: which groups are seen is asked only once."""

MULTISAMPLES = 4

OPTIONS: dict[str, str | float] = {
    "shadows.type": "pcf",
    "shadows.map_size": SHADOWS,
    "ao.enabled": 1,
    "ao.quality": "high",
    "ao.upsampling": "high",
    "ao.bent_normals": 0,
    "cg.tone_mapping": "pbr_neutral",
    "vignette.enabled": 1,
    "vignette.midpoint": 0.85,
}
"""How Filament is set, by the names of its documentation."""

LOADER = "libvulkan.so.1"
"""What finds the drivers of Vulkan."""

APT = "apt-get install -y mesa-vulkan-drivers"
"""On Debian, this package brings Mesa's Vulkan drivers, one of which needs no graphics card."""


def settings() -> str:
    """Filament's options as a part of an MJCF."""
    rows = [
        f'<text name="filament.{name}" data="{value}"/>'
        if isinstance(value, str)
        else f'<numeric name="filament.{name}" data="{value}"/>'
        for name, value in OPTIONS.items()
    ]
    return f"<custom>{''.join(rows)}</custom>"


@cache
def fault() -> Diagnostic | None:
    """What keeps Filament from drawing here, None where it draws: tried in a process of its own,
    because without Vulkan it ends the process."""
    if sys.platform == "linux" and not loads(LOADER):
        return _needs_vulkan(f"{LOADER} cannot be loaded")
    package = str(Path(__file__).resolve().parents[2])
    paths = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-c", "from factory.film.filament import trial; trial()"]
    try:
        done = subprocess.run(
            command,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=120,
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return _needs_vulkan(str(error))
    if done.returncode == 0:
        return None
    reasons = [line for line in done.stderr.splitlines() if line.startswith("reason:")]
    return _needs_vulkan(reasons[0].removeprefix("reason:") if reasons else "the trial failed")


def _needs_vulkan(reason: str) -> Diagnostic:
    message = f"the renderer filament needs Vulkan, which does not work here: {reason.strip()}"
    return Diagnostic("NoVulkan", message, None, f"{APT}, or take --renderer classic")


def trial() -> None:
    """Draw a ball, or end the process."""
    m = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    view = View(np.array([0.0, -6.0, 0.0]), axes, 0.3, 0.3, 6.0, 1.0)
    with Filament(Replica(m), (64, 64)) as filament:
        if filament.draw(view)[32, 32].max() < 20:
            raise SystemExit(1)


@contextmanager
def _silence() -> Iterator[None]:
    """Keeps what the renderer says of itself from the standard output and error."""
    streams = sys.stdout, sys.stderr
    for stream in streams:
        stream.flush()
    kept, nowhere = [os.dup(number) for number in (1, 2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(nowhere, number)
        yield
    finally:
        for number, stream in zip((1, 2), kept, strict=True):
            os.dup2(stream, number)
            os.close(stream)
        os.close(nowhere)


_threads = set[int]()


"""The threads of this process that have drawn: one at most."""


def draws(asked: RendererName, still: bool) -> bool:
    """Whether a picture is to be by Filament: by itself a still where it works, and no film, which
    takes twice as long. Raises MissingError (NoVulkan) and InputError (BadValue) where it is asked
    for and cannot be had."""
    if asked == "classic" or (asked == "auto" and not still):
        return False
    missing, elsewhere = fault(), bool(_threads - {get_ident()})
    if asked == "filament" and missing is not None:
        raise MissingError(missing)
    if asked == "filament" and elsewhere:
        message = "another thread of this process has drawn with filament"
        raise InputError(Diagnostic("BadValue", message, None, "draw from one thread"))
    return missing is None and not elsewhere


class Filament(Closing):
    """Draws a replica as a view has it. All calls must come from one thread."""

    def __init__(self, replica: Replica, size: Size) -> None:
        import_module("mujoco.studio")  # registers its materials
        self.mjrf: Any = import_module("mujoco.mjrf")
        _threads.add(get_ident())
        self.replica, self.size = replica, size
        self.m, self.d = _enlarged(replica.m)
        config = self.mjrf.ContextConfig()
        config.software_rendering = True
        with _silence():
            self.context = self.mjrf.Context(config)
            self.context.set_clear_color(BACKGROUND)
            self.scene = self.context.create_scene(self.mjrf.SceneParams())
            self.scene.configure_from_model(self.m)
            self.scene.set_msaa(MULTISAMPLES)
            self.resources = self.mjrf.ModelResources(self.context, self.m)
            self.things = self.mjrf.ModelRenderables(self.scene, self.resources)
            self.things.set_options(mujoco.MjvOption())
            self._add_lights()
            self._add_target()
        self.marks: list[Mark] = []
        self.discs: list[Any] = []
        self.towards: Array | None = None

    def close(self) -> None:
        """Give everything back, in this order."""
        names = "request", "read", "target", "discs", "light", "sky", "texture"
        for name in (*names, "things", "resources", "scene", "context"):
            self.__dict__.pop(name, None)

    def _add_lights(self) -> None:
        kinds, config = self.mjrf.LightType, self.mjrf.TextureConfig()
        config.format = self.mjrf.PixelFormat.PIXEL_FORMAT_KTX
        config.sampler_type = self.mjrf.SamplerType.TEXTURE_CUBE
        config.width = config.height = SIZE
        self.texture = self.context.create_texture(config)
        data = self.mjrf.TextureData()
        data.set_image(environment())
        self.texture.upload(data)
        sky, light = self.mjrf.LightParams(), self.mjrf.LightParams()
        sky.type, sky.texture, sky.intensity = kinds.LIGHT_IMAGE, self.texture, AROUND
        light.type, light.intensity, light.cast_shadow = kinds.LIGHT_DIRECTIONAL, KEY, True
        light.color, light.bulb_radius, light.shadow_map_size = SUNLIGHT, BULB, SHADOWS
        self.sky, self.light = (self.context.create_light(one) for one in (sky, light))
        self.scene.add_light(self.sky)
        self.scene.add_light(self.light)

    def _add_target(self) -> None:
        (wide, tall), formats = self.size, self.mjrf.PixelFormat
        config = self.mjrf.RenderTargetConfig(width=wide, height=tall)
        config.color_format = formats.PIXEL_FORMAT_RGB8
        config.depth_format = formats.PIXEL_FORMAT_DEPTH32F
        self.target = self.context.create_render_target(config)
        self.pixels = np.empty((tall, wide, 3), np.uint8)
        self.read = self.mjrf.ReadRequest(target=self.target)
        self.read.set_buffer(self.pixels)
        self.request = self.mjrf.RenderRequest(scene=self.scene, target=self.target)
        self.request.viewport = self.mjrf.Rect(left=0, bottom=0, width=wide, height=tall)

    def draw(self, view: View, shadows: bool = True) -> Pixels:
        """The pixels, from the lowest row up; they are written over by the next picture."""
        first = self.towards is None
        if self.towards is None:  # it stands still when the camera turns
            self.towards = sun(view.axes)
        self._shine(self.towards)
        self._aim(view)
        self._place()
        self._lay_marks()
        self.request.shadows = shadows
        for _ in range(2 if first else 1):  # at first not all that it needs is there
            self._render()
        return self.pixels[::-1]

    def mean(self, view: View, samples: int) -> Pixels:
        """The mean of pictures, each with the sun and the pixels' grid moved a little, from the
        highest row down: a still, of half as many as the classic renderer takes."""
        self.draw(view)
        count, total = max(1, samples // 2), np.zeros(self.pixels.shape, np.float32)
        assert self.towards is not None
        for n in range(count):
            radius, turn = SOFT * ((n + 0.5) / count) ** 0.5, n * GOLDEN
            self._shine(moved(self.towards, radius, turn))
            self._aim(view, ((n + 0.5) / count - 0.5, (n * 0.618034) % 1 - 0.5))
            self._render()
            total += self.pixels
        return (total / count + 0.5).astype(np.uint8)

    def _render(self) -> None:
        with _silence():
            self.context.wait_for_frame(self.context.render([self.request], [self.read]))

    def _place(self) -> None:
        """Put everything where the replica has it, in its colours, without what it leaves out."""
        m, d = self.replica.m, self.replica.d
        np.multiply(d.geom_xpos, SCALE, out=self.d.geom_xpos)
        self.d.geom_xmat[:] = d.geom_xmat
        self.m.geom_rgba[:] = m.geom_rgba
        out = (m.geom_group >= SHOWN) & (self.m.geom_group < SHOWN)
        self.d.geom_xmat[out] *= NOTHING
        self.things.update(self.d)

    def _aim(self, view: View, shift: tuple[float, float] = (0.0, 0.0)) -> None:
        """Set the camera to a view, moved by a fraction of a pixel."""
        near, far = (SCALE * length for length in view.range)
        across = near * shift[0] * 2 * view.wide / self.size[0]
        up = near * shift[1] * 2 * view.tall / self.size[1]
        self.request.camera = self.mjrf.Camera(
            pos=SCALE * view.position,
            forward=view.axes[2],
            up=view.axes[1],
            frustum_near=near,
            frustum_far=far,
            frustum_bottom=up - near * view.tall,
            frustum_top=up + near * view.tall,
            frustum_width=near * view.wide,
            frustum_center=across,
        )

    def _shine(self, towards: Array) -> None:
        """Let the sun stand in a direction."""
        self.light.set_pose(5 * SCALE * towards, -towards)

    def _lay_marks(self) -> None:
        """Lay discs on the floor where there are marks."""
        for disc in self.discs:
            self.scene.remove_renderable(disc)
        self.discs = []
        for mark in self.marks:
            disc = self.context.create_renderable(self.mjrf.RenderableParams(cast_shadow=False))
            disc.set_geom_mesh(mujoco.mjtGeom.mjGEOM_CYLINDER, 1, 28, 1)
            colour = [*(part / 255 for part in mark.colour), mark.alpha]
            disc.set_material(self.mjrf.Material(color=colour, metallic=0, roughness=0.6))
            disc.set_size([SCALE * mark.radius, SCALE * THIN / 2, 0])
            disc.set_pose(SCALE * np.array([*mark.at, THIN]), np.eye(3))
            self.scene.add_renderable(disc)
            self.discs.append(disc)


def _enlarged(m: mujoco.MjModel) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A model SCALE times as large, with its data."""
    large = copy(m)
    for lengths in (large.mesh_vert, large.geom_size, large.geom_pos, large.body_pos):
        lengths *= SCALE
    large.mat_texrepeat[:] /= SCALE
    return large, mujoco.MjData(large)
