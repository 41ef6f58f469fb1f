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

from factory.control.governor import follow, govern
from factory.control.mode import ROUNDING, Array, Index
from factory.control.navigation import Bundle
from factory.control.profile import landing_speed
from factory.engine import mujoco
from factory.errors import Diagnostic, InputError
from factory.factory import Operation
from factory.mjcf import names
from factory.mjcf.binary import cached, keep
from factory.mjcf.model import CARRIAGE_MASS, GRAVITY, HEAD_MASS, HOIST_MASS, Model
from factory.mjcf.outfeed import TRAY_MASS
from factory.world.courses import Course, Courses
from factory.world.inspection import Inspection
from factory.world.stock import AWAKE, FRESH, Stock

AHEAD = 0.005
"""No robot is further ahead of its reference than this [m]."""

NEAR = 1e-3
"""The tray is somewhere when it is within this [m]."""

GIVEN_UP = tuple(
    int(getattr(mujoco.mjtWarning, f"mjWARN_{name}"))
    for name in ("BADQPOS", "BADQVEL", "BADQACC", "BADCTRL")
)
"""Warnings after which the engine has begun anew, or let go of the drives."""

DOZE = int(mujoco.mjMINAWAKE) // 2
"""Steps of the engine between looks at who sleeps: it takes twice as many of a slow body to doze
off."""

SLOW = 0.02
"""A robot under way that is slower than this might fall asleep [m/s]."""


class MujocoWorld:
    """A compiled model with its data, and the parts' whereabouts.

    `gains`: factor on each axis's controller gain; `loaded`: what `load` has given for the model,
    of which a copy is run. Raises InputError (BadMesh) where the engine refuses the model, with the
    engine's own words.
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
        actuator = [self.m.actuator(name).id for name in drives]
        self.tray = len(slides) - 1
        self.qpos = self.m.jnt_qposadr[joint]
        self.dof = self.m.jnt_dofadr[joint]
        self.body = self.m.jnt_bodyid[joint]
        self.tree = self.m.body_treeid[self.body]
        self.control = self.m.actuator_ctrladr[actuator]
        self.m.actuator_biasprm[actuator[: self.tray], 1:3] *= np.asarray(gains)[:, None]
        start = np.append(start, 0.0)
        self.reference = np.array(start, float)
        self.speed = np.zeros_like(self.reference)
        self.tick = self.settings.tick
        self._plan = np.zeros((4, len(start)))
        self._plan[1] = start
        self._due = np.zeros(len(start), bool)
        self._active = np.empty(0, np.intp)
        self._ctrl = self._inputs(self._active)
        self.courses = Courses()
        self._course: Course | None = None
        self._gone = 0
        ahead = self.settings.timestep * np.arange(self.settings.substeps + 1.0)
        self._powers = ahead[:, None] ** np.arange(3)
        self.mass = np.full(len(start), CARRIAGE_MASS)
        self.mass[self.tray] = TRAY_MASS
        self.mass[list(self.lift.values())] = HOIST_MASS
        self.weight = np.zeros(len(start))
        self.weight[list(self.lift.values())] = HEAD_MASS * GRAVITY
        self.d.qpos[self.qpos] = start
        self.d.ctrl[self.control] = start
        self.d.ctrl[self.control + 2] = self.weight
        self.stock = Stock(self.m, self.d, model, units, counts or {}, wip)
        self.vicinity = self.stock.vicinity
        self.inspection = Inspection(self.m, self.d, model, self.stock.contacts)
        for operation in factory.operations:
            begun, over = ((counts or {}).get(t, 0) for t in (operation.start, operation.end))
            if begun > over:
                self.inspection.started(operation, over)
        for robot, mass in self.stock.loads().items():
            self._load(robot, mass)
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

    def axes_of(self, robot: int) -> list[int]:
        """The axes of a robot (index): its carriage, and its lift if it has one."""
        return [robot, self.lift[robot]] if robot in self.lift else [robot]

    def sense(self) -> tuple[Array, Array]:
        """Measured positions and speeds of all carriages, then of all lifts."""
        axes = slice(self.tray)
        return self.d.qpos[self.qpos[axes]], self.d.qvel[self.dof[axes]]

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder presents the part of that unit; the outfeed has room for a product."""
        if operation.index == self.model.factory.dropoff.index:
            return self.stock.on_tray is None and self._tray_is_at(0.0)
        return bool(operation.inputs) or self.stock.presents(operation.label, unit)

    def apply(
        self, started: Sequence[tuple[Operation, int]], ended: Sequence[tuple[Operation, int]]
    ) -> None:
        """Hand the parts of ended operations over: welds off and on in one tick."""
        for operation, unit in started:
            self.inspection.started(operation, unit)
        for operation, unit in ended:
            self.inspection.ended(operation)
            if operation.index == self.model.factory.dropoff.index:
                self.stock.fuse(operation.carrier)
                self.inspection.measured(*self.stock.finished(unit))
            switched = self.stock.hand_over(operation, unit)
            self.inspection.handed_over(switched)
            for slot, robot in enumerate(operation.robots):
                self._load(robot, self.model.masses.get(operation.after[slot], 0.0))

    def _load(self, robot: int, load: float) -> None:
        """A robot carries so much from now on [kg]: its drives push accordingly."""
        self.mass[robot] = CARRIAGE_MASS + load
        if robot in self.lift:
            axis = self.lift[robot]
            self.mass[axis] = HOIST_MASS + load
            self.weight[axis] = (HEAD_MASS + load) * GRAVITY
            self.d.ctrl[self.control[axis] + 2] = self.weight[axis]

    def step(self, bundle: Bundle | None, axes: Index) -> bool:
        """One tick of the engine, the drives following a reference that obeys F_p under the
        limits. Whether any mode may have come to its goal: no robot is far ahead of its
        reference."""
        near = False
        self._halt(axes)
        if bundle is not None:
            x, v = self.reference[axes], self.speed[axes]
            course = self.courses.of(bundle, x, v, lambda: self._course_of(bundle, axes, x, v))
            self.reference[axes], self.speed[axes] = course.x, course.v
            self._course, self._gone, self._due[axes] = course, 0, False
            near = course.near
        self.advance(self.settings.substeps)
        self._course = None
        self.settle()
        return near

    def _course_of(self, bundle: Bundle, axes: Index, x: Array, v: Array) -> Course:
        """A tick of the active modes. The load of each robot is that of its operation."""
        x1, v1, a = follow(bundle, x, v, self.tick)
        setpoints, slow = self._setpoints(axes, x, v, a, 0.0)
        setpoints[-1, : len(axes)] = x1  # to the last bit, so that who stands is seen to
        return Course(x1, v1, setpoints, slow, bundle.near_goal(x1, AHEAD))

    def _halt(self, active: Index) -> None:
        """Robots whose operation has ended stop where their reference is. They may hand over at a
        low speed: left as a setpoint it would carry them out of the goal, and of the next
        domain."""
        if active is self._active:
            return
        left = np.zeros(len(self.speed), bool)
        left[self._active] = True
        left[active] = False
        axes = np.flatnonzero(left)
        still = np.zeros(len(axes))
        self.speed[axes] = 0.0
        self.d.ctrl[self._inputs(axes)] = np.concatenate(
            [self.reference[axes], still, self.weight[axes]]
        )
        self._active, self._ctrl = active, self._inputs(active)

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on the references of `axes` run from x [m] at speed v under acceleration a, in
        steps that have not been set otherwise."""
        plan = self._plan
        plan[0, axes] = self.d.time
        plan[1, axes], plan[2, axes], plan[3, axes] = x, v, a
        self._due[axes] = True

    def advance(self, substeps: int) -> None:
        """Timesteps of the engine, with the setpoints of all moving robots kept up to date: of
        those in modes, and of those that `move` has set going or stopped."""
        m, d = self.m, self.d
        gone, self._gone = self._gone, self._gone + substeps
        if self._course is None:
            creeping, inputs = self._ctrl[:0], self._ctrl[:0]
            rows = np.empty((substeps + 1, 0))
        else:
            creeping, inputs = self._course.slow, self._ctrl
            rows = self._course.setpoints[gone : gone + substeps + 1]
        (axes,) = self._due.nonzero()
        if len(axes):
            begun, x, v, a = self._plan[:, axes]
            own, slow = self._setpoints(axes, x, v, a, d.time - begun)
            rows = np.concatenate([rows, own[: substeps + 1]], axis=1)
            inputs = np.concatenate([inputs, self._inputs(axes)])
            creeping = np.concatenate([creeping, slow])
            self._due[axes] = self._plan[2:, axes].any(axis=0)
        setpoints, step, spent, vicinity = d.ctrl, mujoco.mj_step, 0.0, self.vicinity
        vicinity.notice()
        for number in range(substeps):
            setpoints[inputs] = rows[number]
            if len(creeping) and (gone + number) % DOZE == 0:
                self.rouse(creeping)
            if vicinity.stale:
                vicinity.look()
            begin = perf_counter()
            step(m, d)
            spent += perf_counter() - begin
            if d.ncon:
                self.inspection.contacts()
                vicinity.notice()
        setpoints[inputs] = rows[substeps]
        self.physics_time += spent

    def _inputs(self, axes: Index) -> Index:
        """Where in `ctrl` the setpoints of axes are (3 n,): positions, speeds, forces."""
        ctrl = self.control[axes]
        return np.concatenate([ctrl, ctrl + 1, ctrl + 2])

    def _setpoints(
        self, axes: Index, x: Array, v: Array, a: Array, since: Array | float
    ) -> tuple[Array, Index]:
        """The setpoints of axes at the next steps (k, 3 n), which have gone `since` [s] from x at
        speed v under acceleration a; and those of the axes that are slow."""
        n = len(axes)
        if np.ndim(since):
            x, v = x + since * (v + 0.5 * since * a), v + a * since
        slow = (np.abs(v) < SLOW) & ((v != 0.0) | (a != 0.0))
        terms = np.zeros((3, 3 * n))
        terms[0, :n], terms[0, n : 2 * n] = x, v
        terms[0, 2 * n :] = self.mass[axes] * a + self.weight[axes]
        terms[1, :n], terms[1, n : 2 * n] = v, a
        terms[2, :n] = 0.5 * a
        return self._powers @ terms, axes[slow]

    def rouse(self, axes: Index) -> None:
        """Wake robots that sleep, and keep those awake that creep: the engine puts to sleep what
        has been slow for a while, and a robot under way never comes to its goal then."""
        dof, tree = self.dof[axes], self.tree[axes]
        self.d.qvel[dof[self.d.qvel[dof] == 0.0]] = AWAKE
        awake = self.d.tree_asleep[tree] < 0
        self.d.tree_asleep[tree[awake]] = FRESH
        for body in self.body[axes[~awake]].tolist():
            self.vicinity.woken(body)

    def settle(self) -> None:
        """After a tick: look at welds, and move the outfeed's tray."""
        self.inspection.tick()
        if self.stock.joining:
            self.stock.settle()
        unit, way = self.stock.on_tray, self.model.layout.outfeed_way
        if unit is not None and self._tray_is_at(way):
            self.inspection.measured(*self.stock.finished(unit))
            self.stock.recycle()
            unit = None
        place = 0.0 if unit is None else way
        if self.reference[self.tray] != place or self.speed[self.tray]:
            self._send_tray(place)

    def _tray_is_at(self, place: float) -> bool:
        """Whether the outfeed's tray rests at a place of its way [m]."""
        x, v = self.d.qpos[self.qpos[self.tray]], self.d.qvel[self.dof[self.tray]]
        return bool(abs(x - place) < NEAR and abs(v) < NEAR / self.tick)

    def _send_tray(self, place: float) -> None:
        """One tick of the tray's way to a place, as fast as its limits allow."""
        tray, dt = np.array([self.tray]), self.tick
        x, v = self.reference[tray], self.speed[tray]
        loaded = self.stock.on_tray is not None
        self.mass[self.tray] = TRAY_MASS + loaded * self.model.masses[self.model.factory.pag.root]
        limit = np.array([self.settings.outfeed_acceleration])
        left = place - (x + v * (dt / 2))
        wanted = np.minimum(landing_speed(np.abs(left), limit, dt), self.settings.outfeed)
        x1, v1, a = govern(x, v, np.copysign(wanted, left), limit, dt)
        if abs(x1[0] - place) < ROUNDING and abs(v1[0]) < ROUNDING:
            x1, v1 = np.array([place]), np.zeros(1)
            self.move(tray, x1, v1, v1)
        else:
            self.move(tray, x, v, a)
        self.reference[tray], self.speed[tray] = x1, v1

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


def load(model: Model) -> mujoco.MjModel:
    """The engine's model of what `model_files` gives; from the user's cache if it is there. Raises
    InputError (BadMesh) where the engine refuses it."""
    m = cached(model)
    if m is None:
        m = _compiled(model)
        keep(model, m)
    return m


def _compiled(model: Model) -> mujoco.MjModel:
    xml = model.xml
    files: Mapping[str, bytes] = {
        f"meshes/{name}": content for name, content in model.files.items()
    }
    try:
        return mujoco.MjModel.from_xml_string(xml, dict(files))
    except ValueError as error:
        raise InputError(_explained(model, str(error))) from error


def _explained(model: Model, words: str) -> Diagnostic:
    """The engine's error, at the line of the part it speaks of where it names one."""
    for solid in model.layout.product.solids.values():
        mesh = f"mesh/{solid.mesh.name}" if solid.mesh else ""
        if f"part/{solid.label}#" in words or (mesh and mesh in words):
            position = model.factory.pag[solid.label].position
            return Diagnostic("BadMesh", words.strip(), position, "repair the mesh of this part")
    return Diagnostic("Engine", words.strip(), None, "please report this as a bug of factory")
