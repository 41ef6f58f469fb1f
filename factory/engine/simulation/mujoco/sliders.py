"""The sliders of feeders: each goes up empty and comes down with a part.

The slider of a line presents several parts, one after the other, each at its height.
"""

from __future__ import annotations

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.driving import GRAVITY
from factory.engine.mjcf.feeders import SLIDER_MASS
from factory.engine.mjcf.model import Model, stroke_ticks
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.engine.simulation.mujoco.strokes import NEVER, Strokes, Stroking
from factory.floor.layout.feeding import outlets_of
from factory.support.arrays import Index
from factory.support.engine import mujoco

ROUNDED = 0.01
"""What is due so much of a tick later is due."""


class Sliders(Stroking):
    """The sliders of the feeders (n,), in the order of their outlets. One from which the parts of
    several outlets hang is there for each of them, and has at most one part at a time.

    Attributes:
        up: when the first of those on their way up comes to the end of its way [s].
        trees: their kinematic trees (n,).
    """

    def __init__(self, arrays: ModelArrays, d: mujoco.MjData, model: Model, sleep: Sleep) -> None:
        m, outlets = arrays.m, outlets_of(model.layout)
        feeds = [m.equality(names.feed(outlet.label)).id for outlet in outlets]
        body, settings = m.eq_obj1id[feeds], model.settings
        sliders = [m.body(number).name for number in body.tolist()]
        joint = m.body_jntadr[body]
        actuators = np.array([m.actuator(slider).id for slider in sliders])
        self.trees = m.body_treeid[body]
        inertia = m.body_subtreemass[body] + m.dof_armature[m.jnt_dofadr[joint]]
        drives = Drives(arrays, d, actuators, inertia.round(9))
        loads = np.array([model.masses[outlet.label] for outlet in outlets])
        lengths = np.array([outlet.feeder.stroke for outlet in outlets])
        named = {names.slider(outlet.label): number for number, outlet in enumerate(outlets)}
        high = lengths[[named[slider] for slider in sliders]]
        ends = high - lengths, high
        ticks = stroke_ticks(model.layout, settings)

        def load(chosen: Index, loaded: bool) -> None:
            mass = loads[chosen] * loaded
            drives.load(chosen, mass, (SLIDER_MASS + mass) * GRAVITY)

        strokes = Strokes.of(drives, load, ends, settings.feeder_limits, ticks, settings)
        super().__init__(d, drives, sleep, body, m.jnt_qposadr[joint], load, strokes)
        self._soon = ROUNDED * settings.tick
        self.up = NEVER

    @property
    def now(self) -> float:
        """The current time of strokes' ends [s]."""
        return self._drives.time + self._soon

    def begin(self, down: Index) -> None:
        """At the start all sliders stand: up and empty, or `down` with their loads."""
        self.place(np.setdiff1d(np.arange(len(self.ends)), down), False)
        self.place(down, True)

    def is_up(self, number: int) -> bool:
        """Whether a resting slider is up."""
        low, high = self._strokes.low[number], self._strokes.high[number]
        at = self._d.qpos[self._address[number]]
        return bool(abs(at - high) < abs(at - low))

    def rises(self, number: int) -> bool:
        """Whether a slider is on its way up."""
        return bool(self.ends[number] < NEVER and not self._down[number])

    def send(self, chosen: Index, down: bool, loaded: bool = False) -> None:
        """Start strokes: down with loads, up empty, or up with a withdrawn part."""
        super().send(chosen, down, loaded)
        self.up = self._first_up()

    def settle(self) -> bool:
        """Let sliders stand that have completed their strokes since. Returns whether any has."""
        over = super().settle()
        if over:
            self.up = self._first_up()
        return over

    def _first_up(self) -> float:
        return float(self.ends[self._down == 0].min(initial=NEVER))
