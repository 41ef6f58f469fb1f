"""Nothing appears or vanishes in sight: a body that jumps changes no pixel of any picture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, sin

import numpy as np
import pytest

from factory.engine.mjcf.parts import HIDDEN
from factory.engine.mjcf.replica import Replica
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.dimensions import RISE
from factory.floor.layout.layout import Layout
from factory.support import gl
from factory.support.engine import mujoco
from factory.support.resource import Closing
from tests.examples import without_hands
from tests.opengl import needs_gl

SIZE = 240, 320
"""Height and width of a picture."""

EYES = 0.3
"""Height of the low cameras [m]."""

AWAY = 1.0
"""How far from where they look they are at least [m]."""

FAR = 0.02
"""A body jumps when it is further than this from where it was a timestep before [m]."""


@dataclass(frozen=True, eq=False)
class Jump:
    """What a body does between two states: how all joints and welds are, and where it is, before
    and after."""

    body: str
    before: np.ndarray
    after: np.ndarray
    places: tuple[np.ndarray, np.ndarray]

    @property
    def in_sight(self) -> np.ndarray:
        """Where it is above the floor."""
        low, high = sorted(self.places, key=lambda place: float(place[2]))
        assert low[2] < HIDDEN < high[2]
        return high


def jumps(layout: Layout, units: int, fuse: bool = False) -> Iterator[Jump]:
    """What jumps in a run. The state after a jump is that of the body alone: nothing else moves."""
    simulation = Simulation(layout, RunRequest(units=units, fuse=fuse))
    m, d, welds = simulation.physical.m, simulation.physical.d, simulation.physical.parts.welds
    found: list[Jump] = []
    write = welds._put

    def put() -> None:
        before, places = d.qpos.copy(), d.xpos.copy()
        write()
        for body in np.flatnonzero(np.linalg.norm(d.xpos - places, axis=1) > FAR).tolist():
            name = m.body(body).name
            found.append(Jump(name, before, d.qpos.copy(), (places[body], d.xpos[body].copy())))

    welds._put = put  # type: ignore[method-assign]
    run = simulation.run()
    assert run.products == units and run.physics and not run.physics.unintended_contacts
    yield from found


def cameras(layout: Layout, at: np.ndarray) -> Iterator[mujoco.MjvCamera | str]:
    """The overview, the one from above, and low ones from every side that look at a place, no
    steeper than housings are made for."""
    yield from ("overview", "top")
    size = float(max(layout.product.high - layout.product.low))
    away = max(AWAY, 3 * size, (at[2] - EYES) / RISE)
    for turn in np.arange(4) * np.pi / 2 + 0.3:
        eye = np.array([at[0] + away * cos(turn), at[1] + away * sin(turn), EYES])
        look = at - eye
        camera = mujoco.MjvCamera()
        camera.lookat[:], camera.distance = at, float(np.linalg.norm(look))
        camera.azimuth = degrees(atan2(look[1], look[0]))
        camera.elevation = degrees(atan2(look[2], hypot(look[0], look[1])))
        yield camera


class Eye(Closing):
    """Looks at a model, of which some geoms may be left out or changed."""

    def __init__(self, layout: Layout, m: mujoco.MjModel) -> None:
        self.layout, self.replica = layout, Replica(m)
        self._held = gl.context(SIZE[1], SIZE[0])
        self._scene = mujoco.MjvScene(m, maxgeom=10_000)
        self._drawing = mujoco.MjrContext(m, mujoco.mjtFontScale.mjFONTSCALE_150.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._drawing)

    def close(self) -> None:
        self._held.make_current()
        self._drawing.free()
        self._held.free()

    def sees(self, jump: Jump) -> Iterator[int]:
        """How many pixels of each picture a jump changes."""
        for camera in cameras(self.layout, jump.in_sight):
            before, after = (self._picture(q, camera) for q in (jump.before, jump.after))
            yield int((before != after).sum())

    def _picture(self, qpos: np.ndarray, camera: mujoco.MjvCamera | str) -> np.ndarray:
        m, d = self.replica.m, self.replica.d
        self.replica.place(qpos)
        mujoco.mj_camlight(m, d)
        if isinstance(camera, str):
            number, camera = m.camera(camera).id, mujoco.MjvCamera()
            camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, number
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(m, d, mujoco.MjvOption(), None, camera, everything, self._scene)
        self._held.make_current()
        rectangle, pixels = mujoco.MjrRect(0, 0, SIZE[1], SIZE[0]), np.empty((*SIZE, 3), np.uint8)
        mujoco.mjr_render(rectangle, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, rectangle, self._drawing)
        return pixels


def model_of(layout: Layout, units: int) -> mujoco.MjModel:
    return Simulation(layout, RunRequest(units=units)).physical.m


@needs_gl
@pytest.mark.slow
@pytest.mark.parametrize("name", ["truck", "chair", "gearbox"])
def test_no_jump_of_an_example_changes_a_pixel(name: str) -> None:
    layout = without_hands(name)
    with Eye(layout, model_of(layout, 2)) as eye:
        for jump in jumps(layout, 2):
            assert not any(eye.sees(jump)), jump.body
