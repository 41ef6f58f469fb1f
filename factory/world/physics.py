"""The MuJoCo world: slide joints, actuators with force limits, parts as free bodies, welds.

At a transition the actuators' setpoints follow another mode's reference and the welds of the parts
concerned are switched; nothing is teleported, except a finished product's bodies returning out of
sight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from time import perf_counter

import numpy as np

from factory.control.governor import follow
from factory.control.mode import REST, ROUNDING, Array, Index, Truth
from factory.control.navigation import Bundle
from factory.engine import mujoco
from factory.factory import Operation
from factory.mjcf import names
from factory.mjcf.loading import load
from factory.mjcf.model import GRAVITY, HEAD_MASS, Model
from factory.world.contacts import NOBODY
from factory.world.courses import AHEAD, Course, Courses, Way, travelled
from factory.world.inspection import Inspection
from factory.world.outfeed import Outfeed
from factory.world.rewind import Rewind
from factory.world.setpoints import Setpoints
from factory.world.stock import Stock

GIVEN_UP = tuple(
    int(getattr(mujoco.mjtWarning, f"mjWARN_{name}"))
    for name in ("BADQPOS", "BADQVEL", "BADQACC", "BADCTRL")
)
"""Warnings after which the engine has begun anew, or let go of the drives."""

MAY_SLEEP, STAYS_AWAKE = (
    int(getattr(mujoco.mjtSleepPolicy, f"mjSLEEP_{name}")) for name in ("ALLOWED", "NEVER")
)
"""What the engine is told of a robot that stands, and of one under way."""


class MujocoWorld:
    """A compiled model with its data, and the parts' whereabouts.

    `gains`: factor on each axis's controller gain; `loaded`: what `load` has given for the model,
    of which a copy is run. `at_once`: so many ticks go to the engine at once, at most. Raises
    InputError (BadMesh) where the engine refuses the model, with the engine's own words.
    """

    def __init__(
        self,
        model: Model,
        start: Array,
        gains: Array,
        units: int,
        counts: Mapping[int, int] | None = None,
        wip: int | None = None,
        loaded: mujoco.MjModel | None = None,
    ) -> None:
        self.model, self.settings = model, model.settings
        self.done = (counts or {}).get(model.factory.dropoff.end, 0)
        self.m = load(model) if loaded is None else copy(loaded)
        self.d = mujoco.MjData(self.m)
        factory = model.factory
        carriages = [robot.name for robot in factory.robots]
        self.lift = {robot: len(carriages) + n for n, robot in enumerate(factory.strokes)}
        lifts = [carriages[robot] for robot in self.lift]
        slides = [*map(names.slide, carriages), *map(names.lift, lifts), names.OUTFEED_SLIDE]
        drives = [*map(names.drive, carriages), *map(names.hoist, lifts), names.OUTFEED_DRIVE]
        joint = [self.m.joint(name).id for name in slides]
        actuator = np.array([self.m.actuator(name).id for name in drives])
        self.tray = len(slides) - 1
        self.qpos = self.m.jnt_qposadr[joint]
        self.dof = self.m.jnt_dofadr[joint]
        self._sensed = self.qpos[: self.tray], self.dof[: self.tray]
        self.body = self.m.jnt_bodyid[joint]
        self.tree, self._policy = self.m.body_treeid[self.body], self.m.tree_sleep_policy
        self.m.actuator_biasprm[actuator[: self.tray], 1:3] *= np.asarray(gains)[:, None]
        self._x = np.array(start, float)
        self._v = np.zeros_like(self._x)
        self.tick, self.steps = self.settings.tick, self.settings.steps
        self.stride, self.ticks = self.settings.stride, 0
        self.at_once = self.stride
        self.courses = Courses()
        self.supplied = True
        self._active = np.empty(0, np.intp)
        self._moved = b"", b""
        self._last: Course | None = None
        self._then: dict[int, Course] = {}
        self._anew = True
        self._under_way = np.zeros(len(slides), bool)
        own = self.m.body_subtreemass[self.body] + self.m.dof_armature[self.dof]
        weight = np.zeros(len(slides))
        weight[list(self.lift.values())] = HEAD_MASS * GRAVITY
        self.setpoints = Setpoints(self.m, self.d, actuator, self.steps, own.round(9), weight)
        self.control = self.setpoints.control
        here, still = np.append(self._x, 0.0), np.zeros(len(slides))
        self.d.qpos[self.qpos] = here
        self.setpoints.move(np.arange(len(slides)), here, still, still)
        tray = int(self.qpos[-1]), int(self.dof[-1])
        self.outfeed = Outfeed(self.d, model, self.tray, tray, self.setpoints, self.courses)
        self.stock = Stock(self.m, self.d, model, units, counts or {}, wip)
        self.vicinity = self.stock.vicinity
        self._holder = np.full(len(slides), NOBODY)
        self._holder[: len(carriages)] = np.arange(len(carriages)) + 1
        self._holder[self.tray] = self.stock.tray
        self.vicinity.goes(self._holder, here, still, here)
        gaps = self.stock.board.gaps
        self.inspection = Inspection(self.m, self.d, model, self.stock.contacts, gaps)
        for operation in factory.operations:
            begun, over = ((counts or {}).get(t, 0) for t in (operation.start, operation.end))
            if begun > over:
                self.inspection.started(operation, over)
        loads = self.stock.loads()
        self._load([*loads], [*loads.values()])
        self.setpoints.update(0)
        self._begin = Rewind(self.m, self.d)
        self.physics_time = 0.0
        mujoco.mj_forward(self.m, self.d)

    @property
    def time(self) -> float:
        """[s]"""
        return float(self.d.time)

    @property
    def dropoffs(self) -> list[float]:
        """When each product left the outfeed [s]."""
        return self.stock.left

    @property
    def reference(self) -> Array:
        """Where each axis ought to be [m]."""
        self._catch_up()
        return self._x

    @property
    def speed(self) -> Array:
        """How fast each ought to be [m/s]."""
        self._catch_up()
        return self._v

    def _catch_up(self) -> None:
        """Where the last course has led to is not written down until somebody asks."""
        if self._last is not None:
            self._x[self._active], self._v[self._active], _ = self._last.told.after.T
            self._last = None

    def axes_of(self, robot: int) -> list[int]:
        """The axes of a robot (index): its carriage, and its lift if it has one."""
        return [robot, self.lift[robot]] if robot in self.lift else [robot]

    def sense(self) -> tuple[Array, Array]:
        """Measured positions and speeds of all carriages, then of all lifts."""
        return self.d.qpos[self._sensed[0]], self.d.qvel[self._sensed[1]]

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder presents the part of that unit; the outfeed has room for a product."""
        if operation.label in self.stock.feed:
            return self.stock.presents(operation.label, unit)
        if operation.index == self.model.factory.dropoff.index:
            return self.stock.on_tray is None and self.outfeed.rests_home()
        return True

    def apply(
        self, started: Sequence[tuple[Operation, int]], ended: Sequence[tuple[Operation, int]]
    ) -> None:
        """Hand the parts of ended operations over: welds off and on in one tick."""
        for operation, unit in started:
            self.inspection.started(operation, unit)
        if not ended:
            return
        if self.stock.joining:
            self.stock.fuse([robot for operation, _ in ended for robot in operation.robots])
        dropoff = self.model.factory.dropoff.index
        for operation, unit in ended:
            self.inspection.ended(operation)
            if operation.index == dropoff:
                self.inspection.measured(*self.stock.finished(unit))
        robots = [robot for operation, _ in ended for robot in operation.robots]
        labels = [label for operation, _ in ended for label in operation.after]
        self._load(robots, [self.model.masses.get(label, 0.0) for label in labels])
        self.vicinity.carries(robots, labels)
        self.inspection.handoffs += self.stock.hand_over(ended)
        self.supplied = True

    def _load(self, robots: Sequence[int], loads: Sequence[float]) -> None:
        """Robots carry so much from now on [kg]: their drives push accordingly."""
        self.setpoints.load(np.array(robots, np.intp), np.array(loads), 0.0)
        lifts = [(self.lift[r], m) for r, m in zip(robots, loads, strict=True) if r in self.lift]
        if lifts:
            axes, mass = np.array([lift for lift, _ in lifts]), np.array([m for _, m in lifts])
            self.setpoints.load(axes, mass, (HEAD_MASS + mass) * GRAVITY)

    def step(self, bundle: Bundle | None, axes: Index, ticks: int = 1) -> bool:
        """Some ticks of the engine, the drives following a reference that obeys F_p under the
        limits: as many as are asked for, or fewer, but never past one that somebody has to see the
        end of. Whether any mode may have come to its goal: no robot is far ahead of its reference,
        nor at rest before that is."""
        if axes is not self._active:
            self._turn(bundle, axes)
        near, ticks, tray = False, self._at_most(ticks), None
        if self.outfeed.goes:
            tray = self.outfeed.course(ticks)
            ticks = tray.ticks
        if bundle is not None:
            if self._anew:
                self._foresee(bundle, axes)
            course = self._next(bundle, axes, ticks)
            self._last, self._then = course, course.then
            self.setpoints.follow(axes, course.told)
            self._anew = near = course.near
            ticks = course.ticks
        if tray is not None:
            self._send_tray(tray if tray.ticks == ticks else self.outfeed.course(ticks))
        self.advance(ticks * self.steps)
        self.settle(ticks)
        return near

    def _at_most(self, ticks: int) -> int:
        """So many ticks may go to the engine at once: none but the last of a stride is seen, and
        contacts ask to be, and a tray that has just been loaded or is about to be there."""
        waits = self.stock.on_tray is not None and not self.outfeed.leaves
        if self.d.ncon or self.outfeed.settles or waits:
            return 1
        return min(ticks, self.at_once, self.stride - self.ticks)

    def _foresee(self, bundle: Bundle, axes: Index) -> None:
        """Attend to all that move before somebody looks again, or may be where they go; however
        many ticks go to the engine at once. Who moved until now comes to rest awake."""
        earlier, before = self._moved
        moves = self._next(bundle, axes, self.stride - self.ticks).moves
        self._moved = before, moves
        if not earlier == before == moves:
            moved = np.frombuffer(before, bool) if before else self._under_way[axes]
            self._attend(axes, np.frombuffer(moves, bool) | moved)

    def _next(self, bundle: Bundle, axes: Index, ticks: int) -> Course:
        """What comes after the last course, of so many ticks at most."""
        course = self._then.get(ticks)
        if course is None:
            begin = self._beginning(bundle, axes)
            course = self.courses.of(begin, ticks, lambda: self._course(bundle, axes, ticks))
            self._then[ticks] = course
        return course

    def _beginning(self, bundle: Bundle, axes: Index) -> tuple[Bundle, bytes, bytes]:
        """All that a course depends on which begins here."""
        return bundle, self.reference[axes].tobytes(), self._v[axes].tobytes()

    def _course(self, bundle: Bundle, axes: Index, ticks: int) -> Course:
        """Ticks of the active modes, until one comes near its goal. The load of each robot is that
        of its operation."""
        begin = self.reference[axes], self._v[axes]

        def go(x: Array, v: Array) -> Way:
            x1, v1, a = follow(bundle, x, v, self.tick)
            slow = np.abs(v1)
            v1[slow < ROUNDING] = 0.0
            return (x, v, a), x1, v1, bundle.near_goal(x1, AHEAD, slow < REST)

        return travelled(self.setpoints, axes, begin, ticks, go)

    def _turn(self, bundle: Bundle | None, active: Index) -> None:
        """Other modes are active. Robots whose operation has ended stop where their reference is.
        They may hand over at a low speed: left as a setpoint it would carry them out of the goal,
        and of the next domain."""
        self._catch_up()
        left = np.zeros_like(self._under_way)
        left[self._active] = True
        left[active] = False
        (axes,) = left.nonzero()
        if len(axes):
            here, going = self._x[axes], self._v[axes] != 0.0
            self._v[axes] = 0.0
            self.setpoints.stand(axes, here, going)
            self._attend(axes, np.zeros_like(going))
            self._goes(axes, here)
        if bundle is not None:
            self._goes(active, bundle.goal)
            self._then = self.courses.since(self._beginning(bundle, active))
        self._active, self._moved = active, (b"", b"")
        self._look()

    def _goes(self, axes: Index, places: Array) -> None:
        """From now on the references of `axes` go to places [m]."""
        if self.vicinity.culls:
            self.vicinity.goes(self._holder[axes], self._x[axes], self._v[axes], places)

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on the references of `axes` run from x [m] at speed v under acceleration a, in
        ticks that have not been set otherwise."""
        self._catch_up()
        self._then = {}
        self.vicinity.astray()
        self.setpoints.move(axes, x, v, a)

    def advance(self, steps: int) -> None:
        """Steps of the engine, the setpoints of those kept up to date that `move` has set going or
        stopped: all at once, and one by one again where anything has touched, since contacts are
        looked at in every step, or somebody has left their way, since not all were looked at."""
        m, d, step, vicinity = self.m, self.d, mujoco.mj_step, self.vicinity
        if self.outfeed.goes:
            self._send_tray(self.outfeed.course(1))
        if self.setpoints.any_due:
            self._attend(*self.setpoints.update(steps))
        vicinity.notice()
        if vicinity.stale:
            vicinity.look()
        if not d.ncon:
            self._begin.save()
            d.maxuse_con = 0
            begin = perf_counter()
            step(m, d, steps)
            self.physics_time += perf_counter() - begin
            if not vicinity.holds():
                vicinity.astray()
            elif not d.maxuse_con:
                return
            self._begin.restore()
            self.setpoints.again()
        for number in range(steps):
            if number and number % self.steps == 0:
                self.inspection.tick()
            if vicinity.stale:
                vicinity.look()
            begin = perf_counter()
            step(m, d)
            self.physics_time += perf_counter() - begin
            if d.ncon:
                self.inspection.contacts()
                vicinity.notice()

    def _send_tray(self, course: Course) -> None:
        self.outfeed.send(course)
        self._attend(self.outfeed.axis, np.frombuffer(course.moves, bool))

    def _attend(self, axes: Index, moves: Truth) -> None:
        """The engine puts to sleep what has been slow for a while, and a robot under way would
        never come to its goal: what moves stays awake, what stands may sleep."""
        if not np.count_nonzero(self._under_way[axes] != moves):
            return
        self._under_way[axes] = moves
        self._policy[self.tree[axes]] = MAY_SLEEP
        self._policy[self.tree[self._under_way]] = STAYS_AWAKE
        self.rouse(axes[moves])

    def rouse(self, axes: Index) -> None:
        """Wake robots that sleep, and let those that are about to wait as long again."""
        self.stock.board.wake(self.body[axes].tolist())

    def settle(self, ticks: int = 1) -> None:
        """After some ticks: look at what is looked at once in a stride, and at the outfeed's
        tray."""
        self.ticks += ticks
        self.inspection.tick()
        if self.ticks >= self.stride:
            self._look()
        unit, outfeed = self.stock.on_tray, self.outfeed
        if unit is None and outfeed.idle:
            return
        if unit is not None and outfeed.rests_away():
            self.inspection.measured(*self.stock.finished(unit))
            self.stock.recycle()
            self.supplied = True
        elif unit is None and not outfeed.home and outfeed.rests_home():
            self.supplied = True
        if outfeed.aim(self.stock.on_tray is not None):
            self.vicinity.goes(self._holder[outfeed.axis], *outfeed.way())

    def _look(self) -> None:
        """At what is looked at when other modes begin, and once in a stride from then."""
        self.ticks, self._anew = 0, True
        self.inspection.welds()
        if self.stock.joining:
            self.stock.settle()

    def unstable(self) -> str:
        """What made the engine give up, "" while it has not."""
        for kind in GIVEN_UP:
            if self.d.warning[kind].number:
                name = mujoco.mjtWarning(kind).name.removeprefix("mjWARN_BAD").lower()
                return f"the simulation became unstable ({name} is nan or huge)"
        return ""

    def delivered(self) -> int:
        """Products that have left the outfeed, since the beginning of time."""
        return self.done + len(self.stock.left)
