"""The paper's own way of running (section 6): every robot executes its program by itself.

Robots share a cell each, for the label they carry, and the continuous state of the mode they are
in; nothing else. Each has its own control rate and phase. Reads of labels alone would race: a
tool's label never changes, and a slow robot may see a label of the next unit. So a cell counts,
beside its label, the operations its robot has finished, and a condition asks for a count; the
carrier alone ends an operation, and goes on when all others have followed. Why, is in
docs/design.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from factory.control.governor import govern
from factory.control.mode import ROUNDING, STILL, Array, Index, Limits, Mode
from factory.control.navigation import Bundle
from factory.control.staging import Stage
from factory.factory import Factory, Operation
from factory.programs import Program, Step, program_of
from factory.trace import Event

PERIODS = (0.006, 0.02)
"""Control periods are drawn from so long to so long [s], in whole timesteps, one at least."""


@dataclass(slots=True)
class Cell:
    """What a robot shows to all others: the label it carries and how many operations it has
    finished."""

    label: str
    turn: int = 0


class Link:
    """The continuous state that the robots of one mode share; reading any other robot is an
    error."""

    def __init__(self, world: Any, axes: Sequence[tuple[int, ...]]) -> None:
        self.world, self.axes = world, axes

    def read(self, operation: Operation, robot: int) -> tuple[Array, Array]:
        """Positions and speeds of an operation's axes, for one of its robots."""
        if robot not in operation.robots:
            raise AssertionError(f"robot {robot} is not in the mode of {operation.label}")
        x, v = self.world.sense()
        axes = list(self.axes[operation.index])
        return x[axes], v[axes]


@dataclass(slots=True)
class _Active:
    operations: tuple[int, ...] = ()


@dataclass(slots=True)
class Process:
    """One robot executing its program: the step it is at and its phase in it, `wait`, `run` or
    `leave`; the `reference` and `speed` of each of its `axes`, its lift's after its carriage's;
    whether it `goes_ahead` while it waits."""

    program: Program
    period: int
    phase: int
    axes: Index
    reference: Array
    speed: Array
    position: int = 0
    stage: str = "wait"
    clock: float = 0.0
    turns: int = 0
    goes_ahead: bool = False

    @property
    def step(self) -> Step:
        """The step it is at."""
        return self.program.steps[self.position]


@dataclass(slots=True)
class Record:
    """The record of a distributed run, in the terms of the net: X_s when the first robot enters an
    operation, X_e when its carrier ends it."""

    events: list[Event] = field(default_factory=list)
    started: set[tuple[int, int]] = field(default_factory=set)
    under_way: list[int] = field(default_factory=list)


class DistributedSupervisor:
    """No supervisor at all: it only lets the robots' processes tick, each at its own rate and
    phase."""

    def __init__(
        self,
        factory: Factory,
        modes: Sequence[Mode],
        limits: Limits,
        world: Any,
        timestep: float,
        ticks: int,
        seed: int = 0,
        stages: Sequence[Stage] = (),
    ) -> None:
        self.stages = {(stage.robot, stage.operation): stage for stage in stages}
        self.factory, self.modes, self.limits = factory, modes, limits
        self.world, self.timestep, self.ticks = world, timestep, ticks
        self.random = np.random.default_rng([seed, 7])
        self.net = factory.net.threaded
        self.marked = bytearray(
            p in factory.net.initial_marking for p in range(len(self.net.places))
        )
        self.link = Link(world, factory.axes)
        self.programs = [program_of(factory, r.index) for r in factory.robots]
        self.cells = [Cell(p.steps[0].label) for p in self.programs]
        low, high = (max(1, round(period / timestep)) for period in PERIODS)
        periods = self.random.integers(low, high + 1, size=len(self.programs))
        x = world.sense()[0]
        lifts = {robot: len(self.programs) + n for n, robot in enumerate(factory.strokes)}
        self.processes = []
        for p, n in zip(self.programs, periods, strict=True):
            axes = np.array([p.robot, *([lifts[p.robot]] if p.robot in lifts else [])])
            phase = int(self.random.integers(n))
            self.processes.append(
                Process(p, int(n), phase, axes, np.array(x[axes]), np.zeros(len(axes)))
            )
        self.place_in_gear = {
            (robot.index, number): position
            for robot in factory.robots
            for position, number in enumerate(robot.operations)
        }
        self.bundles: dict[int, Bundle] = {}
        self.alone: dict[tuple[int, int], Bundle] = {}
        self.record = Record()
        self.last_event = world.time
        self.active = _Active()
        self.count = 0

    @property
    def events(self) -> list[Event]:
        """The record so far."""
        return self.record.events

    def marking(self) -> tuple[str, ...]:
        """The names of the places that the record marks."""
        return tuple(p.name for p, m in zip(self.net.places, self.marked, strict=True) if m)

    def awaited(self) -> list[Operation]:
        """Nobody sees all the robots of an operation wait for it."""
        return []

    def limit(self, limits: Limits) -> None:
        """From now on axes have these limits."""
        self.limits = limits
        self.bundles.clear()
        self.alone.clear()

    def step(self, ticks: int = 1) -> None:
        """As many timesteps of the world as a supervisor's tick has; robots tick in between."""
        for _ in range(self.ticks):
            due = [p for p in self.processes if (self.count - p.phase) % p.period == 0]
            for index in self.random.permutation(len(due)):
                self._tick(due[index])
            self.world.advance(1)
            self.count += 1
        self.world.settle()

    # --- one robot's tick --------------------------------------------------------------------

    def _tick(self, process: Process) -> None:
        step = process.step
        if process.stage == "wait":
            if self._may_enter(process, step):
                process.stage, process.clock, process.goes_ahead = "run", 0.0, False
                self._entered(step.operation, self._unit(process))
            else:
                self._go_ahead(process, step)
        if process.stage == "run":
            self._run(process, step)
        elif process.stage == "leave" and self._followed(process, step):
            self._advance(process)

    def _may_enter(self, process: Process, step: Step) -> bool:
        """Every other robot of the operation has finished all that it does before this, and shows
        what it must bring; the world is prepared; all are in the domain."""
        operation = step.operation
        unit = self._unit(process)
        for other, label in step.until:
            cell, wanted = self.cells[other], self._turn(other, operation, unit)
            if cell.turn < wanted or (cell.turn == wanted and cell.label != label):
                return False
        started = (operation.index, unit) in self.record.started
        if step.is_carrier and not started and not self.world.prepared(operation, unit):
            return False
        x, _ = self.link.read(operation, process.program.robot)
        return started or bool(self._bundle(operation).in_domain(x)[0])

    def _run(self, process: Process, step: Step) -> None:
        operation, me = step.operation, process.program.robot
        carrier = self.cells[operation.carrier]
        if not step.is_carrier:
            if carrier.turn > self._turn(operation.carrier, operation, self._unit(process)):
                self._stop(process)
                self._finish(process, step)
                self._advance(process)
                return
        elif self._at_goal(process, step):
            self._stop(process)
            self._ended(operation, self._unit(process))
            self._finish(process, step)
            process.stage = "leave"
            return
        self._move(process, operation, me)

    def _move(self, process: Process, operation: Operation, me: int) -> None:
        """ẋ_i = π_i ∘ F_p, governed by the robot's own limits at its own rate; its lift's too."""
        dt = process.period * self.timestep
        x = self.link.read(operation, me)[0].copy()
        slots, mine = np.nonzero(np.equal.outer(self.factory.axes[operation.index], process.axes))
        x[slots] = process.reference[mine] + process.speed[mine] * dt / 2
        self._drive(process, mine, self._bundle(operation).field(x, dt)[slots])

    def _go_ahead(self, process: Process, step: Step) -> None:
        """While it waits, a robot may go where it is needed next; it reads nobody's state for
        that."""
        key = process.program.robot, step.operation.index
        stage = self.stages.get(key)
        if stage is None:
            return
        dt, mine = process.period * self.timestep, np.zeros(1, np.intp)
        at, speed = process.reference[mine], process.speed[mine]
        if abs(at[0] - stage.goal) < ROUNDING and abs(speed[0]) < ROUNDING:
            if process.goes_ahead:
                self._stop(process)
                process.goes_ahead = False
            return
        process.goes_ahead = True
        if key not in self.alone:
            self.alone[key] = Bundle.of([stage.mode], [self.limits.of((stage.robot,))])
        self._drive(process, mine, self.alone[key].field(at + speed * dt / 2, dt))

    def _drive(self, process: Process, mine: Index, wanted: Array) -> None:
        """One tick of a robot's own axes towards the `wanted` speeds [m/s]."""
        axes, at, speed = process.axes[mine], process.reference[mine], process.speed[mine]
        dt = process.period * self.timestep
        x1, v1, a = govern(at, speed, wanted, self.limits.acceleration[axes], dt)
        self.world.move(axes, at, speed, a)
        process.reference[mine], process.speed[mine] = x1, v1

    def _stop(self, process: Process) -> None:
        """Stand where the reference is."""
        process.speed[:] = 0.0
        self.world.move(process.axes, process.reference.copy(), process.speed, process.speed)

    def _at_goal(self, process: Process, step: Step) -> bool:
        """The carrier judges the goal of the whole mode, and keeps its clock."""
        x, v = self.link.read(step.operation, process.program.robot)
        bundle = self._bundle(step.operation)
        if not bundle.at_goal(x)[0] or np.abs(v).max() >= STILL:
            process.clock = 0.0
            return False
        done = process.clock >= step.operation.dwell - 1e-9
        process.clock += process.period * self.timestep
        return done

    def _finish(self, process: Process, step: Step) -> None:
        """Write one's own cell: a new label, one more operation finished."""
        cell = self.cells[process.program.robot]
        cell.label = step.operation.after[step.slot]
        cell.turn += 1

    def _followed(self, process: Process, step: Step) -> bool:
        """Whether all other robots have left the operation."""
        unit = self._unit(process)
        return all(
            self.cells[other].turn > self._turn(other, step.operation, unit)
            for other, _ in step.until
        )

    def _advance(self, process: Process) -> None:
        process.stage = "wait"
        process.turns += 1
        process.position = (process.position + 1) % len(process.program.steps)

    def _unit(self, process: Process) -> int:
        """Which time round its loop a robot is: the number of the unit it works on."""
        return process.turns // len(process.program.steps)

    def _turn(self, robot: int, operation: Operation, unit: int) -> int:
        """How many operations a robot has finished when it comes to this one for that unit."""
        length = len(self.factory.robots[robot].operations)
        return unit * length + self.place_in_gear[robot, operation.index]

    def _bundle(self, operation: Operation) -> Bundle:
        found = self.bundles.get(operation.index)
        if found is None:
            limits = self.limits.of(self.factory.axes[operation.index])
            found = self.bundles[operation.index] = Bundle.of(
                [self.modes[operation.index]], [limits]
            )
        return found

    # --- the record ----------------------------------------------------------------------------

    def _entered(self, operation: Operation, unit: int) -> None:
        if (operation.index, unit) in self.record.started:
            return
        self.record.started.add((operation.index, unit))
        self.record.under_way.append(operation.index)
        self.world.apply([(operation, unit)], [])
        self._log(operation.start)

    def _ended(self, operation: Operation, unit: int) -> None:
        """Parts change hands when the carrier says so."""
        self._log(operation.end)
        self.record.started.discard((operation.index, unit - 1))
        self.record.under_way.remove(operation.index)
        self.world.apply([], [(operation, unit)])

    def _log(self, event: int) -> None:
        name = self.net.transitions[event].name
        for place in self.net.net.preset[event]:
            self.marked[place] = 0
        for place in self.net.net.postset[event]:
            self.marked[place] = 1
        self.record.events.append(Event(self.world.time, name))
        self.last_event = self.world.time
        self.active.operations = tuple(self.record.under_way)
