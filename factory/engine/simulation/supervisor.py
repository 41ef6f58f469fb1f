"""The supervisor fires the net over any world (Definitions 3.3 and 3.4).

It knows nothing of physics: a `World` senses positions, moves robots along the field of the active
modes, and hands parts over when a transition fires. Python runs only for what fires; a waiting
robot costs nothing.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from itertools import compress

import numpy as np

from factory.engine.record.state import Event
from factory.engine.simulation.active import Active
from factory.engine.simulation.ahead import Ahead
from factory.engine.simulation.bundles import Bundles
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.world import World
from factory.engine.timing.demand import Word
from factory.engine.timing.distributed import Scan
from factory.floor.modes.staging import HeadStart
from factory.support.arrays import Array, Truth
from factory.theory.control.mode import STILL, Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.nets.petri import Marking
from factory.theory.nets.undone import Undone
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import TransitionId


class Supervisor:
    """Runs the gear net of a factory from a legal marking over a world.

    Args:
        factory: the factory.
        modes: the mode of each operation.
        limits: the limits of all axes.
        world: the world in which robots move.
        tick: length of a tick [s].
        start: the marking in which the run begins.
        counts: how often each transition has fired there.
        stages: what robots do while they wait, where that is not to stand; nothing of it is in
            the net.

    Attributes:
        threads: the marking (m, f_m): every firing moves robots by the redistribution functions
            and asserts that the marking stays legal.
        fired: how often each transition has fired (transitions,).
        events: the firings so far.
        ordering: the order places of the coordinated net.
        active: the active modes, with their clocks.
        enabled: whether some operation may start that could not in the last tick.
        near: whether some mode may have come to its goal in the last tick.
    """

    def __init__(
        self,
        factory: Factory,
        modes: Sequence[Mode],
        limits: Limits,
        world: World,
        tick: float,
        start: Marking,
        counts: Mapping[int, int],
        stages: Sequence[HeadStart],
    ) -> None:
        self.factory, self.world, self.tick = factory, world, tick
        self.ordering = Ordering()
        axes_of = [*factory.moves, *((stage.axis,) for stage in stages)]
        self.bundles = Bundles([*modes, *(stage.mode for stage in stages)], axes_of, limits)
        self._mark(start)
        self.fired = [
            counts.get(number, 0) for number in range(len(factory.net.threaded.transitions))
        ]
        self.events: list[Event | Undone] = []
        self.ahead, self.active = Ahead(factory, stages), Active()
        self.near = self.enabled = True
        marked = self.threads.marked
        self._activate(
            [o.index for o in factory.operations if marked[o.place]],
            self.ahead.waiting(marked, self.world.sense()[0]),
        )

    @property
    def scans(self) -> Sequence[Scan]:
        """None: no robot ticks by itself."""
        return ()

    @property
    def limits(self) -> Limits:
        """The limits of all axes."""
        return self.bundles.limits

    @property
    def word(self) -> Word:
        """Which units are made."""
        return self.world.word

    @property
    def under_way(self) -> tuple[int, ...]:
        """The operations (index) under way."""
        return self.active.operations

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.bundles.limit(limits)
        self._activate(self.active.operations, self.active.ahead)

    def step(self, ticks: int = 1) -> None:
        """Fire what is enabled as one detached set, then advance the world by a tick, or by up to
        `ticks` if nothing can fire in between."""
        self.word.now = self.world.time
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
        if self._prepared() or self.word.is_late:
            ticks = 1
        if self.word.is_late:
            self.enabled, self.world.hooks.busy = True, self.world.time
        self._advance(ticks)
        if self.ordering.held:
            self.enabled |= self.ordering.goes_on(self._sensed())

    def _advance(self, ticks: int) -> None:
        """Advance the world by up to `ticks`, but not past the end of a running clock."""
        world, active, before = self.world, self.active, self.world.time
        ticks = max(1, min(ticks, active.ticks_left(self.tick)))
        near = world.step(active.bundle, active.axes, ticks, self.ordering.held)
        active.go_on(world.time - before)
        self.near = near or active.ticks_left(self.tick) <= 0

    def undo(
        self, undone: Undone, fired: Sequence[int], marking: Marking, free: Container[int]
    ) -> None:
        """Continue from a marking with firing counts `fired`: operations no longer marked are over,
        as are stages of axes in `free`."""
        active = self.active
        self.fired[:] = fired
        self.ordering.keep_passes()
        self.events.append(undone)
        self._mark(marking)
        self.enabled = True
        self._activate([n for n in active.operations if self.marked[n]], active.ahead)
        self.recall(free)

    def _mark(self, marking: Marking) -> None:
        net, starts = self.factory.net, [operation.start for operation in self.factory.operations]
        self.threads = net.threads(marking, starts)

    def recall(self, axes: Container[int]) -> None:
        """End the stages of these axes wherever they are."""
        ahead, axes_of = self.active.ahead, self.bundles.axes_of
        kept = [n for n in ahead if not any(axis in axes for axis in axes_of[n])]
        self._activate(self.active.operations, kept)

    def send(self, stages: Iterable[int]) -> None:
        """Start stages, by number."""
        self._activate(self.active.operations, (*self.active.ahead, *stages))

    def coast(self, ticks: int = 1) -> None:
        """Advance the world in the active modes for some ticks, firing nothing."""
        self.world.step(self.active.bundle, self.active.axes, ticks)

    @property
    def marked(self) -> bytearray:
        """1 for each place that is marked, 0 for the others."""
        return self.threads.marked

    def awaited(self) -> list[Operation]:
        """The operations all of whose robots wait for them."""
        possible = map(TransitionId, sorted(self.threads.possible))
        return [self.factory.operation_of(event) for event in possible]

    def _startable(self) -> list[int]:
        """Operations X with X_s enabled: waits marked (their goals are everything), the robots in
        the domain of X's mode, and the world prepared."""
        possible = self._prepared()
        if not possible:
            return []
        bundle, axes = self.bundles.of(possible)
        inside = bundle.in_domain(self.world.sense()[0][axes])
        self.enabled = self._is_restless or not inside.all()
        return [number for number, within in zip(possible, inside.tolist(), strict=True) if within]

    def _prepared(self) -> tuple[int, ...]:
        """Awaited operations for which the world is prepared. Not evaluated again while the answer
        was none and nothing has changed."""
        if not (self.enabled or self.world.supplied):
            return ()
        ready = self._ready()
        while skipped := [o for o in ready if self._is_skipped(o)]:
            self._skip(skipped)
            ready = self._ready()
        self.enabled, self.world.supplied = bool(ready) or self._is_restless, False
        return tuple(o.index for o in ready)

    def _ready(self) -> list[Operation]:
        """Awaited operations that may start, including those of skipped units."""
        self.ordering.ask_anew()
        prepared, fired, unit = self.world.prepared, self.fired, self.factory.unit
        hold_up, lacking, makes = self.ordering.hold_up, self.world.lacking, self.word.makes
        return [
            o
            for o in self.awaited()
            if o.label not in lacking
            and (made := makes(unit(o, fired[o.start]))) is not None
            and not hold_up(o.start, fired.__getitem__, self._sensed)
            and (made or self._rests(o))
            and prepared(o, unit(o, fired[o.start]))
        ]

    @property
    def _is_restless(self) -> bool:
        """Whether an operation is to be skipped and its robots do not rest yet."""
        return bool(self.word.demand) and any(map(self._is_skipped, self.awaited()))

    def _is_skipped(self, operation: Operation) -> bool:
        """Whether the next unit of an operation is known not to be made."""
        unit = self.factory.unit(operation, self.fired[operation.start])
        return unit < self.word.fixed and not self.word.is_made(unit)

    def _rests(self, operation: Operation) -> bool:
        """Whether the robots of an operation stand and are in no stage of another."""
        going = self.ahead.going(self.active.ahead).values()
        if any(stage.robot in operation.robots for stage in going):
            return False
        axes = [*self.factory.moves[operation.index]]
        return bool((np.abs(self.world.sense()[1][axes]) < STILL).all())

    def _skip(self, operations: Sequence[Operation]) -> None:
        """Start and end operations of units that are not made. Nothing moves, except robots that
        are not yet where they wait next."""
        for event in (event for o in operations for event in (o.start, o.end)):
            self._count((event,))
        over, ahead = {o.index for o in operations}, self.active.ahead
        waiting = self.ahead.waiting(self.marked, self._sensed())
        begun = [n for n in waiting if n not in ahead and self.ahead.follows[n] in over]
        if begun:
            self._activate(self.active.operations, (*ahead, *begun))

    def _sensed(self) -> Array:
        """Positions of all axes [m]."""
        return self.world.sense()[0]

    def _finished(self) -> list[int]:
        """Operations X with X_e enabled: robots in the goal ball, at rest, and the clock expired;
        and stages at their goals."""
        active = self.active
        if active.bundle is None or not self.near:
            return []
        x, v = self.world.sense()
        there = active.bundle.at_goal(x[active.axes])
        still = np.logical_and.reduceat(np.abs(v[active.axes]) < STILL, active.bundle.starts)
        if active.bundle.dwells:
            there = self._run_out(active.bundle, there, still)
        numbers = active.numbers
        over = [numbers[number] for number in (there & still).nonzero()[0].tolist()]
        return [n for n in over if self._passes(n)] if self.world.hooks.judges else over

    def _run_out(self, bundle: Bundle, there: Truth, still: Truth) -> Truth:
        """Whether each mode is in its goal: it is `there` and its clock has run out. The clocks of
        those that are `still` run with time from now on; not where sensors err or something acts
        on bodies, since a robot may leave then, or seem to."""
        active = self.active
        asked = there if bundle.clocked is None else there & ~bundle.clocked
        clocks = self.tick * asked.astype(float)
        begun = asked & (bundle.dwell > 0.0)
        if active.clocks is not None:
            clocks += active.clocks
            begun &= active.clocks == 0.0
        if begun.any():
            self.world.arrive(self._operations(begun))
        active.clocks, finished = clocks, bundle.finished(there, clocks)
        hooks = self.world.hooks
        stays = there & still & ~finished & (not (hooks.sensors or hooks.each_step))
        active.clocked = frozenset(compress(active.numbers, stays.tolist()))
        active.bundle, _ = self.bundles.of(active.numbers, active.clocked)
        return finished

    def _operations(self, chosen: Truth) -> list[Operation]:
        """The operations among some active modes (modes,)."""
        operations = self.factory.operations
        numbers = compress(self.active.numbers, chosen.tolist())
        return [operations[number] for number in numbers if number < len(operations)]

    def _passes(self, number: int) -> bool:
        """Whether a mode at its goal may end; a stage always may."""
        if number >= len(self.factory.operations):
            return True
        operation = self.factory.operations[number]
        unit = self.factory.unit(operation, self.fired[operation.end])
        return self.world.hooks.pass_on(operation, unit)

    def _fire(self, started: list[int], ended: list[int]) -> None:
        operations, fired = self.factory.operations, self.fired
        unit = self.factory.unit
        starts = [(o, unit(o, fired[o.start])) for o in (operations[n] for n in started)]
        ends = [(o, unit(o, fired[o.end])) for o in (operations[n] for n in ended)]
        self._count((*(o.start for o, _ in starts), *(o.end for o, _ in ends)))
        self.world.apply(starts, ends)

    def _count(self, events: tuple[int, ...]) -> None:
        """Fire transitions as one detached set."""
        self.enabled |= self.threads.fire(events)
        self.enabled |= not self.ordering.lacking.isdisjoint(events)
        transitions, now = self.factory.net.threaded.transitions, self.world.time
        for event in events:
            self.fired[event] += 1
            self.events.append(Event(now, transitions[event].name))

    def _going_ahead(self, started: list[int], ended: list[int], over: list[int]) -> list[int]:
        """The stages active from now on: those under way that are neither at their goal nor
        overtaken by their operation, and those of robots that begin to wait."""
        overtaken = {number for o in started for number in self.ahead.of[o]}
        gone = overtaken.union(over)
        going = [number for number in self.active.ahead if number not in gone]
        then = (self.ahead.then[number] for number in over if number in self.ahead.then)
        going += [number for number in then if number not in overtaken]
        return going + [number for o in ended for number in self.ahead.after[o]]

    def _activate(self, operations: Iterable[int], ahead: Iterable[int]) -> None:
        """Rebuild the bundle of active modes; clocks of continuing modes are kept."""
        active = self.active
        operations, ahead = tuple(operations), tuple(ahead)
        numbers, kept = (*operations, *ahead), None
        if active.clocks is not None and np.count_nonzero(active.clocks):
            clocks = dict(zip(active.numbers, active.clocks, strict=True))
            kept = np.array([clocks.get(o, 0.0) for o in numbers])
        clocked = active.clocked.intersection(numbers)
        bundle, axes = self.bundles.of(numbers, clocked)
        self.active = Active(operations, ahead, bundle if numbers else None, axes, kept, clocked)
