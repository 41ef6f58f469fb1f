"""The supervisor fires the net over any world (Definitions 3.3 and 3.4).

It knows nothing of physics: a `World` senses positions, moves robots along the field of the active
modes, and hands parts over when a transition fires. Python runs only for what fires; a waiting
robot costs nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from factory.control.mode import STILL, Array, Index, Limits, Mode
from factory.control.navigation import Bundle
from factory.control.obstacles import ranges
from factory.control.staging import Stage
from factory.factory import Factory, Operation
from factory.nets.petri import Marking
from factory.nets.threads import Threads
from factory.trace import Event


class World(Protocol):
    """Where a factory runs: the ideal one or MuJoCo.

    `supplied`: whether an operation may have become prepared since somebody asked, who then sets it
    back."""

    time: float
    supplied: bool

    def sense(self) -> tuple[Array, Array]:
        """Positions x [m] and speeds [m/s] of all axes: in arc length of all carriages, then the
        heights of all lifts."""

    def prepared(self, operation: Operation, unit: int) -> bool:
        """Whether the world is in the domain of an operation's mode as far as parts go: a feeder
        has a part to give, the outfeed is free."""

    def apply(
        self, started: Sequence[tuple[Operation, int]], ended: Sequence[tuple[Operation, int]]
    ) -> None:
        """Operations that start or end now, each with the number of the unit it works on."""

    def step(self, bundle: Bundle | None, axes: Index, ticks: int = 1) -> bool:
        """A tick, or some as long as nothing can come of them that asks for the supervisor: the
        axes of the active modes follow their field, all others stand. Whether any mode may have
        come to its goal."""

    def delivered(self) -> int:
        """Products that have left the factory."""


KEPT = 500
"""So many bundles are kept."""


@dataclass(slots=True)
class _Active:
    """The modes under way: of operations, then of robots that go ahead to the next one while they
    wait, both by number; their bundle, the axes of each slot, and the clocks, if any has run."""

    operations: tuple[int, ...]
    ahead: tuple[int, ...]
    bundle: Bundle | None
    axes: Index
    clocks: Array | None = None


class Supervisor:
    """Runs the gear net of a factory from a legal marking over a world.

    `threads` is (m, f_m): every firing moves robots by the redistribution functions and asserts
    that the marking stays legal. `stages`: what robots do while they wait, where that is not to
    stand; nothing of it is in the net.
    """

    def __init__(
        self,
        factory: Factory,
        modes: Sequence[Mode],
        limits: Limits,
        world: World,
        tick: float,
        start: Marking | None = None,
        counts: dict[int, int] | None = None,
        stages: Sequence[Stage] = (),
    ) -> None:
        self.factory, self.world, self.tick = factory, world, tick
        self.modes = [*modes, *(stage.mode for stage in stages)]
        self.net = factory.net.threaded
        self.names = [transition.name for transition in self.net.transitions]
        self.axes_of = [*factory.axes, *((stage.robot,) for stage in stages)]
        self.axes = np.array([axis for axes in self.axes_of for axis in axes], np.intp)
        self.active = _Active((), (), None, np.empty(0, np.intp))
        self.near = self.enabled = True
        self.limit(limits)
        marking = factory.net.initial_marking if start is None else start
        starts = [operation.start for operation in factory.operations]
        self.threads = Threads(self.net, factory.net.marking_of(marking), starts)
        self.marked = self.threads.marked
        self.fired = [0] * len(self.net.transitions)
        for transition, count in (counts or {}).items():
            self.fired[transition] = count
        self.events: list[Event] = []
        self.last_event = world.time
        waits = self._stages(stages)
        self._activate(
            [o.index for o in factory.operations if self.marked[o.place]],
            [number for number, place in waits.items() if self.marked[place]],
        )

    def _stages(self, stages: Sequence[Stage]) -> dict[int, int]:
        """Number the stages after the operations, by the one that each is of and by the one that it
        follows; gives the place in which each is."""
        count = len(self.factory.operations)
        self.stages_of: list[list[int]] = [[] for _ in range(count)]
        self.stages_after: list[list[int]] = [[] for _ in range(count)]
        waits = {}
        for number, stage in enumerate(stages, start=count):
            gear = self.factory.robots[stage.robot].operations
            step = gear.index(stage.operation)
            self.stages_of[stage.operation].append(number)
            self.stages_after[gear[step - 1]].append(number)
            waits[number] = self.factory.net.gears[stage.robot].places[2 * step]
        return waits

    def limit(self, limits: Limits) -> None:
        """From now on axes have these limits."""
        self.limits = limits
        self.all = Bundle.of(self.modes, [limits.of(axes) for axes in self.axes_of])
        self.bundles: dict[tuple[int, ...], tuple[Bundle, Index]] = {}
        self._activate(self.active.operations, self.active.ahead)

    def step(self, ticks: int = 1) -> None:
        """Fire what is enabled as one detached set, then let the world go on for a tick, or for as
        many as `ticks` where nothing can fire in between."""
        started = self._startable()
        over = self._finished()
        if started or over:
            count = len(self.factory.operations)
            ended = [number for number in over if number < count]
            if started or ended:
                self._fire(started, ended)
            gone = {*ended}
            self._activate(
                [o for o in self.active.operations if o not in gone] + started,
                self._going_ahead(started, ended, over),
            )
        if self._prepared():
            ticks = 1
        self.near = self.world.step(self.active.bundle, self.active.axes, ticks)

    def marking(self) -> tuple[str, ...]:
        """The names of the marked places."""
        return tuple(p.name for p, m in zip(self.net.places, self.marked, strict=True) if m)

    def awaited(self) -> list[Operation]:
        """The operations all of whose robots wait for them."""
        return [self.factory.operations[event // 2] for event in sorted(self.threads.possible)]

    def _startable(self) -> list[int]:
        """Operations X with X_s enabled: waits marked (their goals are everything), the robots in
        the domain of X's mode, and the world prepared."""
        possible = self._prepared()
        if not possible:
            return []
        bundle, axes = self._bundle(possible)
        inside = bundle.in_domain(self.world.sense()[0][axes])
        self.enabled = not inside.all()
        return [number for number, within in zip(possible, inside.tolist(), strict=True) if within]

    def _prepared(self) -> tuple[int, ...]:
        """The operations that are awaited and that the world is prepared for. Nobody is asked again
        where there was none and nothing has changed."""
        if not (self.enabled or self.world.supplied):
            return ()
        prepared, fired = self.world.prepared, self.fired
        found = tuple(o.index for o in self.awaited() if prepared(o, fired[o.start]))
        self.enabled, self.world.supplied = bool(found), False
        return found

    def _finished(self) -> list[int]:
        """Operations X with X_e enabled: robots in the goal ball, at rest, and the clock run out;
        and robots that have come to where they went ahead."""
        active = self.active
        if active.bundle is None or not self.near:
            return []
        x, v = self.world.sense()
        there = active.bundle.at_goal(x[active.axes])
        if not np.count_nonzero(there):
            return []
        if active.bundle.dwells:
            clocks = self.tick * there.astype(float)
            if active.clocks is not None:
                clocks += active.clocks
            active.clocks, there = clocks, active.bundle.finished(there, clocks)
            if not np.count_nonzero(there):
                return []
        still = np.logical_and.reduceat(np.abs(v[active.axes]) < STILL, active.bundle.starts)
        numbers = (*active.operations, *active.ahead)
        return [numbers[number] for number in (there & still).nonzero()[0].tolist()]

    def _fire(self, started: list[int], ended: list[int]) -> None:
        operations, now = self.factory.operations, self.world.time
        starts = [(operations[o], self.fired[operations[o].start]) for o in started]
        ends = [(operations[o], self.fired[operations[o].end]) for o in ended]
        events = (*(o.start for o, _ in starts), *(o.end for o, _ in ends))
        self.enabled |= self.threads.fire(events)
        for event in events:
            self.fired[event] += 1
            self.events.append(Event(now, self.names[event]))
        self.world.apply(starts, ends)
        self.last_event = now

    def _going_ahead(self, started: list[int], ended: list[int], over: list[int]) -> list[int]:
        """The stages under way from now on: those that were, and have neither come to their goal
        nor been overtaken by their operation, and those of robots that begin to wait."""
        gone = {*over, *(number for o in started for number in self.stages_of[o])}
        going = [number for number in self.active.ahead if number not in gone]
        return going + [number for o in ended for number in self.stages_after[o]]

    def _activate(self, operations: Iterable[int], ahead: Iterable[int]) -> None:
        """Rebuild the bundle of active modes; clocks of those that go on are kept."""
        active = self.active
        operations, ahead = tuple(operations), tuple(ahead)
        numbers = (*operations, *ahead)
        bundle, axes = self._bundle(numbers)
        kept = None
        if active.clocks is not None and np.count_nonzero(active.clocks):
            clocks = dict(zip((*active.operations, *active.ahead), active.clocks, strict=True))
            kept = np.array([clocks.get(o, 0.0) for o in numbers])
        self.active = _Active(operations, ahead, bundle if numbers else None, axes, kept)

    def _bundle(self, numbers: tuple[int, ...]) -> tuple[Bundle, Index]:
        """The modes of some operations, and their axes. In steady production the same come together
        again and again."""
        if numbers not in self.bundles:
            if len(self.bundles) == KEPT:
                self.bundles.clear()
            chosen = np.array(numbers, np.intp)
            robots = ranges(self.all.starts[chosen], self.all.sizes[chosen])
            self.bundles[numbers] = self.all.select(numbers), self.axes[robots]
        return self.bundles[numbers]
