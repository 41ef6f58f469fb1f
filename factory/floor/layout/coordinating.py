"""The coordinated net of a layout: its compiled net with passes, hands that wait for each other,
magazines and the tray (`theory/nets/coordinated.py`).

Operations are ordered as when one unit is made alone. So a sequence in which each transition fires
once stays possible, and no circuit is free of tokens.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

from factory.floor.layout.certificate import Precedence
from factory.floor.layout.feeding import passing
from factory.floor.layout.hands.leaving import raised
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.theory.nets.coordinated import CoordinatedNet, Coordination, Past
from factory.theory.nets.gears import GearNet
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import RobotId, TransitionId, carriage_axis, start_of

HOME = 1e-3
"""A robot is at home within this [m]."""


@dataclass(frozen=True, slots=True)
class Served:
    """The steps of a magazine for the part of an operation, as places of the coordinated net.

    Attributes:
        before: the operation (index) that takes the part before.
        up: the slider goes up after that part.
        top: the slider is up.
        down: the slider comes down with this part.
    """

    before: int
    up: int
    top: int
    down: int


@dataclass(frozen=True)
class Coordinated(CoordinatedNet):
    """The coordinated net of a layout.

    Attributes:
        served: by the operation (index) that takes a part from a magazine, the steps of the
            magazine.
        away: by dropoff (index), the place in which the tray is away.
    """

    served: Mapping[int, Served] = field(default_factory=dict, repr=False)
    away: Mapping[int, int] = field(default_factory=dict, repr=False)

    @cached_property
    def rising(self) -> Mapping[int, tuple[int, ...]]:
        """By the start of an operation that waits for sliders to be up, the operations (index)
        after whose parts they go up."""
        net, waits = self.net, dict[int, tuple[int, ...]]()
        above = {net.right[one.up]: one.before for one in self.served.values()}
        tops = {one.top for one in self.served.values()}
        for place, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
            if before in above and place not in tops:
                waits[after] = (*waits.get(after, ()), above[before])
        return waits


@dataclass(frozen=True, slots=True)
class _Feeding:
    """Two consecutive parts of a magazine, by the operations that take them; whether a run begins
    with the second; and the pass by which the robot must be out of the way in between, None if it
    is as soon as it has delivered."""

    before: Operation
    leaf: Operation
    begins: bool
    past: Past | None


def with_machines(
    layout: Layout, passes: Iterable[Past], orders: Sequence[Precedence] = ()
) -> Coordinated:
    """The coordinated net of a layout with bodies: with passes of robots on their way home, and the
    order places that keep machines apart."""
    factory, build = layout.factory, Coordination(layout.factory.net)
    feedings, lifted = [*_feedings(layout)], [*_lifted(layout)]
    every = dict.fromkeys(feeding.past for feeding in feedings if feeding.past is not None)
    every |= dict.fromkeys([*(past for past, _ in lifted), *passes])
    by_way = sorted(every, key=lambda past: _way_of(layout, past))
    names = _named(layout, every)
    for (after, robot, _), along in groupby(by_way, key=lambda past: _way_of(layout, past)[:3]):
        passes = {past: names[past] for past in along}
        _chain(layout, build, (factory.operation_of(after), robot), passes, orders)
    for past, number in lifted:
        before, operation = factory.operation_of(past.after), factory.operations[number]
        robot = layout.factory.robot_of(past.axis)
        name = f"order:{before.label}:{_axis(layout, past)}:{operation.label}"
        first = factory.robots[robot].operations[0]
        build.order(name, past, operation.start, int(first == number))
    served: dict[int, Served] = {one.leaf.index: _served(layout, build, one) for one in feedings}
    away = dict[int, int]()
    for step, dropoff in enumerate(factory.dropoffs):
        then = factory.dropoffs[(step + 1) % factory.period]
        name, ends = f"tray:{dropoff.label}", (dropoff.end, then.start)
        away[dropoff.index] = build.place(name, ends, int(then.turn == 0), "tray", dropoff.label)
    for order in orders:
        build.precede(order.name, (order.before, order.start), order.tokens)
    return _of(build, served, away)


def without_bodies(net: GearNet) -> Coordinated:
    """The coordinated net of a factory without bodies: the compiled one."""
    return _of(Coordination(net), {}, {})


def _of(build: Coordination, served: Mapping[int, Served], away: Mapping[int, int]) -> Coordinated:
    made = build.built()
    return Coordinated(made.net, made.passes, made.beside, made.orders, served, away)


def _way_of(layout: Layout, past: Past) -> tuple[TransitionId, RobotId, bool, float]:
    """The transition that a pass follows, its robot, and the order in which the robot passes
    points: its lift first if that has to be up before it goes home."""
    robot = layout.factory.robot_of(past.axis)
    return past.after, robot, past.axis == carriage_axis(robot), past.at * past.direction


def _lifted(layout: Layout) -> Iterator[tuple[Past, int]]:
    """The lifts that must be up before their robots go home, since their hands are above what they
    released: the pass, and the operation (index) that leads home."""
    for robot, tours in enumerate(layout.factory.tours):
        if rises_first(layout, robot):
            for last, tour in zip((*tours[-1:], *tours), tours, strict=False):
                yield raised(layout, robot, last[-1]), tour[0]


def _axis(layout: Layout, past: Past) -> str:
    """The name of a pass's axis: that of its robot, with `up` for a lift."""
    robot = layout.factory.robots[layout.factory.robot_of(past.axis)]
    return robot.name if past.axis == carriage_axis(robot.index) else f"{robot.name} up"


def _named(layout: Layout, passes: Iterable[Past]) -> dict[Past, str]:
    """The names of passes: those of one axis and operation are numbered as they are found, so that
    further ones change no name."""
    names, count = dict[Past, str](), Counter[tuple[str, str]]()
    for past in passes:
        axis, label = _axis(layout, past), layout.factory.operation_of(past.after).label
        count[axis, label] += 1
        names[past] = f"past:{axis}:{count[axis, label]}:{label}"
    return names


def _chain(
    layout: Layout,
    build: Coordination,
    who: tuple[Operation, int],
    names: Mapping[Past, str],
    orders: Sequence[Precedence],
) -> None:
    """The passes of a robot that follow one transition of an operation: in that, or after its end
    until the start of the robot's next, or its end where that leads beyond them all and waits for
    none of them."""
    factory, (operation, robot), passes = layout.factory, who, [*names]
    name = factory.robots[robot].name
    if passes[0].after == operation.start:
        kind = "way", f"of {name} from its feeder"
        build.chain(names, kind, operation.end, operation.place)
        return
    kind = "hand", f"of {name} over {operation.label}"
    gear = factory.robots[robot].operations
    step = (gear.index(operation.index) + 1) % len(gear)
    then, wait = factory.operations[gear[step]], factory.net.gears[robot].waiting(step)
    goals = dict(zip(factory.moves[then.index], layout.goals(then.index), strict=True))
    start, events = build.transitions[then.start].name, {*names.values()}
    waits = any(order.start == start and order.before in events for order in orders)
    beyond = not waits and all(p.axis in goals and p.holds(goals[p.axis]) for p in passes)
    build.chain(names, kind, then.end if beyond else then.start, wait)


def _feedings(layout: Layout) -> Iterator[_Feeding]:
    """The consecutive pairs of parts of all magazines."""
    factory = layout.factory
    for robot, tours in enumerate(factory.tours):
        hand, length = layout.hand(robot), layout.guidepaths[robot].length
        fed = [n for n, tour in enumerate(tours) if not factory.operations[tour[0]].inputs]
        for step, turn in enumerate(fed):
            before, leaf = tours[fed[step - 1]], factory.operations[tours[turn][0]]
            if hand is not None and hand.first:
                last = factory.operations[tours[turn - 1][-1]]
                past: Past | None = Past(last.end, carriage_axis(robot), length - HOME)
            else:
                clear = length - passing(layout, leaf)
                legs = (start_of(n) for n in before if layout.visits[n, robot].at <= clear)
                past = next((Past(start, carriage_axis(robot), clear, -1) for start in legs), None)
            yield _Feeding(factory.operations[before[0]], leaf, not step, past)


def _served(layout: Layout, build: Coordination, feeding: _Feeding) -> Served:
    """The gear of a magazine from one part to the next."""
    before, leaf, past = feeding.before, feeding.leaf, feeding.past
    tour = layout.factory.tour_of(leaf.carrier, before.index)
    down = build.transition(f"down:{leaf.label}")
    above = build.transition(f"up:{before.label}")
    label, clear = leaf.label, layout.factory.operations[tour[-1]].end
    up = build.place(f"magazine up:{label}", (before.end, above), 0, "magazine", label)
    top = build.place(f"magazine top:{label}", (above, down), 0, "magazine", label)
    way = build.events[past] if past is not None else clear, down
    build.place(f"clear:{label}", way, 0, "order", f"clear:{label}")
    shown = down, leaf.start
    return Served(
        before.index,
        up,
        top,
        build.place(f"magazine down:{label}", shown, int(feeding.begins), "magazine", label),
    )
