"""Assignments: which robot does which tour, unit by unit, and the net of gears that follows. Every
variant of a factory follows from one.

A factory as Compile makes it has one *tour* a robot, from empty hands to empty hands. A *period*
has one turn or several, a unit is made in each, and an assignment gives for each turn and each
robot of that factory the robot that does its tours. Each robot does what it has, turn by turn, in
the *postorder* of the operations, the pile first. That order depends on what is made, not on the
robots that make it, and is a witness (Theorem 1): every program ascends in it, so the net is live
whatever is assigned (Theorem 2). Which assignments robots can do, where they stand, is what
`folding` and `parallel` say.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import accumulate

from factory.support.errors import Diagnostic, InputError
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.nets.threaded import Redistribution, Slot, ThreadedNet
from factory.theory.plant.factory import NO_PARENT, Factory
from factory.theory.plant.gripping import with_closing
from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.ids import OperationId, PlaceId, RobotId, TransitionId
from factory.theory.problem.pag import NOPART, PAG
from factory.theory.problem.plan import Plan, in_turn, out_of_turn
from factory.theory.problem.robot_types import LIFT, Catalogue

Events = tuple[TransitionId, ...]
"""Transitions before or after a place."""


def gear_net(robots: tuple[Robot, ...], operations: tuple[Operation, ...]) -> GearNet:
    """N: for each operation a start, an end and a place; for each robot a gear through them.

    Operation i has transitions 2i and 2i + 1 and place i; the wait places follow, robot by robot,
    as `r2:part1`. The empty-handed waits of a robot with several tours are told apart by the
    operation to come, `r2:nopart/part3`.
    """
    net, redistribution, gears, slots = _wired(robots, operations)
    initial = tuple(gear.places[0] for gear in gears)
    return GearNet(ThreadedNet(net, redistribution), gears, initial, slots)


Wired = tuple[
    PetriNet, tuple[Redistribution, ...], tuple[Gear, ...], tuple[tuple[RobotId, ...], ...]
]
"""A net with its redistribution functions, its gears, and the slots of its places."""


def _wired(robots: Sequence[Robot], operations: Sequence[Operation]) -> Wired:
    """What `gear_net` is made of: nothing else of its wiring is kept."""
    wiring = _Wiring(operations)
    for robot in robots:
        wiring.add(robot)
    net = PetriNet(wiring.transitions, tuple(wiring.places))
    return net, wiring.redistribution(), tuple(wiring.gears), tuple(wiring.slots)


class _Wiring:
    """The net of `gear_net` so far: `places` with their `slots`, and `gears`. For each operation:
    the slots of its place (`acting`), what is moved there at its start, robot by robot (`begun`),
    and where what is there is moved to at its end (`ended`)."""

    def __init__(self, operations: Sequence[Operation]) -> None:
        self.operations = operations
        self.transitions = tuple(
            [Transition(f"{o.label}_{end}", o.position) for o in operations for end in ("s", "e")]
        )
        numbers = [(TransitionId(event),) for event in range(len(self.transitions))]
        self.starts, self.ends = numbers[::2], numbers[1::2]  # each made once
        self.places = [*map(self._place, operations, self.starts, self.ends)]
        self.slots = [o.robots for o in operations]
        self.acting = [[(o.place, i) for i in range(len(o.robots))] for o in operations]
        self.begun: list[list[tuple[Slot, Slot]]] = [[] for _ in operations]
        self.ended = [[*slots] for slots in self.acting]
        self.gears: list[Gear] = []

    @staticmethod
    def _place(o: Operation, start: Events, end: Events) -> Place:
        """The place of an operation."""
        label = "" if o.after[o.template.carrier - 1] == NOPART else o.label
        return Place(o.label, start, end, o.template.name, label, len(o.robots), o.position)

    def add(self, robot: Robot) -> None:
        """Add the gear of a robot, with a wait before each of its operations."""
        program = [self.operations[number] for number in robot.operations]
        roles = [o.robots.index(robot.index) for o in program]
        held = [o.before[role] for o, role in zip(program, roles, strict=True)]
        several, alone = held.count(NOPART) > 1, (robot.index,)
        last, left = program[-1], roles[-1]
        places, events = list[PlaceId](), list[TransitionId]()
        for o, role, label in zip(program, roles, held, strict=True):
            done, start, acting = self.ends[last.index], self.starts[o.index], self.acting[o.index]
            mode = "hold" if label != NOPART != o.after[role] else "wait"
            name = f"{robot.name}:{label}"
            if several and label == NOPART:
                name += f"/{o.label}"
            wait = PlaceId(len(self.places))
            self.places.append(Place(name, done, start, mode, label, 1, o.position))
            self.slots.append(alone)
            waiting = wait, 0
            self.begun[o.index].append((waiting, acting[role]))
            self.ended[last.index][left] = waiting
            places += wait, acting[role][0]
            events += done + start
            last, left = o, role
        self.gears.append(Gear(robot.name, robot.type, tuple(places), tuple(events)))

    def redistribution(self) -> tuple[Redistribution, ...]:
        """d_e of each event, once all robots are added."""
        ended = map(zip, self.acting, self.ended)
        both = zip(self.begun, ended, strict=True)
        return tuple([tuple(pairs) for events in both for pairs in events])


def beside(pag: PAG, factories: Sequence[Factory]) -> Factory:
    """The factory of a mix whose products are made by factories that share no robot: in a period
    each makes one unit."""
    parts = [(unit, o) for unit, one in enumerate(factories) for o in one.making]
    parts += [(unit, one.dropoff) for unit, one in enumerate(factories)]
    number = {(unit, o.index): OperationId(n) for n, (unit, o) in enumerate(parts)}
    firsts = [0, *accumulate(len(one.robots) for one in factories)]
    operations = tuple(
        for_unit(o, n, unit, range(firsts[unit], firsts[unit + 1]))
        for n, (unit, o) in enumerate(parts)
    )
    robots = tuple(
        replace(
            robot,
            index=RobotId(firsts[unit] + robot.index),
            name=f"r{firsts[unit] + robot.index + 1}",
            operations=tuple(number[unit, i] for i in robot.operations),
        )
        for unit, one in enumerate(factories)
        for robot in one.robots
    )
    return replace(
        factories[0],
        pag=pag,
        robots=robots,
        operations=operations,
        net=gear_net(robots, operations),
        parents=tuple(number.get((u, factories[u].parents[o.index]), NO_PARENT) for u, o in parts),
        period=len(factories),
    )


def assigned(base: Factory, robots: Sequence[Robot], turns: Sequence[Sequence[int]]) -> Factory:
    """The factory with these `robots` and new programs: in turn t robot `turns[t][r]` (index) does
    the tours of robot r of `base`, NOBODY those of a product that is not made in this turn.
    Near-linear."""
    when, outputs = base.postorder, [dropoff.carrier for dropoff in base.dropoffs]
    made = ((t, u) for t, does in enumerate(turns) for u, r in enumerate(outputs) if does[r] >= 0)
    unit = {one: n for n, one in enumerate(made)}
    makes, drops = range(len(base.making)), range(len(base.making), len(base.operations))
    every = ((o, turn) for part in (makes, drops) for turn in range(len(turns)) for o in part)
    each = ((i, turn) for i, turn in every if (turn, base.operations[i].turn) in unit)
    number = {one: OperationId(n) for n, one in enumerate(each)}
    each_made = (
        for_unit(o := base.operations[i], n, unit[turn, o.turn], turns[turn])
        for (i, turn), n in number.items()
    )
    operations = with_closing(each_made, robots)
    programs: list[list[OperationId]] = [[] for _ in robots]
    tours = sorted(
        (when[tour[-1]], robot, tour)
        for robot, tours_of in enumerate(base.tours)
        for tour in tours_of
    )
    for turn, does in enumerate(turns):
        for _, robot, tour in (one for one in tours if does[one[1]] >= 0):
            programs[does[robot]] += [number[o, turn] for o in tour]
    crew = tuple(
        replace(robot, operations=tuple(program))
        for robot, program in zip(robots, programs, strict=True)
    )
    parents = [
        number[base.parents[o], turn] if base.parents[o] >= 0 else NO_PARENT for o, turn in number
    ]
    return replace(
        base,
        robots=crew,
        operations=operations,
        net=gear_net(crew, operations),
        parents=tuple(parents),
        plan=base.plan.then(turns),
        period=len(unit),
    )


def shared(base: Factory, plan: Plan, catalogue: Catalogue) -> Factory:
    """The factory of a plan, made from that with a robot for each tour. The type of each robot fits
    all its tours. Raises InputError (BadPlan) if the plan does not have these tours or robots."""
    if not plan.turns:
        if any(robot >= len(base.robots) for tee in plan.tees for robot in tee):
            raise _bad(f"its tees name more than {len(base.robots)} robots")
        return named(replace(base, plan=replace(base.plan, tees=plan.tees)), plan.names)
    tours = range(len(base.robots))
    if any(len(turn) != len(tours) for turn in plan.turns):
        raise _bad(f"each turn must name a robot for each of {len(tours)} tours")
    if any(max(turn) == Plan.NOBODY for turn in plan.turns):
        raise _bad("a turn makes no product")
    every = range(1 + max(map(max, plan.turns)))
    for turn in plan.turns:
        for o in base.operations:
            does = {turn[robot] for robot in o.robots}
            together = does | {turn[base.dropoffs[o.turn].carrier]}
            if Plan.NOBODY in together and len(together) > 1:
                raise _bad(f"nobody does some of the tours of '{base.products[o.turn]}' in a turn")
            if Plan.NOBODY not in does and len(does) < len(o.robots):
                raise _bad(f"a robot cannot take two parts in '{o.label}'")
            lines = [robot for robot in o.robots if not base.robots[robot].body.first.moves]
            if o.carrier in lines and any(turn[robot] < turn[o.carrier] for robot in lines):
                raise _bad(f"in '{o.label}' a robot comes to one that is numbered after it")
    busy = {robot for turn in plan.turns for robot in turn} - {Plan.NOBODY}
    if len(busy) < len(every):
        raise _bad(f"{len(every)} robots are named, and {len(busy)} have tours")
    lifts = plan.lifts or frozenset()
    if lifts - {*every}:
        raise _bad(f"r{max(lifts) + 1} has a lift, and there are {len(every)} robots")
    made = with_crew(base, plan.turns, catalogue, lifts)
    return named(replace(made, plan=plan, adjusted=lifts), plan.names)


def with_crew(
    base: Factory,
    turns: Sequence[Sequence[int]],
    catalogue: Catalogue,
    lifts: Collection[int] = (),
) -> Factory:
    """The factory in which in turn t robot `turns[t][r]` of a crew r1, r2, ... does the tours of
    robot r of `base`. The type of each fits all its tours, and has a lift for those of `lifts`."""
    crew = dict[int, Robot]()
    for tour, robot in enumerate(base.robots):
        for n in dict.fromkeys(turn[tour] for turn in turns if turn[tour] != Plan.NOBODY):
            kind = crew[n].type if n in crew else robot.type
            kind = catalogue.meet(kind, robot.type) or kind
            of = crew.get(n, robot)
            crew[n] = replace(of, index=RobotId(n), name=f"r{n + 1}", kind=catalogue[kind])
    for n in lifts:
        crew[n] = replace(crew[n], kind=catalogue[catalogue.meet(crew[n].type, LIFT) or LIFT])
    return assigned(base, [crew[n] for n in sorted(crew)], turns)


def named(factory: Factory, names: Sequence[str]) -> Factory:
    """The factory whose robots have other names; itself without any. Raises InputError (BadPlan) if
    there is not one for each."""
    if not names:
        return factory
    if len(names) != len(factory.robots):
        raise _bad(f"it names {len(names)} robots, and there are {len(factory.robots)}")
    both = zip(factory.robots, names, strict=True)
    robots = tuple(replace(robot, name=name) for robot, name in both)
    net, plan = gear_net(robots, factory.operations), replace(factory.plan, names=tuple(names))
    return replace(factory, robots=robots, net=net, plan=plan)


def _bad(words: str) -> InputError:
    return InputError(Diagnostic("BadPlan", f"the plan is not of this product: {words}"))


def for_unit(o: Operation, index: int, unit: int, does: Sequence[int]) -> Operation:
    """A copy of an operation for a unit of a period; `does`: the robot that does the tours of each
    robot."""
    robots = tuple(RobotId(does[robot]) for robot in o.robots)
    if unit == o.turn:
        return replace(o, index=OperationId(index), robots=robots)

    def named(label: str) -> str:
        return label if label == NOPART else in_turn(out_of_turn(label, o.turn), unit)

    before, after = (tuple(map(named, labels)) for labels in (o.before, o.after))
    approach = o.approach and o.approach.renamed(named)
    return replace(
        o,
        index=OperationId(index),
        label=named(o.label),
        robots=robots,
        before=before,
        after=after,
        approach=approach,
        turn=unit,
    )
