"""The paper's own way of running (section 6): every robot executes its program by itself.

Robots share a cell each, for the label they carry, and the continuous state of the mode they are
in; nothing else, and they read it by their `Link` alone. Each has its own control rate and phase.
Reads of labels alone would race: a tool's label never changes, and a slow robot may see a label of
the next unit. So a cell counts, beside its label, the operations its robot has entered and
finished, and a condition asks for a count; the carrier alone ends an operation, and goes on when
all others have followed. The reasons are in docs/decisions/distributed.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from factory.engine.record.state import Event
from factory.engine.simulation.bundles import Bundles
from factory.engine.simulation.cells import Cells, Link
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.world import Job, World
from factory.engine.timing.distributed import Scan, drawn_scans
from factory.floor.modes.staging import HeadStart
from factory.support.arrays import Array, Index
from factory.theory.control.governor import govern
from factory.theory.control.mode import ROUNDING, STILL, Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.plant.programs import Program, ProgramStep


@dataclass(slots=True)
class Process:
    """A robot that executes its program: its `link` to others; its current step and phase, `wait`,
    `run` or `leave`; `reference` and `speed` of its `axes`, carriage first; whether it `goes_ahead`
    while it waits."""

    program: Program
    link: Link
    period: int
    phase: int
    axes: Index
    reference: Array
    speed: Array
    stage: str = "wait"
    clock: float = 0.0
    turns: int = 0
    goes_ahead: bool = False

    @property
    def step(self) -> ProgramStep:
        """The current step."""
        return self.program.steps[self.turns % len(self.program.steps)]

    @property
    def unit(self) -> int:
        """The number of the unit that a robot works on, or of the period of units: how often it has
        gone round its loop."""
        return self.turns // len(self.program.steps)

    def go_on(self) -> None:
        """Wait for the operation of the next step."""
        self.stage = "wait"
        self.turns += 1
        self.link.at(self.step.operation, self.unit)


class Record:
    """The record of a distributed run, in the terms of the net: X_s when the first robot enters an
    operation, X_e when its carrier ends it; no program reads it. `marked`: 1 for each place that
    is."""

    def __init__(self, factory: Factory) -> None:
        self._net, self.events = factory.net.threaded, list[Event]()
        self.marked = bytearray(len(self._net.places))
        for place in factory.net.initial_marking:
            self.marked[place] = 1
        self._under_way: list[int] = []

    @property
    def under_way(self) -> tuple[int, ...]:
        """The operations (index) under way."""
        return tuple(self._under_way)

    def start(self, operation: Operation, time: float) -> None:
        """The first robot enters an operation."""
        self._under_way.append(operation.index)
        self._fire(operation.start, time)

    def end(self, operation: Operation, time: float) -> None:
        """The carrier ends an operation."""
        self._fire(operation.end, time)
        self._under_way.remove(operation.index)

    def _fire(self, transition: int, time: float) -> None:
        net = self._net.net
        for place in net.preset[transition]:
            self.marked[place] = 0
        for place in net.postset[transition]:
            self.marked[place] = 1
        self.events.append(Event(time, self._net.transitions[transition].name))


class DistributedSupervisor:
    """Stands in for a supervisor, and decides nothing: it lets the robots' processes tick, each at
    its own rate and phase, in timesteps [s] of the world. Its step is `ticks` of these."""

    def __init__(
        self,
        factory: Factory,
        modes: Sequence[Mode],
        limits: Limits,
        world: World,
        timestep: float,
        ticks: int,
        seed: int,
        stages: Sequence[HeadStart],
    ) -> None:
        self.factory, self.world, self.timestep, self.ticks = factory, world, timestep, ticks
        count = len(factory.operations)
        self.stages: dict[tuple[int, int], list[tuple[int, HeadStart]]] = {}
        for number, stage in enumerate(stages, start=count):
            self.stages.setdefault((stage.robot, stage.operation), []).append((number, stage))
        axes_of = [*factory.moves, *((stage.axis,) for stage in stages)]
        self.bundles = Bundles([*modes, *(stage.mode for stage in stages)], axes_of, limits)
        self.random = np.random.default_rng([seed, 7])
        programs = [Program.of(factory, robot.index) for robot in factory.robots]
        self.cells = Cells(factory, [program.steps[0].label for program in programs])
        self.processes = self._processes(programs)
        self.record, self.ordering = Record(factory), Ordering()
        self.count = 0

    def _processes(self, programs: Sequence[Program]) -> list[Process]:
        scans = drawn_scans(self.random, len(programs), self.timestep)
        x = self.world.sense()[0]
        processes = []
        for p, scan in zip(programs, scans, strict=True):
            axes = np.array(self.factory.axes_of(p.robot))
            link, still = (
                Link(p.robot, self.cells, self.world, self.factory.moves),
                np.zeros(len(axes)),
            )
            link.at(p.steps[0].operation, 0)
            processes.append(
                Process(p, link, scan.period, scan.phase, axes, np.array(x[axes]), still)
            )
        return processes

    @property
    def scans(self) -> list[Scan]:
        """When each robot ticks."""
        return [Scan(process.period, process.phase) for process in self.processes]

    @property
    def events(self) -> list[Event]:
        """The record so far."""
        return self.record.events

    @property
    def under_way(self) -> tuple[int, ...]:
        """The operations (index) under way."""
        return self.record.under_way

    @property
    def marked(self) -> bytearray:
        """1 for each place that the record marks, 0 for the others."""
        return self.record.marked

    def awaited(self) -> list[Operation]:
        """None: no robot sees whether all robots of an operation wait for it."""
        return []

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.bundles.limit(limits)

    def step(self, ticks: int = 1) -> None:
        """As many timesteps of the world as a supervisor's tick has; robots tick in between."""
        for _ in range(self.ticks):
            due = [p for p in self.processes if (self.count - p.phase) % p.period == 0]
            for index in self.random.permutation(len(due)):
                self._tick(due[index])
            self.world.advance(1)
            self.count += 1
        self.world.settle()

    def coast(self, ticks: int = 1) -> None:
        """Advance the world by one step in which no robot ticks: each stops where its last setpoint
        leads."""
        self.world.advance(self.ticks)
        self.world.settle()

    # --- one robot's tick --------------------------------------------------------------------

    def _tick(self, process: Process) -> None:
        step = process.step
        if process.stage == "wait":
            if self._may_enter(process, step):
                process.stage, process.clock, process.goes_ahead = "run", 0.0, False
                self._enter(process, step.operation)
            else:
                self._go_ahead(process, step)
        if process.stage == "run":
            self._run(process, step)
        elif process.stage == "leave" and self._followed(process, step):
            process.go_on()

    def _may_enter(self, process: Process, step: ProgramStep) -> bool:
        """Every other robot of the operation has finished all that it does before this, and shows
        what it must bring; its carrier has begun, or it is the carrier, for which the world is
        prepared; all are in the domain."""
        operation, link = step.operation, process.link
        if not all(link.waits(robot, label) for robot, label in step.until):
            return False
        if link.has_started():
            return True
        if not step.is_carrier or not self.world.prepared(*self._job(process, operation)):
            return False
        if self.ordering.hold_up(operation.start, self.cells.fired, lambda: self.world.sense()[0]):
            return False  # an order place is a cell that two machines share
        return bool(self._bundle(operation).in_domain(link.state()[0])[0])

    def _run(self, process: Process, step: ProgramStep) -> None:
        operation, link = step.operation, process.link
        if not step.is_carrier:
            if link.has_left(operation.carrier):
                self._stop(process)
                link.finish(operation.after[step.slot])
                process.go_on()
                return
        elif self._at_goal(process, step):
            self._stop(process)
            self.record.end(operation, self.world.time)
            self.world.apply([], [self._job(process, operation)])
            link.finish(operation.after[step.slot])
            process.stage = "leave"
            return
        self._move(process, operation)

    def _move(self, process: Process, operation: Operation) -> None:
        """ẋ_i = π_i ∘ F_p, by the robot's own limits at its own rate; its lift's too."""
        dt = process.period * self.timestep
        x = process.link.state()[0]
        slots, mine = np.nonzero(np.equal.outer(self.factory.moves[operation.index], process.axes))
        x[slots] = process.reference[mine] + process.speed[mine] * dt / 2
        self._drive(process, mine, self._bundle(operation).field(x, dt)[slots])

    def _go_ahead(self, process: Process, step: ProgramStep) -> None:
        """While it waits, a robot may go where it is needed next; it reads no other robot's state
        for that."""
        for number, stage in self.stages.get((process.program.robot, step.operation.index), ()):
            dt, mine = process.period * self.timestep, np.flatnonzero(process.axes == stage.axis)
            at, speed = process.reference[mine], process.speed[mine]
            there = abs(at[0] - stage.goal) < stage.mode.eps or stage.is_past(float(at[0]))
            if not there or abs(speed[0]) >= ROUNDING:
                process.goes_ahead = True
                bundle, _ = self.bundles.of((number,))
                self._drive(process, mine, bundle.field(at + speed * dt / 2, dt))
                return
            if process.goes_ahead:  # it stands while another axis of the robot goes
                still = np.zeros(len(mine))
                self.world.move(process.axes[mine], at.copy(), still, still)
        if process.goes_ahead:
            self._stop(process)
            process.goes_ahead = False

    def _drive(self, process: Process, mine: Index, wanted: Array) -> None:
        """One tick of a robot's own axes at the `wanted` speeds [m/s], or governed towards them."""
        axes, at, speed = process.axes[mine], process.reference[mine], process.speed[mine]
        dt = process.period * self.timestep
        if self.world.instant:
            self.world.move(axes, at, wanted, np.zeros_like(wanted))
            process.reference[mine] += wanted * dt
            return
        x1, v1, a = govern(at, speed, wanted, self.bundles.limits.acceleration[axes], dt)
        self.world.move(axes, at, speed, a)
        process.reference[mine], process.speed[mine] = x1, v1

    def _stop(self, process: Process) -> None:
        """Stand where the reference is."""
        process.speed[:] = 0.0
        self.world.move(process.axes, process.reference.copy(), process.speed, process.speed)

    def _at_goal(self, process: Process, step: ProgramStep) -> bool:
        """The carrier judges the goal of the whole mode, and keeps its clock."""
        x, v = process.link.state()
        bundle = self._bundle(step.operation)
        if not bundle.at_goal(x)[0] or np.abs(v).max() >= STILL:
            process.clock = 0.0
            return False
        if step.operation.dwell and not process.clock:
            self.world.arrive([step.operation])
        done = process.clock >= step.operation.dwell - 1e-9
        process.clock += process.period * self.timestep
        return done

    def _followed(self, process: Process, step: ProgramStep) -> bool:
        """Whether all other robots have left the operation."""
        return all(process.link.has_left(other) for other, _ in step.until)

    def _job(self, process: Process, operation: Operation) -> Job:
        """An operation of a process, with the unit that it is for."""
        return operation, self.factory.unit(operation, process.unit)

    def _bundle(self, operation: Operation) -> Bundle:
        return self.bundles.of((operation.index,))[0]

    def _enter(self, process: Process, operation: Operation) -> None:
        """The first robot that enters starts the operation."""
        if not process.link.has_started():
            self.world.apply([self._job(process, operation)], [])
            self.record.start(operation, self.world.time)
        process.link.enter()
