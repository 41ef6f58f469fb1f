"""A factory F = (R, ~, N) (paper, section 4.4): robots, identifications, gear net.

Operations are the instances of templates; their places and transitions in the net are found by
number: operation i has start 2i, end 2i + 1 and operation place i.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from factory.support.errors import usage_error
from factory.support.showing import Pictured
from factory.theory.nets.gears import GearNet, ascending
from factory.theory.nets.undone import Joins
from factory.theory.plant.axes import Axis
from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.ids import AxisId, OperationId, RobotId, operation_of
from factory.theory.problem.pag import NOPART, PAG
from factory.theory.problem.plan import Plan, out_of_turn
from factory.theory.problem.robot_bodies import LIFT_JOINT

NO_PARENT = OperationId(-1)
"""The operation that takes what a dropoff makes: none."""


@dataclass(frozen=True)
class Factory(Pictured):
    """F = (R, ~, N), with its operations (section 4.4). The last operation is dropoff; ~ is the
    union of the templates' identifications over the operations.

    Attributes:
        pag: the product.
        robots: R.
        operations: the operations; operation i has the transitions 2i and 2i + 1, and the place i.
        net: N, a gear net (Theorem 5.1).
        parents: for each operation the one that takes its result; -1 for dropoff.
        plan: the variant that it is.
        adjusted: robots (index) with a lift that is set for each of their tours, to where the one
            hand holds what they bring.
        period: number of units in one cycle of the net, with operations of their own; the last so
            many operations are their dropoffs, in that order.
    """

    pag: PAG
    robots: tuple[Robot, ...]
    operations: tuple[Operation, ...]
    net: GearNet
    parents: tuple[OperationId, ...] = field(repr=False)
    plan: Plan = field(default_factory=Plan, repr=False)
    adjusted: frozenset[int] = frozenset()
    period: int = 1

    def __repr__(self) -> str:
        counts = f"{len(self.robots)} robots, {len(self.operations)} operations"
        return f"<Factory of {self.pag.title}: {counts}>"

    @cached_property
    def by_label(self) -> Mapping[str, Operation]:
        """The operation that makes each label; dropoff under its own name."""
        return MappingProxyType({operation.label: operation for operation in self.operations})

    @cached_property
    def carriage(self) -> float:
        """W, the width and length that each carriage has to itself: that of the largest [m]."""
        return max(robot.body.carriage for robot in self.robots)

    @cached_property
    def leaves(self) -> tuple[Operation, ...]:
        """The operations that make a part out of nothing, in the order of their numbers."""
        return tuple(operation for operation in self.making if not operation.inputs)

    @property
    def making(self) -> tuple[Operation, ...]:
        """All operations but dropoff."""
        return self.operations[: -self.period]

    @property
    def dropoffs(self) -> tuple[Operation, ...]:
        """The dropoff of each unit of a period."""
        return self.operations[-self.period :]

    @property
    def dropoff(self) -> Operation:
        """The output robot's last operation, for the first unit of a period."""
        return self.operations[-self.period]

    def operation_of(self, transition: int) -> Operation:
        """The operation that a transition of the compiled net starts or ends."""
        return self.operations[operation_of(transition)]

    def drops(self, operation: int) -> bool:
        """Whether an operation (index) is a dropoff."""
        return operation >= len(self.operations) - self.period

    @property
    def products(self) -> tuple[str, ...]:
        """The label of the finished product, for each unit of a period."""
        return tuple(dropoff.inputs[0] for dropoff in self.dropoffs)

    def result(self, operation: Operation) -> str:
        """What an operation makes; what it drops off."""
        return operation.inputs[0] if self.drops(operation.index) else operation.label

    @property
    def sequence(self) -> tuple[str, ...]:
        """The product of each unit of a period, as the PAG has it."""
        return tuple(out_of_turn(label, turn) for turn, label in enumerate(self.products))

    def unit(self, operation: Operation, count: int) -> int:
        """For which unit an operation is that has been started, or ended, so often before."""
        return count * self.period + operation.turn

    def units(self, counts: Mapping[int, int]) -> int:
        """How many products have been dropped off, by how often each transition has fired."""
        return sum(counts.get(dropoff.end, 0) for dropoff in self.dropoffs)

    @cached_property
    def tours(self) -> tuple[tuple[tuple[OperationId, ...], ...], ...]:
        """For each robot the operations of its tours, in the order of its gear: a tour leads from
        empty hands to empty hands. A robot that serves one label has one, one on a line several."""
        by_robot = []
        for robot in self.robots:
            tours, tour = list[tuple[OperationId, ...]](), list[OperationId]()
            for number in robot.operations:
                operation = self.operations[number]
                tour.append(number)
                if operation.after[operation.robots.index(robot.index)] == NOPART:
                    tours.append(tuple(tour))
                    tour = []
            by_robot.append(tuple(tours))
        return tuple(by_robot)

    @cached_property
    def folded(self) -> bool:
        """Whether some robot has more than one tour."""
        return any(len(tours) > 1 for tours in self.tours)

    @cached_property
    def order(self) -> tuple[OperationId, ...]:
        """The operations in an order in which every robot's program ascends, unit by unit, each
        unit's dropoff last: so units can be made one after the other. Raises ValueError where there
        is none: then the net is not live."""
        if not self.folded:
            numbers = [operation.index for operation in self.operations]
            return (*reversed(numbers[:-1]), numbers[-1])
        turns = [operation.turn for operation in self.operations]
        order = ascending([robot.operations for robot in self.robots], turns)
        return tuple(map(OperationId, order))

    @cached_property
    def postorder(self) -> tuple[int, ...]:
        """When each operation comes as one period is made operation by operation, what its carrier
        holds first. It does not depend on the robots' programs."""
        when, count = [-1] * len(self.operations), len(self.operations)
        stack = [o.index for o in self.dropoffs]
        while stack:  # backwards: an operation, then the last that it waits for
            o = self.operations[stack.pop()]
            count -= 1
            when[o.index] = count
            inputs = sorted(o.inputs, key=o.pile.__ne__)
            stack += [self.by_label[label].index for label in inputs]
        return tuple(when)

    @cached_property
    def _lowered(self) -> Mapping[int, float]:
        """How far [m] each robot (index) that goes up and down lowers what it delivers, robot by
        robot: one with several tours the farthest that one of them asks for, one that is adjusted
        0."""
        lowered: dict[int, float] = dict.fromkeys(self.adjusted, 0.0)
        for o in self.operations:
            if o.approach is None or o.lowered < 0:
                continue
            robot = o.robots[o.lowered]
            if self.robots[robot].body.lifts:
                lowered[robot] = max(lowered.get(robot, 0.0), o.approach.stroke)
        return MappingProxyType(dict(sorted(lowered.items())))

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """The axes: the first one of each robot, which has the robot's number, then those that go
        up, of robots that need one."""
        joints = [(robot, robot.body.first) for robot in self.robots]
        robots = (self.robots[number] for number in self._lowered)
        joints += [(robot, robot.body.axis(LIFT_JOINT)) for robot in robots]
        return tuple(Axis(AxisId(n), *joint) for n, joint in enumerate(joints))

    @cached_property
    def moves(self) -> tuple[tuple[AxisId, ...], ...]:
        """For each operation the axes that its mode moves: the first ones of its robots, and those
        by which robots go up or down in it. A robot is up but for the operations that it delivers
        to; one that is adjusted stays where it is on a tour."""
        moved = [[*map(AxisId, operation.robots)] for operation in self.operations]
        for robot, axis in self._up.items():
            for tour in self.tours[robot]:
                ends = (tour[0],) if robot in self.adjusted else (tour[0], tour[-1])
                for number in dict.fromkeys(ends):
                    moved[number].append(axis)
        return tuple(map(tuple, moved))

    @cached_property
    def _up(self) -> Mapping[int, AxisId]:
        return {robot: AxisId(len(self.robots) + n) for n, robot in enumerate(self._lowered)}

    def check_rails(self, *whats: str) -> None:
        """Check that every robot has a guidepath, where something is done that needs one.

        Args:
            whats: what is done, in the words of its options.

        Raises InputError (Usage) for a robot whose first axis moves several joints.
        """
        chains = [robot for robot in self.robots if robot.body.first.moves]
        if chains and whats:
            why = f"{chains[0].name} is a '{chains[0].type}', which follows no guidepath"
            message = f"{' and '.join(whats)} cannot be combined with --arm yet: {why}"
            raise usage_error(message, "leave out one of the two")

    def up(self, robot: int) -> AxisId | None:
        """The axis by which a robot (index) goes up and down; None where it stays at its
        height."""
        return self._up.get(robot)

    def goes_up(self, robot: int) -> bool:
        """Whether a robot (index) goes up and down."""
        return robot in self._up

    def lowering(self, robot: int) -> float:
        """How far a robot (index) lowers what it delivers, at most [m]."""
        return self._lowered.get(robot, 0.0)

    def axes_of(self, robot: int) -> list[AxisId]:
        """The axes of a robot (index), its first one first."""
        return [AxisId(robot), *([self._up[robot]] if robot in self._up else [])]

    def chain(self, robot: int) -> list[Axis]:
        """The axes of a robot (index) from its carriage up: each moves all after it, and the body
        of the last one holds what the robot brings."""
        joints = self.robots[robot].body.axes
        return sorted(
            (self.axes[axis] for axis in self.axes_of(robot)),
            key=lambda axis: joints.index(axis.joint),
        )

    def robot_of(self, axis: int) -> RobotId:
        """The robot (index) of an axis."""
        return self.axes[axis].robot.index

    def lowers(self, robot: int) -> bool:
        """Whether a robot (index) lowers what it delivers."""
        return robot in self._lowered and robot not in self.adjusted

    def first(self, robot: int) -> Operation:
        """The first operation of a robot's program."""
        return self.operations[self.robots[robot].operations[0]]

    def last(self, robot: int) -> Operation:
        """The last operation of a robot's program: what it brings is delivered there."""
        return self.operations[self.robots[robot].operations[-1]]

    def begun_by(self, robot: int) -> list[RobotId]:
        """The robots (index) that bring what a robot's tour begins with; none at a feeder."""
        first = self.first(robot)
        return [r for r in first.robots if r != robot] if first.carrier == robot else []

    def sides(self, robot: int) -> set[int]:
        """Sides of the approach axis from which a robot (index) may come to where it delivers."""
        ends = (self.operations[tour[-1]] for tour in self.tours[robot])
        return set.intersection(*(o.sides(robot) for o in ends))

    def tour_kind(self, robot: int) -> tuple[object, ...]:
        """Kind of a robot's (index) tours, alike for all that one robot can do: whether they begin
        at a feeder (`fed`) or take what two robots bring, and how they deliver it."""
        first, end = self.first(robot), self.last(robot).delivery(robot)
        if end[0] == "tool":
            return end
        fed, joins = len(first.robots) == 1, len(first.inputs) > 1
        return ("fed" if fed else "taking", *end) if fed or joins else ("alone", robot)

    def after(self, robot: int, operation: int) -> OperationId:
        """The operation (index) that comes after one in a robot's gear."""
        gear = self.robots[robot].operations
        return gear[(gear.index(OperationId(operation)) + 1) % len(gear)]

    def begins(self, robot: int, operation: int) -> bool:
        """Whether a robot (index) begins a tour with an operation (index)."""
        return any(tour[0] == operation for tour in self.tours[robot])

    def delivers(self, robot: int, operation: int) -> bool:
        """Whether a robot (index) ends a tour with an operation (index)."""
        return any(tour[-1] == operation for tour in self.tours[robot])

    def tour_of(self, robot: int, operation: int) -> tuple[OperationId, ...]:
        """The tour of a robot (index) that an operation (index) is in."""
        return next(tour for tour in self.tours[robot] if operation in tour)

    @cached_property
    def turns(self) -> Mapping[tuple[int, int], int]:
        """Which of the tours of a robot (index) an operation (index) is in, by (operation,
        robot)."""
        return {
            (operation, robot): number
            for robot, tours in enumerate(self.tours)
            for number, tour in enumerate(tours)
            for operation in tour
        }

    def deliveries(self, robot: int) -> tuple[str, ...]:
        """The labels a robot (index) carries to its A end, tour by tour; none for a tool."""
        labels = []
        for tour in self.tours[robot]:
            operation = self.operations[tour[-1]]
            labels.append(operation.before[operation.robots.index(robot)])
        return tuple(label for label in labels if label != NOPART)

    def tour_with(self, robot: int, label: str) -> int:
        """Which of its tours a robot (index) holds a part on, or what it makes of parts."""
        if len(self.tours[robot]) == 1:
            return 0
        parts = {*self.contents.get(label, (label,))}
        brought = [{*self.contents[label]} for label in self.deliveries(robot)]
        return next(number for number, inside in enumerate(brought) if parts <= inside)

    @cached_property
    def takes_wholes(self) -> bool:
        """Whether a robot that moves several joints takes sub-assemblies: it may hold a part
        otherwise within one than when it brought that part to it, so each is one body."""
        chains = (self.tours[robot.index] for robot in self.robots if robot.body.first.moves)
        return any(self.operations[tour[0]].inputs for tours in chains for tour in tours)

    @cached_property
    def joins(self) -> Joins:
        """For the end of each operation its start and the ends of the operations that made its
        inputs: the transitions that are undone as often as the end, since nothing is taken apart
        (the material rule of `factory.apps.recovery.undo`)."""
        made = self.by_label
        return {o.end: (o.start, *(made[x].end for x in o.inputs)) for o in self.operations}

    @cached_property
    def contents(self) -> Mapping[str, tuple[str, ...]]:
        """For each label that is carried: the labels of its parts. Quadratic in a chain; only for
        factories that are built in the engine."""
        parts: dict[str, tuple[str, ...]] = {}
        for operation in reversed(self.making):
            joined = tuple(part for label in operation.inputs for part in parts[label])
            parts[operation.label] = joined or (operation.label,)
        return MappingProxyType(parts)
