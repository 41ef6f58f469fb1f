"""Staging: a robot that waits empty-handed for others goes ahead to where they need it; one that
moves several joints goes ahead with its part too, as far as its way is its own.

The paper's `wait` stands still. Here its field may be that of the operation to come, as far as it
moves this robot; its goal is still everything, so the net is the same, and is proved as before. The
certificate holds for who goes ahead too: who would come near another machine there stays where it
is (`exclusions.too_near`). So a payload is kept away from those it is to meet until their mode
begins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from factory.floor.layout.exclusions import awaited_positions, too_near
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.staying import carried_ahead, goes_home
from factory.floor.modes.modes import operation_starts
from factory.support.arrays import Array
from factory.support.bounds import WorldName
from factory.support.settings import Settings
from factory.theory.control.mode import ROUNDING, Mode
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import AxisId, carriage_axis


@dataclass(frozen=True, slots=True)
class HeadStart:
    """The way of a robot ahead of one of its operations, while it waits.

    Attributes:
        robot: the robot (index).
        operation: the operation (index).
        slot: the robot's slot in it.
        mode: the mode that moves one axis of the robot to its goal there.
        start: where the axis starts in the long run [m].
        axis: the axis, of its carriage or its lift.
        follows: whether it follows another of the same operation, that of the lift.
    """

    robot: int
    operation: int
    slot: int
    mode: Mode = field(repr=False)
    start: float
    axis: AxisId
    follows: bool = False

    @property
    def goal(self) -> float:
        """Where it goes, an arc length [m]."""
        return float(self.mode.goals[0])

    def is_past(self, at: float) -> bool:
        """Whether a position is at the goal or beyond it, as a robot that has not delivered yet may
        be: it does not go back."""
        return (at - self.goal) * (self.goal - self.start) >= 0.0


def stages(layout: Layout, modes: Sequence[Mode]) -> tuple[HeadStart, ...]:
    """Every way that a robot can go ahead: it brings nothing and has others to wait for, and none
    of them comes near it on its way, whatever their speeds; or it is known to be clear of them with
    what it brings (`carried_ahead`). A lift that holds from above rises before its robot goes
    home."""
    starts_ahead: list[HeadStart] = []
    starts, awaited = operation_starts(layout), awaited_positions(layout)
    carried = carried_ahead(layout)
    for operation, mode, start in zip(layout.factory.operations, modes, starts, strict=True):
        homes = start.copy()
        homes[: len(operation.robots)] = [layout.home(r, operation.index) for r in operation.robots]
        clear = all(map(mode.clear_from, (start, homes)))
        for slot, robot in enumerate(operation.robots):
            if rises_first(layout, robot):
                starts_ahead += _rising(
                    layout, operation, mode, slot, float(start[slot]), awaited.get(robot)
                )
                continue
            goal = float(mode.goals[slot])
            ahead = clear and operation.awaits_empty(slot) and mode.gate[slot] < 0
            if goes_home(layout, robot, operation.index):
                # others may be where a tall hand comes home to, and a part before a hand above it
                empty = operation.awaits_empty(slot) or not operation.inputs
                ahead, goal = empty and robot in awaited, awaited.get(robot, goal)
            if (operation.index, robot) in carried:
                ahead, goal = True, float(mode.goals[slot]) + carried[operation.index, robot]
            if ahead and abs(float(start[slot]) - goal) > ROUNDING:
                at = float(start[slot])
                starts_ahead.append(
                    _ahead(layout.factory, operation, mode, carriage_axis(robot), goal, at)
                )
                starts_ahead += _adjusting(layout, operation, mode, robot, start)
    return tuple(starts_ahead)


def _rising(
    layout: Layout, operation: Operation, mode: Mode, slot: int, start: float, awaited: float | None
) -> Iterator[HeadStart]:
    """The way up of a lift before the first operation of its robot, and after that the way back
    from its `start` to where the robot is `awaited`, if it is."""
    factory, robot = layout.factory, operation.robots[slot]
    axis = factory.up(robot)
    if axis is None or not factory.begins(robot, operation.index):
        return
    goal = float(mode.goals[factory.moves[operation.index].index(axis)])
    yield _ahead(factory, operation, mode, axis, goal, 0.0)
    if awaited is not None and abs(start - awaited) > ROUNDING:
        yield replace(
            _ahead(factory, operation, mode, carriage_axis(robot), awaited, start), follows=True
        )


def _adjusting(
    layout: Layout, operation: Operation, mode: Mode, robot: int, start: Array
) -> Iterator[HeadStart]:
    """The way of a lift to where it is for the next tour, once its robot is at home."""
    factory = layout.factory
    axis = factory.up(robot) if robot in factory.adjusted else None
    if axis is None or not factory.begins(robot, operation.index):
        return
    raised = factory.moves[operation.index].index(axis)
    goal, at = float(mode.goals[raised]), float(start[raised])
    if abs(goal - at) > ROUNDING:
        yield replace(_ahead(factory, operation, mode, axis, goal, at), follows=True)


def _ahead(
    factory: Factory, operation: Operation, mode: Mode, axis: AxisId, goal: float, start: float
) -> HeadStart:
    slot = factory.moves[operation.index].index(axis)
    only = slice(slot, slot + 1)
    alone = Mode(np.array([goal]), mode.lower[only], mode.upper[only], mode.eps)
    return HeadStart(factory.robot_of(axis), operation.index, slot, alone, start, axis)


def stages_of(layout: Layout, modes: Sequence[Mode], settings: Settings) -> tuple[HeadStart, ...]:
    """Those, where the settings ask for them; else those that something may wait for."""
    every, may = stages(layout, modes), {*awaited_positions(layout)}
    if settings.stage:
        ahead = {stage.robot for stage in every} - may
        may |= ahead - too_near(layout, ahead)
    return tuple(stage for stage in every if stage.axis in may or stage.axis != stage.robot)


def with_time(
    layout: Layout, ahead: Sequence[HeadStart], world: WorldName, wip: int | None = None
) -> tuple[HeadStart, ...]:
    """Those of ways ahead for which robots have the time. In the ideal world none waits for a
    feeder, or for its own hand to be away: it takes the next part at once, and its operation moves
    all of it together, unless `wip` bounds what is inside."""
    late, operations = world == "mujoco" or wip is not None, layout.factory.operations
    return tuple(s for s in ahead if late or operations[s.operation].inputs)


def staged(starts: Sequence[Array], ahead: Sequence[HeadStart]) -> list[Array]:
    """Where the axes of each operation are when it starts, if those that go ahead are there."""
    positions = [np.array(start) for start in starts]
    for stage in ahead:
        positions[stage.operation][stage.slot] = stage.goal
    return positions
