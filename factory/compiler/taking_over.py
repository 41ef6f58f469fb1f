"""Taking over: a robot dies, and its deputy does its tours from then on (Theorem 8, exchange).

N' has the operations of N and a robot fewer, or a branch fewer; robots that stay keep their names.
How often each transition has fired is the state, so N' goes on from the greatest counts n' <= n
that lead to a marking of it, where what the robots that are gone had in hand is undone
(`factory.nets.undo`).

Guarantees: N' is a gear train, live, safe and reversible, and n' is reachable in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from factory.compiler.assigning import assigned
from factory.compiler.deputies import Moved, moved_to
from factory.nets.gears import GearNet
from factory.nets.petri import Marking
from factory.nets.undo import exchange, marking_after
from factory.nets.undone import Entry, Undone, exchanges
from factory.nets.verify import proved
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART
from factory.problem.robot_types import Catalogue


@dataclass(frozen=True)
class Takeover:
    """The change from a factory `before` to a factory `after`, in which the robot `dead` (index)
    and its branch are removed and others have their tours (`moved`)."""

    before: Factory
    after: Factory
    dead: int
    moved: Moved

    @cached_property
    def crew(self) -> Factory:
        """`after` with the robot numbers of `before`: removed robots have no operations. Its net
        has the places of that of `after`, in their order."""
        return crew_with(self.before, self.moved)

    @property
    def names(self) -> tuple[str, str]:
        """Names of the dead robot and its deputy."""
        robots = self.before.robots
        return robots[self.dead].name, robots[self.moved[self.dead]].name

    def exchanged(self, fired: Sequence[int], t: float) -> tuple[tuple[int, ...], Undone]:
        """Counts n' after the exchange of the counts n (`fired`, from m_0 on) at time t [s], and
        its entry in the record of the run. Raises RunError (NotProved) if the net of `after` is not
        live."""
        net = self.after.net
        proved(net)
        asked = lost(self.before, fired, self.moved)
        counts = exchange(net, fired, asked, self.after.joins)
        at = _next(self.before, marking_after(self.before.net, fired), self.dead)
        what = t, at.label, "{} is dead, and {} takes its tours".format(*self.names)
        undone = Undone.between(net, what, asked, fired, counts, exchanged=True)
        return counts, replace(undone, robots=self.names)


def taken_over(factory: Factory, dead: int, deputy: int, catalogue: Catalogue) -> Takeover:
    """The change when a deputy takes over for a robot (indices). Raises InputError (BadLine) if it
    is not a deputy."""
    moved = moved_to(factory, dead, deputy, catalogue)
    return Takeover(factory, with_moved(factory, moved), dead, moved)


def nets_after(factory: Factory, entries: Iterable[Entry]) -> Iterator[GearNet]:
    """The nets of a recorded run after each exchange of robots, in order. They are not proved."""
    return (without_gone(crew).net for crew in crews_after(factory, entries))


def crews_after(factory: Factory, entries: Iterable[Entry]) -> Iterator[Factory]:
    """The factories of a recorded run after each exchange of robots, in order, with all robots
    (`crew_with`)."""
    number = {robot.name: robot.index for robot in factory.robots}
    for entry in exchanges(entries):
        dead, deputy = (number[name] for name in entry.robots)
        factory = crew_with(factory, {dead: deputy})
        yield factory


def with_moved(factory: Factory, moved: Moved) -> Factory:
    """The factory with moved tours, without removed robots; it is not checked."""
    return without_gone(crew_with(factory, moved))


def crew_with(factory: Factory, moved: Moved) -> Factory:
    """The factory with moved tours and all its robots; it is not checked. Removed robots have no
    operations, and their lifts stay where they are."""
    robots = factory.robots
    crew = assigned(factory, robots, [[moved.get(robot.index, robot.index) for robot in robots]])
    return replace(crew, adjusted=factory.adjusted | (factory.strokes.keys() & moved.keys()))


def without_gone(factory: Factory) -> Factory:
    """The factory without robots that have no operations; those that stay keep their names."""
    number = {robot: n for n, robot in enumerate(factory.present)}
    robots = [replace(factory.robots[robot], index=n) for robot, n in number.items()]
    every = [[number.get(robot.index, -1) for robot in factory.robots]]
    adjusted = frozenset(number[robot] for robot in factory.adjusted if robot in number)
    return replace(assigned(factory, robots, every), adjusted=adjusted)


def lost(factory: Factory, fired: Sequence[int], robots: Iterable[int]) -> tuple[int, ...]:
    """The transitions that are undone when robots (indices) are removed: all ends that made their
    payloads, once for each copy in their hands, or the start of an operation begun empty-handed.

    The material rule counts the contents of one pile: a part in a pile and another copy of it in
    the next hand are two.
    """
    ends, begun, marking = list[int](), set[int](), marking_after(factory.net, fired)
    for robot in robots:
        o = _next(factory, marking, robot)
        label = o.before[o.robots.index(robot)]
        if label != NOPART:
            ends += _ends_in(factory, label)
        elif fired[o.start] > fired[o.end]:
            begun.add(o.start)
    return (*ends, *sorted(begun))


def _ends_in(factory: Factory, label: str) -> list[int]:
    """The ends of the operations that made a label, the last first."""
    made = [factory.by_label[label]]
    for o in made:
        made += [factory.by_label[label] for label in o.inputs]
    return [o.end for o in made]


def _next(factory: Factory, marking: Marking, robot: int) -> Operation:
    """The operation that a robot is at, or waits for."""
    gear = factory.net.gears[robot].places
    step = next(step for step, place in enumerate(gear) if place in marking)
    return factory.operations[factory.robots[robot].operations[step // 2]]
