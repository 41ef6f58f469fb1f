"""Robots that return after an undo.

Each goes to where it waits in the new marking. The robots of one operation leave one after the
other, in the reverse order of their coming, so that each goes back the way it came.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from factory.api import Layout, LayoutMachines, Marking, Mode, Operation
from factory.engine.simulation.supervisor import Supervisor
from factory.support.arrays import Array

Goal = tuple[int, float]
"""An axis and where it goes [m]."""

EXACT = 9
"""Goals that agree to so many decimals are one."""

LEFT = 2e-3
"""A robot has left where it waits when it is so far from there [m]."""

PAST = 2e-3
"""So much further than it has to does a robot go out of the way of its feeder [m]."""


@dataclass(slots=True)
class WayBack:
    """The return of a robot.

    Attributes:
        goals: where it goes, one after another.
        after: robots (index) that must have returned before it sets out.
        done: called when it has returned.
        ready: whether it may set out.
        stage: the number of its current mode; -1 before the first.
        since: since when it could have moved [s].
    """

    goals: list[Goal]
    after: frozenset[int] = frozenset()
    done: Callable[[], None] = lambda: None
    ready: Callable[[], bool] = lambda: True
    stage: int = -1
    since: float = np.inf


class ReturnMotion:
    """Moves robots back to where they wait in the marking after an undo.

    Attributes:
        ways: by robot (index) that is returning, its way back.
    """

    def __init__(self, layout: Layout, supervisor: Supervisor, eps: float) -> None:
        self._layout, self._supervisor = layout, supervisor
        goals = [*dict.fromkeys(_goals(layout))]
        first = len(supervisor.bundles.modes)
        self._number = {goal: first + n for n, goal in enumerate(goals)}
        modes = [_mode(layout, axis, at, eps) for axis, at in goals]
        supervisor.bundles = supervisor.bundles.with_more(modes, [(axis,) for axis, _ in goals])
        self.ways = dict[int, WayBack]()

    def send(self, robot: int, way: WayBack) -> None:
        """Give a robot a way back, replacing any that it has."""
        self.ways[robot] = way

    def tick(self, held: Iterable[int], now: float) -> None:
        """Start the next stages at time now [s], except of the robots that are `held`."""
        going, held, begun = {*self._supervisor.active.ahead}, {*held}, list[int]()
        for robot, way in [*self.ways.items()]:
            if way.stage not in going or robot in held:
                way.since = now
            if way.stage in going or robot in held or not way.after.isdisjoint(self.ways):
                continue
            if way.goals and not way.ready():
                continue
            if way.goals:
                way.stage = self._number[_rounded(way.goals.pop(0))]
                begun.append(way.stage)
            else:
                del self.ways[robot]
                way.done()
        if begun:
            self._supervisor.send(begun)

    def late(self, before: float) -> list[int]:
        """Robots that have been in one stage since before a time [s]."""
        return [robot for robot, way in self.ways.items() if way.since < before]

    def home(self, robot: int) -> list[Goal]:
        """The way of a robot to its B end: its lift first, unless the lift is adjusted to its
        payload, which returns at the height at which it came."""
        lift, layout = self._layout.factory.up(robot), self._layout
        stays = robot in layout.factory.adjusted
        rise = [] if lift is None or stays else [(lift, _highest(layout, robot))]
        return [*rise, (robot, layout.guidepaths[robot].length)]

    def aside(self, robot: int, leaf: Operation) -> list[Goal]:
        """The way by which a robot makes room for a part that its feeder presents or withdraws;
        empty if its hand is in place before that part."""
        hand = self._layout.hand(robot)
        return [] if hand is not None and hand.first else [(robot, _aside(self._layout, leaf))]

    def rest(self, robot: int, marking: Marking) -> list[Goal]:
        """The way of a robot to where it waits in a marking; clear of its feeder if the next part
        comes down before it may go there."""
        layout, gear = self._layout, self._layout.factory.net.gears[robot]
        marking = self._without_skipped(robot, marking)
        step, _ = gear.step_in(marking)
        at, lift = LayoutMachines(layout).starts(marking), layout.factory.up(robot)
        goals = [(robot, _waiting(layout, robot, step))]
        if lift is None:
            return goals
        rise = (lift, float(at[lift]))
        if robot in layout.factory.adjusted:
            return [*goals, rise]
        up = layout.visits[layout.factory.robots[robot].operations[step], robot].up
        return [rise, *goals] if rise[1] == up > 0 else goals

    def _without_skipped(self, robot: int, marking: Marking) -> Marking:
        """The marking after a robot has skipped the units that are not made, at the beginning of
        its tour."""
        factory, word = self._layout.factory, self._supervisor.word
        gear, program = factory.net.gears[robot], factory.robots[robot].operations
        step, _ = gear.step_in(marking)
        operation = factory.operations[program[step]]
        unit = factory.unit(operation, self._supervisor.fired[operation.start])
        if word.upcoming(unit) == unit:
            return marking
        first = program.index(factory.tour_of(robot, operation.index)[0])
        return marking.difference(gear.places) | {gear.waiting(first)}

    def has_left(self, robot: int, marking: Marking) -> bool:
        """Whether a robot is away from where it would wait if its current operation had not
        started."""
        x, _ = self._supervisor.world.sense()
        return any(abs(x[axis] - at) > LEFT for axis, at in self.rest(robot, marking))


def order_of(mode: Mode, robots: Sequence[int]) -> tuple[int, ...]:
    """The robots of an operation in the order in which they reach it."""
    return tuple(robots[slot] for slot in mode.order if slot < len(robots))


def _waiting(layout: Layout, robot: int, step: int) -> float:
    """Where a robot waits for the operation at a step of its program [m]: its position at the start
    of a run, or clear of the part that has to come down first."""
    factory, hand = layout.factory, layout.hand(robot)
    program = factory.robots[robot].operations
    at, operation = layout.home(robot, program[step]), factory.operations[program[step]]
    if operation.inputs or (hand is not None and hand.first):
        return at
    return _aside(layout, operation)


def _aside(layout: Layout, leaf: Operation) -> float:
    """Where the robot of a feeder is clear of the presented part [m]."""
    at = layout.guidepaths[leaf.carrier].length
    return max(0.0, at - LayoutMachines(layout).passing(leaf) - PAST)


def _highest(layout: Layout, robot: int) -> float:
    return max(layout.visits[tour[0], robot].up for tour in layout.factory.tours[robot])


def _goals(layout: Layout) -> Iterable[Goal]:
    """All goals to which a robot can be sent."""
    factory = layout.factory
    for robot in factory.robots:
        up = factory.up(robot.index)
        yield _rounded((robot.index, layout.guidepaths[robot.index].length))
        for step, number in enumerate(robot.operations):
            yield _rounded((robot.index, _waiting(layout, robot.index, step)))
            if not factory.operations[number].inputs:
                yield _rounded((robot.index, _aside(layout, factory.operations[number])))
            if up is not None:
                yield _rounded((up, layout.visits[number, robot.index].up))
        if up is not None:
            yield _rounded((up, _highest(layout, robot.index)))


def _rounded(goal: Goal) -> Goal:
    return goal[0], round(goal[1], EXACT)


def _mode(layout: Layout, axis: int, at: float, eps: float) -> Mode:
    """The mode that moves one axis to a place [m]."""
    robots = len(layout.guidepaths)
    longest = layout.guidepaths[axis].length if axis < robots else at
    upper: Array = np.array([max(longest, at)])
    return Mode(np.array([at]), np.zeros(1), upper, eps)
