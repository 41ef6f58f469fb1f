"""The monitor: watches a factory tick by tick, and judges what it saw against the net."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np

from factory.plant.factory import Operation
from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.explanation import Explanation
from factory.record.monitor.grips import Hands, misplaced
from factory.record.monitor.motion import Motion
from factory.record.monitor.observation import Eyes, Sight
from factory.record.monitor.report import Report, Violation
from factory.record.monitor.subject import Subject
from factory.record.monitor.transfers import Transfers
from factory.support.errors import Position

MOST = 100
"""So many violations are kept, the first ones: a fault is often followed by others."""

TICKS = 1.5
"""What is seen only tick by tick may be off by so many."""


class Monitor:
    """Reconstructs each robot's mode and each part's carrier from what it sees.

    `turn[r]`: how many operations robot r has finished since m_0, which tells where in its gear it
    is; `judged[o]`: how often operation o has been looked at when it was over. `time_s`: what all
    this took [s]. Give it a `Sight` before the run begins and one after every tick; as an observer
    of a run it looks for itself.
    """

    def __init__(self, subject: Subject, anatomy: Anatomy) -> None:
        begin = perf_counter()
        self.subject, self.anatomy, self.factory = subject, anatomy, subject.factory
        self.slack = TICKS * subject.settings.tick
        radius = np.array(
            [max(subject.radii[o] for o in r.operations) for r in self.factory.robots]
        )
        self.hands = Hands(anatomy, float(radius.max()))
        self.motion = Motion(anatomy, subject.settings, radius)
        self.transfers = Transfers(subject, anatomy, self._blame)
        self.explanation = Explanation(subject, self.slack)
        self.violations: list[Violation] = []
        counts = subject.counts
        self.judged = [counts.get(o.end, 0) for o in self.factory.operations]
        self.turn = [
            sum(counts.get(self.factory.operations[o].end, 0) for o in r.operations)
            for r in self.factory.robots
        ]
        self.begun = self.now = self.before = self.changed = 0.0
        self.started = self.stalled = False
        self.eyes: Eyes | None = None
        self.time_s = perf_counter() - begin

    def watch(self, m: Any, d: Any) -> None:
        """Look at a running engine from now on, at first before its run begins."""
        self.eyes = Eyes(m, d)
        self.observe(None, None)

    def observe(self, world: Any, supervisor: Any) -> None:
        """An observer of a run; it looks at neither of the two, but at the engine."""
        assert self.eyes is not None
        begin = perf_counter()
        self.see(self.eyes.look())
        self.time_s += perf_counter() - begin

    # --- a tick --------------------------------------------------------------------------------

    def see(self, sight: Sight) -> None:
        """Take in the state after a tick."""
        if not self.started:
            self._begin(sight)
            return
        self.before, self.now = self.now, sight.time
        left, arrived, passed = self.motion.look(sight)
        switches = self.hands.switched(sight)
        if switches:
            self.changed = self.now
            for operation, unit in self.transfers.judge(switches):
                self._ended(operation, unit)
        for robot in passed.tolist():
            self._passed(robot)
        for robot in left.tolist():
            if not self.motion.gone[robot]:
                self._leaves(robot)
        if len(arrived):
            self.changed = self.now
        for copy, weld, gap in self.hands.dropped(sight):
            self._hangs(copy, weld, gap)
        for actuator, since in self.motion.stuck(sight):
            self._stuck(actuator, since, sight)
        if self.now - self.changed > self.subject.patience and not self.stalled:
            self._stalled()

    def report(self) -> Report:
        """The verdict on what was seen so far."""
        begin = perf_counter()
        seen, inferred, unexplained = self.explanation.solve(self.begun, self.now)
        every = sorted([*self.violations, *unexplained], key=lambda v: v.t)[:MOST]
        self.time_s += perf_counter() - begin
        return Report(tuple(seen), tuple(inferred), tuple(every), self.time_s)

    def _begin(self, sight: Sight) -> None:
        self.started, self.begun = True, sight.time
        self.now = self.before = self.changed = sight.time
        self.motion.begin(sight)
        self.transfers.begin(self.hands.switched(sight))
        places = {part: np.array(place) for part, place in self.subject.places.items()}
        for weld in misplaced(self.anatomy, places):
            holder, part = self.anatomy.holder[weld], self.anatomy.part[weld]
            words = f"the weld that holds {part} puts it elsewhere than where it is in the product"
            self._blame("Frame", holder[1] if holder else -1, part, words)
        for copy, weld, gap in self.hands.dropped(sight):
            self._hangs(copy, weld, gap)

    # --- what is seen --------------------------------------------------------------------------

    def _ended(self, operation: Operation, unit: int) -> None:
        """The parts of an operation have changed hands: X_e."""
        robot = self.factory.robots[operation.carrier].name
        self.explanation.saw(operation.end, unit, self.before, self.now, self.before, robot)
        for number in operation.robots:
            gear = self.factory.robots[number].operations
            last = unit * len(gear) + gear.index(operation.index)
            self._over(number, last, self.now)
        self._judge(operation, unit, self.now)
        for number in operation.robots:
            gear = self.factory.robots[number].operations
            last = unit * len(gear) + gear.index(operation.index)
            self.turn[number] = max(self.turn[number], last + 1)
            self.motion.stand(number, self.subject.goal(operation, number))

    def _leaves(self, robot: int) -> None:
        """A robot leaves the place where it stood: the next operation that has its goal elsewhere
        has started, if it was not to go ahead, and those before are over."""
        anchor, ball = self.motion.anchor[robot], self.motion.ball[robot]
        size = len(self.factory.robots[robot].operations)
        first = self.turn[robot]
        for turn in range(first, first + size + 1):
            operation, unit = self._at(robot, turn)
            goal = self.subject.goal(operation, robot)
            if abs(goal - anchor) > ball:
                break
        else:
            words = "it moves, though its program keeps it where it is"
            self._blame("Order", robot, operation.label, words)
            self.motion.anchor[robot] = self.motion.s[robot]
            return
        begun = self.motion.leave(robot, goal)
        self.changed = self.now
        self._over(robot, turn, begun)
        if self.subject.goes_ahead(operation, robot):
            return  # it need not wait until the operation starts
        name = self.factory.robots[robot].name
        shown = max(self.begun, begun - self.subject.settings.tick)
        self.explanation.saw(operation.start, unit, self.begun, begun, shown, name)

    def _passed(self, robot: int) -> None:
        """A robot passes its goal without stopping: its operation ended before it had come."""
        operation, _ = self._at(robot, self.turn[robot])
        words = f"it passes its goal of {self.subject.name(operation)} without stopping"
        self._blame("Early", robot, operation.label, words)
        self.judged[operation.index] += 1
        self.motion.stand(robot, float(self.motion.target[robot]))
        self.motion.anchor[robot] = self.motion.target[robot]
        self._leaves(robot)

    def _over(self, robot: int, turn: int, t: float) -> None:
        """All operations of a robot before the `turn`-th are over, at `t` [s] at the latest; those
        whose end does not show are judged now."""
        for number in range(self.turn[robot], turn):
            operation, unit = self._at(robot, number)
            if not self.subject.moves_parts[operation.index]:
                self._judge(operation, unit, t, robot)
        self.turn[robot] = max(self.turn[robot], turn)

    def _judge(self, operation: Operation, unit: int, t: float, leaving: int = -1) -> None:
        """Whether the robots of an operation that is over at `t` [s] were at their goals, at rest,
        and for as long as it takes. The one that shows its end by `leaving` was."""
        if self.judged[operation.index] > unit:
            return
        self.judged[operation.index] = unit + 1
        radius, name = self.subject.radii[operation.index], self.subject.name(operation)
        for robot in operation.robots:
            goal = self.subject.goal(operation, robot)
            off = 0.0 if robot == leaving else self.motion.misses(robot, goal, radius)
            if off:
                words = f"{name} ended while it was {1e3 * off:.1f} mm from its goal, or moved"
                self._blame("Early", robot, operation.label, words)
                return
        last = max(operation.robots, key=lambda r: float(self.motion.came[r]))
        stayed = t - float(self.motion.came[last])
        if stayed < operation.dwell - self.slack:
            words = f"{name} ended {stayed:.3f} s after it came, and takes {operation.dwell:g} s"
            self._blame("Early", last, operation.label, words)

    def _hangs(self, copy: int, weld: int, gap: float) -> None:
        holder, name = self.anatomy.holder[weld], self.anatomy.copies[copy]
        words = f"{name} is {1e3 * gap:.1f} mm from where its weld keeps it, or turned"
        self._blame("Dropped", holder[1] if holder else -1, self.anatomy.label[copy], words)

    def _stuck(self, actuator: int, since: float, sight: Sight) -> None:
        robot = self.anatomy.owner[actuator]
        joint, setpoint = self.anatomy.joint[actuator], self.anatomy.setpoint[actuator]
        lag = 1e3 * abs(float(sight.qpos[joint] - sight.ctrl[setpoint]))
        words = f"it is {lag:.0f} mm from its setpoint, and does not follow"
        self._blame("Stuck", robot, self._label(robot), words, since)

    def _stalled(self) -> None:
        """Nothing has happened for too long. To blame are the robots that are under way, or else an
        operation that all its robots have come to and that does not go on."""
        self.stalled = True
        when = f"nothing has happened for {self.now - self.changed:.1f} s"
        away = [r for r in range(len(self.turn)) if self.motion.gone[r]]
        for robot in away[:3]:
            operation, _ = self._at(robot, self.turn[robot])
            words = f"{when} while it was on its way in {self.subject.name(operation)}"
            self._blame("Stalled", robot, operation.label, words, self.changed)
        for operation in () if away else self._ready()[:3]:
            words = f"{when}; {self.subject.name(operation)} does not go on, with all robots there"
            self._blame("Stalled", operation.carrier, operation.label, words, self.changed)

    def _ready(self) -> list[Operation]:
        """The operations that all their robots have come to: those that are fed by others first."""
        at = [self._at(r, turn)[0].index for r, turn in enumerate(self.turn)]
        ready = [o for o in self.factory.operations if all(at[r] == o.index for r in o.robots)]
        return sorted(ready, key=lambda o: not o.inputs)

    # --- words ---------------------------------------------------------------------------------

    def _at(self, robot: int, turn: int) -> tuple[Operation, int]:
        """The operation that a robot comes to after `turn` others, and its unit."""
        gear: Sequence[int] = self.factory.robots[robot].operations
        unit, step = divmod(turn, len(gear))
        return self.factory.operations[gear[step]], unit

    def _label(self, robot: int) -> str:
        """What a robot is at; the dropoff for the outfeed."""
        if robot < 0:
            return self.factory.dropoff.label
        return self._at(robot, self.turn[robot])[0].label

    def _blame(
        self, code: str, robot: int, label: str, message: str, since: float | None = None
    ) -> None:
        if len(self.violations) >= MOST:
            return
        t = self.now if since is None else since
        name = self.factory.robots[robot].name if robot >= 0 else ""
        where = self._position(label, robot)
        self.violations.append(Violation(t, name, label, code, message, where))

    def _position(self, label: str, robot: int) -> Position | None:
        operation = self.factory.by_label.get(label)
        if operation is not None:
            return operation.position
        return self.factory.robots[robot].position if robot >= 0 else None
