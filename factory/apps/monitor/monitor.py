"""The monitor: it observes a factory tick by tick, and compares the observations with the net."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, takewhile
from time import perf_counter

import numpy as np

from factory.api import Factory, MonitorSubject, Observation, Operation, Report
from factory.apps.monitor.agreement import Recorded, disagreements
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.explanation import SeenFirings
from factory.apps.monitor.grips import Grips, misplaced
from factory.apps.monitor.motion import AxisMotion, Lags, Straying
from factory.apps.monitor.transfers import Transfers
from factory.engine.record.findings import Violation
from factory.support.collector import collector_paused

MOST = 100
"""Number of violations that are kept, the first ones: a fault often causes others."""

KEPT = 64
"""Number of observations that are judged at a time."""

NOBODY = (np.empty(0, np.intp),) * 3
"""No robots leave, arrive or pass."""

TICKS = 1.5
"""Tolerance of observed times, in ticks."""


@dataclass(slots=True)
class _Clock:
    """Times [s] of the start of the monitor, of the present and the previous observation, and of
    the last change; and whether the run is stalled."""

    begun: float
    now: float
    before: float
    changed: float
    stalled: bool = False


class Monitor:
    """Reconstructs the mode of each robot and the holder of each part from observations: `first`,
    before the run begins, and then one after every tick.

    `turn[r]`: number of operations that robot r has finished since m_0, hence its place in its
    gear; `judged[o]`: number of judged ends of operation o. `time_s`: time taken by the monitor
    [s].
    """

    def __init__(self, subject: MonitorSubject, anatomy: Anatomy, first: Observation) -> None:
        begin = perf_counter()
        self.subject, self.anatomy = subject, anatomy
        robots, operations, counts = self.factory.robots, self.factory.operations, subject.counts
        self.violations: list[Violation] = []
        self.judged = [counts.get(o.end, 0) for o in operations]
        self.turn = [sum(self.judged[o] for o in r.operations) for r in robots]
        self.clock = _Clock(first.time, first.time, first.time, first.time)
        radius = np.array([max(subject.radii[o] for o in r.operations) for r in robots])
        self.motion = AxisMotion(anatomy, subject.settings, radius, first)
        self.lags, self.straying = Lags(anatomy, subject.settings), Straying(anatomy)
        self.grips = Grips(anatomy, float(radius.max()))
        self.transfers = Transfers(subject, anatomy, self._blame)
        self.transfers.begin(self.grips.switched(first))
        self.explanation = SeenFirings(subject, TICKS * subject.settings.tick)
        self._look_at_frames()
        self._look_at_parts(first)
        self.time_s = perf_counter() - begin

    @property
    def factory(self) -> Factory:
        """The factory under watch."""
        return self.subject.factory

    # --- a tick --------------------------------------------------------------------------------

    def see(self, seen: Observation, thorough: bool = True) -> None:
        """Take in an observation after a tick, or as operations end; of one after a tick only the
        grips, unless `thorough`."""
        clock = self.clock
        clock.before, clock.now = clock.now, seen.time
        left, arrived, passed = NOBODY
        if seen.at_end or thorough:
            left, arrived, passed = self.motion.look(seen)
        switches = self.grips.switched(seen)
        if switches:
            clock.changed = clock.now
            for operation, unit in self.transfers.judge(switches):
                self._ended(operation, unit)
        for robot in passed.tolist():
            self._passed(robot)
        for robot in left.tolist():
            if self.motion.leaves(robot):
                self._leaves(robot)
        if len(arrived):
            clock.changed = clock.now
        if seen.at_end and self.grips.take(seen, switches) >= KEPT:
            self._look_at_transfers()
        if seen.at_end or not thorough:
            return
        self._look_at_parts(seen)
        for actuator, since in self.lags.stuck(seen):
            self._stuck(actuator, since, seen)
        for robot, apart in self.straying.astray(seen):
            words = f"its joints are {apart:.3f} m or rad from its way"
            self._blame("Astray", robot, self._label(robot), words)
        late = clock.now - self.subject.patience
        if clock.changed < late and not clock.stalled and not self._waits(late):
            self._stalled()

    def _waits(self, since: float) -> bool:
        """Whether all is made that was ordered by a time [s]."""
        made = sum(self.transfers.ended[o.index] for o in self.factory.dropoffs)
        return self.subject.word is not None and self.subject.word.are_made(made, since)

    @collector_paused()
    def report(self, recorded: Recorded | None = None) -> Report:
        """The verdict on the observations so far and, without violations, on the agreement of a
        record with them."""
        begin = perf_counter()
        self._look_at_transfers()
        seen, inferred, unexplained = self.explanation.solve(self.clock.begun, self.clock.now)
        violations = sorted([*self.violations, *unexplained], key=lambda v: v.t)[:MOST]
        if recorded is not None and not violations:
            disagreeing = disagreements(self.subject, (*seen, *inferred), recorded)
            violations = [*islice(disagreeing, MOST)]
        self.time_s += perf_counter() - begin
        return Report(tuple(seen), tuple(inferred), tuple(violations), self.time_s)

    def _look_at_frames(self) -> None:
        """Blame welds that hold a part out of its place in the product."""
        places = {part: np.array(place) for part, place in self.subject.places.items()}
        for weld in misplaced(self.anatomy, self.subject, places):
            holder, part = self.anatomy.holder[weld], self.anatomy.part[weld]
            words = f"the weld of {part} holds it out of its place in the product"
            self._blame("Frame", holder[1] if holder else -1, part, words)

    def _look_at_parts(self, seen: Observation) -> None:
        """Blame parts that have left the place given by their weld."""
        for copy, weld, gap in self.grips.dropped(seen):
            holder, name = self.anatomy.holder[weld], self.anatomy.copies[copy]
            words = f"{name} is {1e3 * gap:.1f} mm from the place given by its weld, or turned"
            self._blame("Dropped", holder[1] if holder else -1, self.anatomy.label[copy], words)

    def _look_at_transfers(self) -> None:
        """Blame holders that took over parts which were not in their place."""
        for t, copy, weld, gap in self.grips.missed():
            holder, name = self.anatomy.holder[weld], self.anatomy.copies[copy]
            words = f"it takes over {name}, which is {1e3 * gap:.2f} mm off, or turned"
            self._blame("Missed", holder[1] if holder else -1, self.anatomy.label[copy], words, t)

    # --- observations --------------------------------------------------------------------------

    def _ended(self, operation: Operation, unit: int) -> None:
        """The parts of an operation have changed hands: X_e."""
        robots, now = self.factory.robots, self.clock.now
        before = now if self.motion.now.at_end else self.clock.before
        carrier = robots[operation.carrier].name
        self.explanation.saw(operation.end, unit, before, now, before, carrier)
        gears = {r: robots[r].operations for r in operation.robots}
        last = {r: unit * len(gear) + gear.index(operation.index) for r, gear in gears.items()}
        for robot, turn in last.items():
            self._over(robot, turn, now)
        self._judge(operation, unit, now)
        for robot, turn in last.items():
            self.turn[robot] = max(self.turn[robot], turn + 1)
            self.motion.stand(robot, self.subject.goal(operation, robot))

    def _leaves(self, robot: int) -> None:
        """A robot leaves its place: the next operation with another goal has started, unless the
        robot may go ahead of it, and those before are over."""
        spot, ball = float(self.motion.spot[robot]), float(self.motion.ball[robot])
        goals = self.subject.gear_goals[robot]
        coming = islice(self._coming(robot), len(goals) + 1)
        away = (next_ for next_ in coming if abs(goals[next_[0] % len(goals)] - spot) > ball)
        turn, operation, unit = next(away, (-1, None, 0))
        if operation is None:
            operation, _ = self._here(robot)
            words = "it moves, although its program has the same goal throughout"
            self._blame("Order", robot, operation.label, words)
            self.motion.spot[robot] = self.motion.now.s[robot]
            return
        begun = self.motion.begun(robot)
        self.clock.changed = self.clock.now
        self._over(robot, turn, begun)
        self.motion.leave(robot, goals[turn % len(goals)])
        if self.subject.goes_ahead(operation, robot):
            return  # it may leave before the operation starts
        name = self.factory.robots[robot].name
        shown = max(self.clock.begun, begun - self.subject.settings.tick)
        self.explanation.saw(operation.start, unit, self.clock.begun, begun, shown, name)

    def _passed(self, robot: int) -> None:
        """A robot passes its goal without stopping: its operation ended before its arrival, or the
        robot goes on ahead of one before, of a unit that is not made."""
        way, spot = self.motion.way[robot], self.motion.spot[robot]
        turn, operation, _ = next(self._coming(robot))
        before = (self._at(robot, number) for number in range(turn - 1, -1, -1))
        skipped = (o for o, _ in takewhile(lambda at: not self.subject.is_made(*at), before))
        early = (o for o in skipped if self.subject.goes_ahead(o, robot))
        if beyond := [s for o in early if way * ((s := self.subject.goal(o, robot)) - spot) > 0]:
            self.motion.leave(robot, beyond[0])
            return
        words = f"it passes its goal of {self.subject.name(operation)} without stopping"
        self._blame("Early", robot, operation.label, words)
        self.judged[operation.index] += 1
        goal = float(self.motion.spot[robot])
        self.motion.stand(robot, goal)
        self.motion.spot[robot] = goal
        self._leaves(robot)

    def _over(self, robot: int, turn: int, t: float) -> None:
        """All operations of a robot before the `turn`-th are over, at `t` [s] at the latest; those
        without a visible end are judged now."""
        for number in range(self.turn[robot], turn):
            operation, unit = self._at(robot, number)
            moves_parts = self.subject.moves_parts[operation.index]
            if not moves_parts and self.subject.is_made(operation, unit):
                self._judge(operation, unit, t, robot)
        self.turn[robot] = max(self.turn[robot], turn)

    def _judge(self, operation: Operation, unit: int, t: float, leaving: int = -1) -> None:
        """Blame a robot of an operation that is over at `t` [s] where it was not at rest at its
        goal, or not for the duration of the operation. The robot `leaving`, whose departure shows
        the end, was at rest."""
        if self.judged[operation.index] > unit:
            return
        self.judged[operation.index] = unit + 1
        radius, name = self.subject.radii[operation.index], self.subject.name(operation)
        for robot in operation.robots:
            goal = self.subject.goal(operation, robot)
            off = 0.0 if robot == leaving else self.motion.misses(robot, goal, radius)
            if off:
                words = f"{name} ended while it was {1e3 * off:.1f} mm from its goal, or moving"
                self._blame("Early", robot, operation.label, words)
                return
        came = self.motion.came[0]
        last = max(operation.robots, key=lambda r: float(came[r]))
        stayed = t - float(came[last])
        if stayed < operation.dwell - self.explanation.slack:
            words = (
                f"{name} ended {stayed:.3f} s after its arrival, but takes {operation.dwell:g} s"
            )
            self._blame("Early", last, operation.label, words)

    def _stuck(self, actuator: int, since: float, seen: Observation) -> None:
        robot = self.anatomy.owner[actuator]
        joint, setpoint = self.anatomy.joint[actuator], self.anatomy.setpoint[actuator]
        lag = 1e3 * abs(float(seen.qpos[joint] - seen.ctrl[setpoint]))
        words = f"it is {lag:.0f} mm from its setpoint, and does not follow"
        self._blame("Stuck", robot, self._label(robot), words, since)

    def _stalled(self) -> None:
        """Nothing has happened for too long: blame the robots that are under way, or else
        operations at which all their robots have arrived."""
        self.clock.stalled = True
        when = f"nothing has happened for {self.clock.now - self.clock.changed:.1f} s"
        away = self.motion.way.nonzero()[0].tolist()
        for robot in away[:3]:
            operation, _ = self._here(robot)
            words = f"{when} while it was on its way in {self.subject.name(operation)}"
            self._blame("Stalled", robot, operation.label, words, self.clock.changed)
        for operation in () if away else self._ready()[:3]:
            words = (
                f"{when}; {self.subject.name(operation)} does not proceed with all its robots there"
            )
            self._blame("Stalled", operation.carrier, operation.label, words, self.clock.changed)

    def _ready(self) -> list[Operation]:
        """The operations at which all their robots have arrived, those without inputs first."""
        at = [self._here(r)[0].index for r in range(len(self.turn))]
        ready = [o for o in self.factory.operations if all(at[r] == o.index for r in o.robots)]
        return sorted(ready, key=lambda o: not o.inputs)

    # --- names ---------------------------------------------------------------------------------

    def _at(self, robot: int, turn: int) -> tuple[Operation, int]:
        """The operation of a robot after `turn` others, and its unit."""
        gear: Sequence[int] = self.factory.robots[robot].operations
        unit, step = divmod(turn, len(gear))
        return self.factory.operations[gear[step]], unit

    def _label(self, robot: int) -> str:
        """The label of the operation that a robot is at; of the dropoff for the outfeed."""
        if robot < 0:
            return self.factory.dropoff.label
        return self._here(robot)[0].label

    def _coming(self, robot: int) -> Iterator[tuple[int, Operation, int]]:
        """The operations of a robot from now on, but for those of units that are known not to be
        made: how many come before, and the period of each."""
        turn, word = self.turn[robot], self.subject.word
        while True:
            operation, period = self._at(robot, turn)
            unit = self.factory.unit(operation, period)
            if word is None or word.is_made(unit) or unit >= word.fixed:
                yield turn, operation, period
            turn += 1

    def _here(self, robot: int) -> tuple[Operation, int]:
        """The operation that a robot is at, and its period."""
        _, operation, period = next(self._coming(robot))
        return operation, period

    def _blame(
        self, code: str, robot: int, label: str, message: str, since: float | None = None
    ) -> None:
        if len(self.violations) >= MOST:
            return
        t = self.clock.now if since is None else since
        at_fault = self.factory.robots[robot] if robot >= 0 else None
        source = self.factory.by_label.get(label, at_fault)
        name, where = at_fault.name if at_fault else "", source.position if source else None
        self.violations.append(Violation(t, name, label, code, message, where))
