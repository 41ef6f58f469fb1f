"""The stops of a robot: where it stands for its operations, and their order along its way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from heapq import heappop, heappush

from factory.support.errors import Diagnostic, InputError
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation


@dataclass(frozen=True, slots=True)
class Stop:
    """Where a robot stands for one operation or, on a line, for several: those to which the same
    robots deliver.

    Attributes:
        operations: the operations.
        visits: how often it comes there from another stop, in all its tours but those that are
            the same for another unit of a period.
        guests: the robots whose guidepaths end there.
    """

    operations: tuple[Operation, ...]
    visits: int = 1
    guests: tuple[int, ...] = ()

    @property
    def first(self) -> Operation:
        """The operation that is first in the robot's program."""
        return self.operations[0]

    @property
    def unlike(self) -> tuple[Operation, ...]:
        """The operations without those that are the same for another unit."""
        return tuple({operation.written: operation for operation in self.operations}.values())

    @property
    def joins(self) -> bool:
        """Whether something is added there to what the robot holds."""
        return any(len(operation.inputs) > 1 for operation in self.operations)


def stops_of(factory: Factory, robot: int) -> tuple[tuple[Stop, ...], bool]:
    """The stops of a robot for the operations after which it carries something, in an order in
    which it goes ahead from one to the next on each of its tours; and whether there is none because
    it returns to some: then in the order of first visits. Raises InputError (Layout) as
    `guests_of`."""
    kept = frozenset(carried(factory, robot))
    tours = [
        [(_where(factory.operations[n], robot), factory.operations[n]) for n in tour if n in kept]
        for tour in factory.tours[robot]
    ]
    at_stop, arrivals, onward = (
        dict[Hashable, list[Operation]](),
        set[tuple[Hashable, str]](),
        set(),
    )
    for tour in tours:
        before: Hashable = None
        for where, operation in tour:
            at_stop.setdefault(where, []).append(operation)
            if where != before:
                arrivals.add((where, operation.written))
            if before is not None:
                onward.add((before, where))
            before = where
    visits = Counter(where for where, _ in arrivals)
    order = _ordered(at_stop, onward)
    stops = tuple(
        Stop(tuple(at_stop[where]), visits[where], guests_of(factory, at_stop[where][0]))
        for where in order or at_stop
    )
    return stops, not order


def _where(operation: Operation, robot: int) -> Hashable:
    """The key of an operation's stop: the others that come there, if any."""
    return frozenset(operation.robots) - {robot} or (operation.written if operation.inputs else "")


def _ordered(
    things: Iterable[Hashable], pairs: Iterable[tuple[Hashable, Hashable]]
) -> list[Hashable]:
    """Things in an order in which the first of each pair precedes the second, otherwise stable;
    empty if there is none."""
    things = [*things]
    numbers = {thing: number for number, thing in enumerate(things)}
    waits, after = [0] * len(things), list[list[int]]([] for _ in things)
    for one, other in pairs:
        after[numbers[one]].append(numbers[other])
        waits[numbers[other]] += 1
    ready, order = [n for n, count in enumerate(waits) if not count], list[Hashable]()
    while ready:
        number = heappop(ready)
        order.append(things[number])
        for other in after[number]:
            waits[other] -= 1
            if not waits[other]:
                heappush(ready, other)
    return order if len(order) == len(things) else []


def carried(factory: Factory, robot: int) -> list[int]:
    """The operations of a robot after which it carries something, in its gear's order."""
    return [
        number
        for number in factory.robots[robot].operations
        if factory.operations[number].carrier == robot and not factory.drops(number)
    ]


def guests_of(factory: Factory, operation: Operation) -> tuple[int, ...]:
    """The robots whose guidepaths end at the station of an operation: those that deliver to its
    carrier, and those that bring something to one of these that is fixed. Raises InputError
    (Layout) where the layout cannot have them: two guidepaths can end at one point of a third, one
    from each side; a third cannot."""
    if not factory.robots[operation.carrier].travels:
        return ()
    guests = [robot for robot in operation.robots if robot != operation.carrier]
    goals = operation.template.law.goals
    away = any(goals[operation.robots.index(guest)].end != "A" for guest in guests)
    for guest in [robot for robot in guests if not factory.robots[robot].travels]:
        gear = (factory.operations[number] for number in factory.robots[guest].operations)
        bringing = (r for o in gear if o.carrier == guest for r in o.robots if r != guest)
        guests += dict.fromkeys(bringing)
    if len(guests) <= 2 and not away:
        return tuple(guests)
    message, hint = (
        f"{len(guests)} guidepaths would end at one point of the carrier's",
        "give further inputs to another template (further = insert), two at a point at most",
    )
    if away:
        message = "a robot that is not the carrier has its goal away from A"
        hint = "write its goal as A + 2r: its guidepath ends where it meets the carrier"
    position = operation.template.position or operation.position
    raise InputError(Diagnostic("Layout", f"'{operation.label}': {message}", position, hint))
