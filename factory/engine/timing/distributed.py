"""The cycle time of robots that run their own programs: each looks and acts at the ticks of its own
control period only, so whatever it waits for it sees up to a period late. The dates of all
transitions are found in order, each on the ticks of the robot that fires it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, sqrt
from random import Random

import numpy as np

from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import AS_IT_IS
from factory.theory.control.governed import Trajectory
from factory.theory.control.mode import STILL
from factory.theory.nets.coordinated import Past
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import is_end, operation_of

PERIODS = (0.006, 0.02)
"""Control periods are drawn from so long to so long [s], in whole timesteps, one at least."""

MADE = 32
"""Number of units in which the pace is reached, of which the last half count."""


@dataclass(frozen=True, slots=True)
class Scan:
    """The control `period` of a robot and its `phase` [timesteps]."""

    period: int
    phase: int

    def tick(self, time: float) -> int:
        """Its first tick from a time [timesteps] on."""
        return self.phase + max(0, ceil((time - self.phase) / self.period - 1e-9)) * self.period


def drawn_scans(random: np.random.Generator, robots: int, timestep: float) -> list[Scan]:
    """The scans of so many robots, drawn; `timestep` [s]."""
    low, high = (max(1, round(period / timestep)) for period in PERIODS)
    periods = random.integers(low, high + 1, size=robots).tolist()
    return [Scan(period, int(random.integers(period))) for period in periods]


class ScannedTimes:
    """The dates [timesteps] of a distributed run of a timed net, whose robots have these `scans`.

    Attributes:
        acted: by robot, the tick in which it began to wait for its next operation.
        shown: by robot, the tick in which it showed that it had finished the last one.
        entered: by operation and robot (index), the tick in which the robot entered it last.
    """

    def __init__(self, net: Timed, scans: Sequence[Scan]) -> None:
        self.timed, self.timing, self.scans = net, net.timing, scans
        self._step = self.timing.stepped.step
        self._passes, self._order = self.timing.passes(), Random(0)
        self.acted = [-scan.period for scan in scans]
        self.shown = [0] * len(scans)
        self.entered = dict[tuple[int, int], int]()
        self._ahead = {(stage.robot, stage.operation) for stage in self.timing.stages}

    @cached_property
    def dropoffs(self) -> list[int]:
        """When each unit is dropped off."""
        net, timing = self.timed.net, self.timing
        factory, coordinated = timing.factory, timing.coordinated
        passes = {int(net.right[place]): past for past, (place, _) in coordinated.passes.items()}
        starts = {int(o.start): o for o in factory.operations}
        ends = {int(o.end): o for o in factory.operations}
        shows = {net.right[served.top] for served in coordinated.served.values()}
        waits = self._waits()
        dates, left = dict[tuple[int, int], float](), list[int]()
        for period in range(-(-MADE // factory.period)):
            for event in net.token_free.order:
                date = 0.0
                for place in net.net.preset[event]:
                    before = net.left[place], period - net.tokens[place]
                    if place in waits and before in dates:
                        date = max(date, dates[before] + waits[place])
                if event in passes:
                    date = max(date, self._passed(passes[event]))
                elif event in shows:
                    date = self._look(date)
                elif event in starts:
                    date = self._enters(starts[event], date)
                elif event in ends:
                    date = self._ends(ends[event])
                    if factory.drops(operation_of(event)):
                        left.append(int(date))
                dates[event, period] = date
        return left

    @property
    def cycle(self) -> CycleTime:
        """The mean interval between the units of the last half, and the bottleneck."""
        period, left = self.timing.factory.period, self.dropoffs
        count = len(left) // 2 // period * period or period
        seconds = (left[-1] - left[-1 - count]) * self._step / count
        return CycleTime(seconds, self.timed.bottleneck)

    def _waits(self) -> dict[int, float]:
        """How long a token stays in each place that is in no program: in those of a hand or a
        magazine, of an order, of the tray, and of the bound on what is inside."""
        timing, count = self.timing, len(self.timing.factory.net.threaded.places)
        coordinated, ways = timing.coordinated, {*self.timed.ways.values()}
        passed = {place for place, _ in coordinated.passes.values()}
        waits = {
            place: 0.0
            for place in range(count, len(self.timed.net.tokens))
            if place not in passed and place not in ways
        }
        for number, served in coordinated.served.items():
            waits[served.up], waits[served.down] = (s / self._step for s in timing.strokes[number])
        for place in coordinated.away.values():
            waits[place] = timing.outfeed / self._step
        return waits

    def _passed(self, past: Past) -> float:
        """When a robot comes past a point: it sets out in the tick after it has begun to wait, or
        in that in which it enters its operation."""
        robot, number = self.timing.factory.robot_of(past.axis), operation_of(past.after)
        begun = self.acted[robot] + self.scans[robot].period
        if not is_end(past.after):
            begun = self.entered[number, robot]
        return begun + self._passes[past] / self._step

    def _look(self, time: float) -> float:
        """When the feeders are looked after next."""
        settings = self.timing.stepped
        every = (settings.stride // 2 + 1) * settings.steps
        return ceil(time / every - 1e-9) * every

    def _enters(self, operation: Operation, date: float) -> int:
        """The tick in which the carrier sees that it may begin."""
        carrier = operation.carrier
        others = [self._seen(self.shown[r]) for r in operation.robots if r != carrier]
        begun = self.scans[carrier].tick(max(self.acted[carrier] + 1, date, *others, 0))
        for robot in operation.robots:
            self.entered[operation.index, robot] = self.scans[robot].tick(
                max(self.acted[robot] + 1, begun if robot == carrier else self._seen(begun))
            )
        return begun

    def _seen(self, tick: int) -> float:
        """When others see what a robot shows in a tick: those that tick in the same timestep do so
        in any order."""
        return tick + self._order.choice((0.0, 0.5))

    def _ends(self, operation: Operation) -> int:
        """The tick in which the carrier ends an operation; all others see it, and go on."""
        carrier, scan = operation.carrier, self.scans[operation.carrier]
        there = max([self.entered[operation.index, carrier], *self._arrivals(operation)])
        period = scan.period * self._step
        end = scan.tick(there) + ceil(operation.dwell / period - 1e-9) * scan.period
        last = self.shown[carrier] = end
        for robot in operation.robots:
            if robot != carrier:
                self.shown[robot] = self.acted[robot] = self.scans[robot].tick(self._seen(end))
                last = max(last, self.acted[robot])
        self.acted[carrier] = scan.tick(max(end + 1, last))
        return end

    def _arrivals(self, operation: Operation) -> list[float]:
        """When each axis of an operation rests at its goal."""
        timing, number = self.timing, operation.index
        mode, starts = timing.modes[number], timing.starts[number]
        arrivals, opens = dict[int, float](), dict[int, float]()
        ways = dict[int, tuple[int, int, Trajectory]]()
        for slot in mode.order:
            axis = timing.factory.moves[number][slot]
            robot = timing.factory.robot_of(axis)
            begun, goal = self.entered[number, robot], float(mode.goals[slot])
            start = float(starts[slot])
            ahead = abs(float(timing.left[number][slot]) - goal)
            if (robot, number) in self._ahead and abs(start - goal) < mode.eps < ahead:
                start, begun = goal + ahead, self.acted[robot] + self.scans[robot].period
            drive = replace(timing.axis_drive(axis, AS_IT_IS), tick=self._tick(robot))
            gate, taus = int(mode.gate[slot]), [0.0]
            if gate >= 0 and ways[gate][:2] == (robot, begun):  # a robot knows its own reference
                taus = ways[gate][2].taus(mode.eps, float(mode.standoff[slot]), drive.tick)
            elif gate >= 0 and mode.standoff[slot] and opens[gate] > begun:
                ticks = ceil((opens[gate] - begun) / self.scans[robot].period)
                taus = [float(mode.standoff[slot])] * ticks + [0.0]
            way = drive.gated(abs(start - goal), taus)
            ways[slot] = robot, begun, way
            opens[slot] = begun + self._opens(way, mode.eps) * self.scans[robot].period
            at = begun + self._rests(way, mode.eps) * self.scans[robot].period
            arrivals[slot] = max(at, float(self.entered[number, robot]))
        return [*arrivals.values()]

    def _tick(self, robot: int) -> float:
        return self.scans[robot].period * self._step

    @staticmethod
    def _opens(way: Trajectory, eps: float) -> float:
        """After how many ticks the gate that an axis is opens, which is in its goal ball then."""
        begin = way.within(eps) - 1
        if begin < 0:
            return 0.0
        left, speed, (then, after) = eps, way.speed[begin], way.left[begin : begin + 2]
        # in a tick its way is (1 - share) of the first speed and share of the last
        mean, both = 2 * (then - after), speed + way.speed[begin + 1]
        first = mean * speed / both if both else mean / 2  # the ideal world has no acceleration
        gain = (mean - 2 * first) / 2
        way_left = then - left
        if abs(gain) < 1e-12:
            return begin + way_left / first
        return begin + (sqrt(first * first + 4 * gain * way_left) - first) / (2 * gain)

    def _rests(self, way: Trajectory, eps: float) -> float:
        """After how many ticks an axis is nearer to its goal than eps, and STILL: within the last
        tick, in which it brakes; in the ideal world it is always STILL."""
        if self.timing.world == "ideal":
            return self._opens(way, eps)
        last = way.rests(eps, 1e-6)
        if not last:
            return 0.0
        speed = abs(way.speed[last - 1])
        return last - min(1.0, STILL / speed if speed else 0.0)
