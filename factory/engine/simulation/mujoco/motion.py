"""The motion of the axes in the engine: references, drives, sleep, steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from factory.engine.mjcf.driving import GRAVITY, ROLLING
from factory.engine.mjcf.model import Model
from factory.engine.simulation.mujoco.axes import Axes
from factory.engine.simulation.mujoco.courses import AHEAD, Course, Follower, along, planned
from factory.engine.simulation.mujoco.curves import Curves
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.mujoco.jaws import Jaws
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.outfeed import Outfeed
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.engine.simulation.mujoco.sliders import Sliders
from factory.engine.simulation.mujoco.stepping import Stepping
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.theory.control.navigation import Bundle


class Guides:
    """The friction of axes in their guides.

    Args:
        arrays: the arrays of the model.
        dof: the degree of freedom of each axis (axes,).
        curves: the axes that move several joints.

    Attributes:
        empty: friction without a load (axes,) [N], at first as in the model.
    """

    def __init__(self, arrays: ModelArrays, dof: Index, curves: Curves) -> None:
        self._dof, self._curves = dof, curves
        self._friction = arrays["dof_frictionloss"]
        self.empty = self._friction.now[dof]
        self._loads = np.zeros(len(dof))

    def load(self, axes: Index, loads: Array) -> None:
        """Set the loads of axes beside their own weight [kg]."""
        self._loads[axes] = loads
        self._rub(axes)

    def rub(self, axes: Index, newtons: float) -> None:
        """Set the friction of empty axes [N]."""
        self.empty[axes] = newtons
        self._rub(axes)

    def _rub(self, axes: Index) -> None:
        weight = self._loads[axes] * GRAVITY
        self._friction[self._dof[axes]] = self.empty[axes] + ROLLING * weight
        which, rows = self._curves.among(np.asarray(axes))
        if len(rows):
            same = self._friction.now[self._dof[np.asarray(axes)[which]]]
            self._friction[self._curves.dof[rows]] = same[:, None]


class Motion:
    """The axes of a model and their motion.

    Args:
        arrays: the arrays of the model.
        d: the engine's data.
        model: the MJCF model.
        start: positions at the start, without the tray (axes,) [m].
        gains: factors on the gains of the drives (axes,).

    Attributes:
        axes: the addresses of the axes in the engine's model.
        active: the axes of the active modes (n,).
        robots: the references of robots, which follow the active modes.
        outfeed: the tray and the shutter of the outfeed.
        sliders: the sliders of feeders.
        jaws: the jaws of grippers.
        drives: the setpoints of the drives.
        guides: the friction of the axes.
        sleep: which bodies the engine skips.
        plan: of axes that `move` has set going: since when [s], from where [m], how fast [m/s]
            and under which acceleration [m/s²] (4, axes).
        stepping: steps the engine; set before the first step.
    """

    stepping: Stepping

    def __init__(
        self, arrays: ModelArrays, d: mujoco.MjData, model: Model, start: Array, gains: Array
    ) -> None:
        m = arrays.m
        self.axes, self.settings, self._d = Axes.of(m, model.layout), model.settings, d
        robots, curves = self.axes.actuator[: self.axes.tray], self.axes.curves
        bias, factors = arrays["actuator_biasprm"], np.asarray(gains)[:, None]
        bias[robots, 1:3] = bias.now[robots, 1:3] * factors
        for further in curves.actuator.T:
            bias[further, 1:3] = bias.now[further, 1:3] * factors[curves.axes]
        body, dof = self.axes.body, self.axes.dof
        inertia = m.body_subtreemass[body] + m.dof_armature[dof]
        turns = self.axes.rotary
        inertia[turns] = m.dof_M0[dof[turns]]
        self.drives = Drives(arrays, d, self.axes.actuator, inertia.round(9), curves)
        self.guides = Guides(arrays, dof, curves)
        self.sleep = Sleep(arrays, d, self.axes.tree)
        x, v = np.append(start, [0.0, 0.0]), np.zeros(len(self.axes))
        self.axes.put(d, np.arange(len(x)), x)
        self.robots = Follower(x, v, self.drives, self.settings.steps)
        tray = Follower(x, v, self.drives, self.settings.steps)
        self.outfeed = Outfeed(d, model, self.axes, tray, self.drives)
        self.sliders = Sliders(arrays, d, model, self.sleep)
        self.jaws = Jaws(arrays, d, model, self.sleep)
        self.active: Index = np.empty(0, np.intp)
        self.plan = np.zeros((4, len(self.axes)))

    def begin(self, loads: Mapping[int, float]) -> None:
        """Let all axes stand, and each robot (index) carry its load [kg]."""
        every = np.arange(len(self.axes))
        robots = range(len(self.axes.of_robot))
        self.load(robots, [loads.get(robot, 0.0) for robot in robots])
        self.robots.stop(every)

    def load(self, robots: Sequence[int], loads: Sequence[float]) -> None:
        """Set the payloads of robots (index) [kg] in drives and guides: at once where a drive that
        stands bears a weight, for all others from their next courses on."""
        if not robots:
            return
        of = self.axes.of_robot
        axes = np.array([axis for robot in robots for axis in of[robot]])
        mass = np.repeat(loads, [len(of[robot]) for robot in robots])
        hanging = self.axes.hanging[axes]
        weight = np.where(hanging > 0, (hanging + mass) * GRAVITY, 0.0)
        self.drives.load(axes, mass * self.axes.inertia[axes], weight)
        self.guides.load(axes, np.where(self.axes.rolls[axes], mass, 0.0))
        stand = axes[(hanging > 0) & (self.robots.v[axes] == 0.0)]
        if len(stand):
            self.drives.stand(stand, self.robots.x[stand])

    def put(self, at: Mapping[int, float]) -> None:
        """Place axes elsewhere [m], at rest."""
        axes, x = np.array([*at], np.intp), np.array([*at.values()])
        self.axes.put(self._d, axes, x)
        self.robots.x[axes] = x
        self.robots.stop(axes)
        self.sleep.wake(self.axes.body[axes].tolist())

    def turn(self, active: Index) -> None:
        """Activate other modes. Robots whose operation has ended stop at their references: a
        handover may happen at a low speed, which would carry them out of the goal and of the next
        domain."""
        left = np.zeros(len(self.axes), bool)
        left[self.active] = True
        left[active] = False
        (over,) = left.nonzero()
        if len(over):
            self.robots.stop(over)
            self.sleep.may_sleep(over)
        self.sleep.stay_awake(active)
        self.active, self.robots.course = active, None
        moving = [active, self.outfeed.axes] if self.outfeed.moves else [active]
        self.stepping.turn(np.concatenate(moving))

    def step(self, bundle: Bundle | None, ticks: int) -> int:
        """Follow the modes of a bundle, and the tray's way, for some ticks, at most to the end of a
        course. Returns how many."""
        ticks = min(ticks, self.stepping.at_once)
        if bundle is not None:
            self.plan_robots(bundle)
            ticks = min(ticks, self.robots.left)
        ticks = 1 if self.outfeed.loading else self.move_tray(ticks)
        self.outfeed.loading = False
        if bundle is not None:
            self.robots.show(ticks)
        self.stepping.advance(ticks * self.settings.steps)
        return ticks

    def show(self) -> None:
        """Write into `ctrl` where sliders and jaws are on their strokes, for who looks at it: the
        drives have these setpoints since the strokes began."""
        self.sliders.show()
        self.jaws.show()

    def move_tray(self, ticks: int) -> int:
        """Move the tray along its way for some ticks, at most to the end of a course. Returns how
        many."""
        self.plan_tray()
        follower = self.outfeed.follower
        if not self.outfeed.moves:
            return ticks
        ticks = min(ticks, follower.left)
        follower.show(ticks)
        return ticks

    def plan_tray(self) -> None:
        """Start the tray's next course when one is over. At its goal it stands."""
        outfeed, follower = self.outfeed, self.outfeed.follower
        if outfeed.moves and not follower.left:
            self._begin(follower, outfeed.axes, self._tray_course(*outfeed.beginning))
            follower.show(0)
        elif not outfeed.moves and follower.course is not None:
            follower.stop(outfeed.axes)
            self.sleep.may_sleep(outfeed.axes)

    def plan_robots(self, bundle: Bundle) -> None:
        """Start the next stride of the active modes when one is over."""
        if not self.robots.left:
            self._plan(bundle)
            if self.outfeed.moves:  # its courses end with those of the robots
                self.outfeed.follower.course = None

    def _plan(self, bundle: Bundle) -> None:
        """The next stride of the active modes, each robot with the payload of its operation."""
        axes, robots = self.active, self.robots
        lag = self.axes.measured(self._d)[0][axes] - robots.x[axes]
        lag[np.abs(lag) <= AHEAD] = 0.0
        if lag.any():
            bundle = replace(bundle, gates=bundle.gates.lagging(lag))
        self._begin(robots, axes, self._course(bundle, robots.x[axes], robots.v[axes]))

    def _begin(self, follower: Follower, axes: Index, course: Course) -> None:
        follower.begin(axes, course)
        self.stepping.follow(axes, course)

    def _course(self, bundle: Bundle, x: Array, v: Array) -> Course:
        """A stride of the active modes from x [m] and v [m/s]."""
        settings = self.settings
        return self.stepping.course(
            (bundle, x.tobytes(), v.tobytes()),
            lambda: planned(
                self.drives,
                self.active,
                (x, v),
                (settings.stride, settings.steps),
                along(bundle, settings.tick, settings.step),
            ),
        )

    def _tray_course(self, x: Array, v: Array) -> Course:
        """A stride of the tray's way from x [m] and v [m/s]."""
        outfeed = self.outfeed
        begin = outfeed.goal, x.tobytes(), v.tobytes()
        return self.stepping.course(begin, lambda: outfeed.course(x, v))

    def send_tray(self, loaded: bool) -> None:
        """Send the tray away with a product, or home without."""
        self.outfeed.send(loaded)
        self.guides.load(self.outfeed.axes, self.outfeed.load)
        self.sleep.stay_awake(self.outfeed.axes)

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """Let `axes` run from x [m] at speed v [m/s] under acceleration a [m/s²], for as long as
        setpoints can be written ahead or until the next call."""
        self.robots.x[axes], self.robots.v[axes] = x, v
        self.plan[0, axes] = self.drives.time
        self.plan[1:, axes] = x, v, a
        if not self.plan[2:, axes].any():
            self.robots.stop(axes)
            self.sleep.may_sleep(axes)
            return
        most = self.drives.most
        ends = self._planned(axes, np.array([[0.0], [most * self.settings.step]]))
        self.drives.follow(axes, self.drives.sampled(axes, *ends, self.plan[3:, axes], most))
        self.sleep.stay_awake(axes)

    def settle(self) -> None:
        """A tick of axes that `move` has set going, and of the tray, is over: their references are
        where they are now."""
        if self.outfeed.follower.left:
            self.outfeed.follower.show(1)
        axes = np.flatnonzero(self.plan[2:].any(axis=0))
        if len(axes):
            begun, *_, a = self.plan[:, axes]
            reach = self.drives.most * self.settings.step
            x, v = self._planned(axes, np.minimum(self.drives.time - begun, reach))
            self.robots.x[axes], self.robots.v[axes] = x, v
            force = self.drives.mass[axes] * a + self.drives.weight[axes]
            setpoints = np.stack([x, v, force], axis=-1)[:, None]
            setpoints = self.drives.spread(axes, setpoints, a[:, None], np.zeros(1))
            self.drives.show(axes, setpoints[:, 0])

    def _planned(self, axes: Index, t: Array) -> tuple[Array, Array]:
        """Positions and speeds of axes on their plans, some time [s] after these began."""
        _, x, v, a = self.plan[:, axes]
        return x + t * (v + t / 2 * a), v + t * a
