"""The MuJoCo world: slide joints, actuators with force limits, parts as free bodies, welds.

At a transition the references of other modes drive the actuators, and the welds of the parts
concerned are switched. Nothing is teleported, except a finished product's bodies returning out of
sight.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from math import ceil
from typing import ClassVar

from factory.engine.mjcf.loading import fingerprint, load
from factory.engine.mjcf.model import Model
from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.state import EngineView, Observation
from factory.engine.simulation.mujoco.courses import Points
from factory.engine.simulation.mujoco.drives import INPUTS
from factory.engine.simulation.mujoco.fast.neighbours import Neighbours
from factory.engine.simulation.mujoco.fast.strides import Strides
from factory.engine.simulation.mujoco.inspection import Inspection
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.motion import Motion
from factory.engine.simulation.mujoco.parts import Parts
from factory.engine.simulation.mujoco.sliders import ROUNDED
from factory.engine.simulation.mujoco.soundness import Soundness
from factory.engine.simulation.mujoco.stepping import SingleSteps
from factory.engine.simulation.mujoco.strokes import NEVER
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.world import Drop, Hooks, Job
from factory.engine.timing.demand import Word
from factory.support.arrays import Array, Index
from factory.support.compiling import compiled
from factory.support.engine import by_name, mujoco
from factory.support.settings import MOST
from factory.theory.control.navigation import Bundle
from factory.theory.nets.coordinated import Past
from factory.theory.plant.operation import Operation

GIVEN_UP = tuple(
    int(getattr(mujoco.mjtWarning, f"mjWARN_{name}"))
    for name in ("BADQPOS", "BADQVEL", "BADQACC", "BADCTRL")
)
"""Warnings after which the engine has begun anew, or let go of the drives."""


class MujocoWorld:
    """The MuJoCo world of a run.

    Args:
        model: the MJCF model.
        request: the request for the run.
        start: the position of each axis (axes,) [m].
        gains: a factor on the controller gain of each axis (axes,).
        counts: how often each transition has fired where the run starts.
        loaded: what `load` has given for the model, of which a copy is run; None to load it.

    Attributes:
        m: the engine's model.
        d: its data.
        motion: the motion of the axes.
        parts: the parts and their holders.
        inspection: the measurements of the run.
        dropoffs: time at which each product left [s].

    Raises InputError (BadMesh) where the engine refuses the model, with the engine's own words.
    """

    INPUTS: ClassVar[int] = INPUTS

    instant = False

    def __init__(
        self,
        model: Model,
        request: RunRequest,
        start: Array,
        gains: Array,
        counts: Mapping[int, int],
        loaded: mujoco.MjModel | None = None,
    ) -> None:
        self.model, self.hooks, self.supplied = model, Hooks(), True
        self.m = load(model) if loaded is None else copy(loaded)
        self.d = mujoco.MjData(self.m)
        self._view = EngineView(self.m, self.d)
        self.dropoffs: list[float] = []
        self._before = model.factory.units(counts)
        self._unseen = 0
        with by_name():
            again = partial(compiled, model.xml, model.files)
            arrays = ModelArrays(self.m, fingerprint(model), again)
            self.motion = Motion(arrays, self.d, model, start, gains)
            self.parts = Parts(arrays, self.d, model, self.motion, request, counts)
            parts = self.parts
        held = parts.holdings
        soundness = Soundness(arrays, self.d, model, parts.masks, held.body, held.welds)
        self.inspection = Inspection(self.m, self.d, model, soundness)
        for operation in model.factory.operations:
            begun, over = (counts.get(t, 0) for t in (operation.start, operation.end))
            if begun > over:
                self.inspection.joining[operation.index] = model.factory.unit(operation, over)
        stepping = self.m, self.d, self.inspection, self.hooks, model.settings
        self.motion.stepping = (
            Strides(*stepping, Neighbours(self.m, self.d, self.parts, self.motion.axes))
            if request.fast and model.layout.chains is None
            else SingleSteps(*stepping)
        )
        self.motion.jaws.begin(self._in_hand)
        self.motion.begin(self.parts.holdings.loads())
        soundness.look()
        soundness.probe()
        mujoco.mj_forward(self.m, self.d)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.d.time)

    @property
    def arrays(self) -> ModelArrays:
        """The arrays of the model, through which they are written."""
        return self.inspection.soundness.arrays

    @property
    def word(self) -> Word:
        """Which units are made."""
        return self.parts.feeders.supply.word

    @property
    def physics_time(self) -> float:
        """Wall time spent in the engine's steps [s]."""
        return self.motion.stepping.seconds

    def sense(self) -> tuple[Array, Array]:
        """Measured positions [m] and speeds [m/s] of all carriages, then of all lifts."""
        return self.hooks.sensed(*self.motion.axes.measured(self.d))

    def observe(self, at_end: bool = False) -> Observation:
        """The state of the engine, whose arrays change with its next step."""
        self.motion.show()
        return self._view.look(at_end)

    @property
    def lacking(self) -> set[str]:
        """Labels of parts that robots wait for."""
        return self.parts.feeders.lacking

    def prepared(self, operation: Operation, unit: int) -> bool:
        """Whether a feeder presents the part of that unit, if it is made; whether the outfeed is
        free, and the sliders are up under which its robots go."""
        feeders = self.parts.feeders
        if not self.hooks.admit(operation, unit) or not feeders.sliders_are_up(operation):
            return False
        if feeders.serves(operation.label) and self.word.is_made(unit):
            return feeders.presents(operation.label, unit)
        if not self.model.factory.drops(operation.index):
            return True
        outfeed = self.motion.outfeed
        return self.parts.on_tray is None and (not outfeed.busy or outfeed.rests())

    def apply(self, started: Sequence[Job], ended: Sequence[Job]) -> None:
        """Hand the parts of ended operations over: welds off and on in one tick."""
        for operation, unit in started:
            self.inspection.joining[operation.index] = unit
        if ended:
            self._hand_over(ended)
            self.hooks.tell_ended()

    def arrive(self, operations: Sequence[Operation]) -> None:
        """Let jaws close on what robots take where they dwell."""
        self.motion.jaws.close(operations)

    def _hand_over(self, ended: Sequence[Job]) -> None:
        self.parts.complete(ended)
        for operation, unit in ended:
            self.inspection.joining.pop(operation.index, None)
            for robot in operation.robots:
                after = self.model.factory.after(robot, operation.index)
                self.motion.axes.curves.take(robot, after)
            if self.model.factory.drops(operation.index):
                self.inspection.measure(unit, *self.parts.finished(unit))
                self.motion.send_tray(True)
        robots = [robot for operation, _ in ended for robot in operation.robots]
        labels = [label for operation, _ in ended for label in operation.after]
        self.motion.load(robots, [self.model.masses.get(label, 0.0) for label in labels])
        self.parts.hand_over(ended)
        operations = [operation for operation, _ in ended]
        self.motion.jaws.close(operations)  # of robots that nobody has told to have arrived
        for holder, faces in self.motion.jaws.taken(operations).items():
            self.parts.welds.pads.beside(faces, [*self.parts.holdings.hand(holder).values()])
        self.motion.jaws.tend(self._in_hand)
        self.supplied = True

    def _in_hand(self, robot: int) -> Collection[str]:
        """The labels in a robot's hand (index)."""
        return self.parts.holdings.hand(robot)

    def step(
        self, bundle: Bundle | None, axes: Index, ticks: int = 1, until: Collection[Past] = ()
    ) -> bool:
        """Some ticks of the engine, the drives following references that obey F_p under the limits:
        as many as are asked for, but not past the end of a course. Whether any mode may have come
        to its goal: no robot is far ahead of its reference, nor at rest before that is. One that
        something touches may be: passes are looked for in every tick then."""
        motion = self.motion
        if axes is not motion.active:
            motion.turn(axes)
            self._look()
            if self.supplied:
                ticks = 1
        if bundle is None:
            ticks = min(ticks, self.model.settings.stride - self._unseen)
        else:
            motion.plan_robots(bundle)
        self._settle(motion.step(bundle, min(ticks, self._until_due(until))))
        return motion.robots.near

    def _until_due(self, until: Collection[Past]) -> int:
        """Ticks until an awaited pass may have come, or something is to be done at a feeder."""
        robots, feeders, tick = self.motion.robots, self.parts.feeders, self.model.settings.tick
        if feeders.blocked:
            clear = robots.until(feeders.blocked) * tick
            feeders.clear_from = self.time + (feeders.until_clear() if self.d.ncon else clear)
        due = min(feeders.due, feeders.clear_from, self.motion.sliders.up)
        left = (due - self.time) / tick - ROUNDED
        if until:
            left = min(left, 0.0 if self.d.ncon else robots.until(Points.of(until)))
        return max(1, ceil(min(left, MOST)))

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """Let `axes` run from x [m] at speed v [m/s] under acceleration a [m/s²]."""
        self.motion.move(axes, x, v, a)

    def advance(self, steps: int) -> None:
        """Advance by timesteps, with the axes moving as set by `move`."""
        self.motion.stepping.advance(steps)

    def in_the_way(self, away: Container[int]) -> set[int]:
        """Robots (index) that block the late part that they wait for, except those with an axis in
        `away`."""
        axes, robots = self.motion.axes.of_robot, self.parts.feeders.in_the_way()
        return {robot for robot in robots if not any(axis in away for axis in axes[robot])}

    def settle(self) -> None:
        """At the end of a tick's timesteps, start the tray's next tick."""
        self.motion.settle()
        if self._looks(1):
            self._bear()
        self._settle(1)
        self.motion.plan_tray()

    def _settle(self, ticks: int) -> None:
        """After some ticks: at the end of a course make the less frequent checks; always look after
        the outfeed's tray."""
        looks = self._looks(ticks)
        self._unseen += ticks
        self.inspection.tick()
        if self.motion.robots.over:
            self._bear()
        if looks:
            self._look()
        outfeed, unit, feeders = self.motion.outfeed, self.parts.on_tray, self.parts.feeders
        if feeders.due <= self.motion.sliders.now:
            feeders.due, self.supplied = NEVER, True
        if min(self.motion.sliders.up, feeders.clear_from) <= self.motion.sliders.now:
            self.supplied |= feeders.tend()
        if outfeed.busy and outfeed.rests():
            self.supplied = True
            if unit is None:
                outfeed.busy = False
                return
            self.inspection.measure(unit, *self.parts.finished(unit))
            self.dropoffs.append(self.time)
            self.parts.recycle()
            self.motion.send_tray(False)

    def _looks(self, ticks: int) -> bool:
        """Whether the less frequent checks are due after some ticks."""
        ahead, stride = self.motion.robots.left, self.model.settings.stride
        return not ahead and self._unseen + ticks > stride // 2

    def _bear(self) -> None:
        """Open overloaded hands. A falling body may come anywhere, so every timestep is inspected
        from then on."""
        if self.parts.bear():
            self.hooks.step_singly = True

    def _look(self) -> None:
        """Make the checks that follow a change of modes, and come about once in a stride."""
        self._unseen = 0
        self.inspection.welds()
        self.motion.jaws.tend(self._in_hand)
        self.supplied |= self.parts.feeders.tend()
        if self.parts.joining.waiting and self.dropped is None:
            self.parts.joining.settle(self.time)

    @property
    def dropped(self) -> Drop | None:
        """The first overload of a hand, if any."""
        return self.parts.strength.dropped

    @property
    def collision(self) -> str:
        """The two geoms that were first to touch without being meant to; "" for none."""
        return " and ".join(self.inspection.unintended[0]) if self.inspection.unintended else ""

    def delivered(self) -> int:
        """Number of products that have left the outfeed, including those before the run."""
        return self._before + len(self.dropoffs)

    def unstable(self) -> str:
        """Why the engine gave up; "" if it has not."""
        warned = self.d.warning.number
        if not warned.any():
            return ""
        for kind in GIVEN_UP:
            if warned[kind]:
                name = mujoco.mjtWarning(kind).name.removeprefix("mjWARN_BAD").lower()
                return f"the simulation became unstable ({name} is nan or huge)"
        return ""

    def figures(self) -> PhysicsFigures:
        """The figures of the run so far."""
        figures = self.inspection.figures(self.parts.welds, self.parts.strength.most)
        return figures if self.dropped is None else replace(figures, dropped_s=self.dropped.time)
