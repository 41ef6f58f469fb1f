"""Taking over: a robot dies, and its deputy does its tours from then on (Theorem 8, exchange).

N' has the operations of N and a robot fewer; robots that stay keep their names. How often each
transition has fired is the state, so N' goes on from the greatest counts n' <= n that lead to a
marking of it, where what the robot that is gone had in hand is undone (`factory.nets.undo`).

Guarantees: N' is a gear train, live, safe and reversible, and n' is reachable in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from factory.compiler.assigning import assigned
from factory.nets.gears import GearNet
from factory.nets.petri import Marking
from factory.nets.undo import exchange, marking_after
from factory.nets.undone import Entry, Undone, exchanges
from factory.nets.verify import proved
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART


@dataclass(frozen=True)
class Takeover:
    """The change from a factory `before`, in which the robot `dead` (index) is removed and its
    `deputy` has its tours. `crew`: the factory then, with the robot numbers of `before`; its net
    has the places of that of `after`, in their order."""

    before: Factory
    dead: int
    deputy: int

    @cached_property
    def crew(self) -> Factory:
        return crew_with(self.before, self.dead, self.deputy)

    @cached_property
    def after(self) -> Factory:
        """The factory without the dead robot; it is not checked."""
        return without_gone(self.crew)

    @property
    def names(self) -> tuple[str, str]:
        """Names of the dead robot and its deputy."""
        robots = self.before.robots
        return robots[self.dead].name, robots[self.deputy].name

    def exchanged(self, fired: Sequence[int], t: float) -> tuple[tuple[int, ...], Undone]:
        """Counts n' after the exchange of the counts n (`fired`, from m_0 on) at time t [s], and
        its entry in the record of the run. Raises RunError (NotProved) if the net of `after` is not
        live."""
        net = self.after.net
        proved(net)
        asked = lost(self.before, fired, self.dead)
        counts = exchange(net, fired, asked, self.after.joins)
        at = _next(self.before, marking_after(self.before.net, fired), self.dead)
        what = t, at.label, "{} is dead, and {} takes its tours".format(*self.names)
        undone = Undone.between(net, what, asked, fired, counts, exchanged=True)
        return counts, replace(undone, robots=self.names)


def nets_after(factory: Factory, entries: Iterable[Entry]) -> Iterator[GearNet]:
    """The nets of a recorded run after each exchange of robots, in order. They are not proved."""
    return (without_gone(crew).net for crew in crews_after(factory, entries))


def crews_after(factory: Factory, entries: Iterable[Entry]) -> Iterator[Factory]:
    """The factories of a recorded run after each exchange of robots, in order, with all robots
    (`crew_with`)."""
    number = {robot.name: robot.index for robot in factory.robots}
    for entry in exchanges(entries):
        dead, deputy = (number[name] for name in entry.robots)
        factory = crew_with(factory, dead, deputy)
        yield factory


def crew_with(factory: Factory, dead: int, deputy: int) -> Factory:
    """The factory with the tours of a dead robot moved to its deputy (indices), and all its robots;
    it is not checked. The dead one has no operations, and its lift stays where it is."""
    every = range(len(factory.robots))
    crew = assigned(factory, factory.robots, [[deputy if n == dead else n for n in every]])
    return replace(crew, adjusted=factory.adjusted | (factory.strokes.keys() & {dead}))


def without_gone(factory: Factory) -> Factory:
    """The factory without robots that have no operations; those that stay keep their names."""
    number = {robot: n for n, robot in enumerate(factory.present)}
    robots = [replace(factory.robots[robot], index=n) for robot, n in number.items()]
    every = [[number.get(robot.index, -1) for robot in factory.robots]]
    adjusted = frozenset(number[robot] for robot in factory.adjusted if robot in number)
    return replace(assigned(factory, robots, every), adjusted=adjusted)


def lost(factory: Factory, fired: Sequence[int], robot: int) -> tuple[int, ...]:
    """The transitions that are undone when a robot (index) is removed: all ends that made its
    payload, or the start of an operation begun empty-handed."""
    o = _next(factory, marking_after(factory.net, fired), robot)
    label = o.before[o.robots.index(robot)]
    if label != NOPART:
        return (*_ends_in(factory, label),)
    return (o.start,) if fired[o.start] > fired[o.end] else ()


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
