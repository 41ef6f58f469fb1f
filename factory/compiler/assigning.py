"""Assignments: which robot does which tour, unit by unit. Every variant of a factory follows from
one.

A factory as Compile makes it has one *tour* a robot, from empty hands to empty hands. A *period*
has one turn or several, a unit is made in each, and an assignment gives for each turn and each
robot of that factory the robot that does its tours. Each robot does what it has, turn by turn, in
the *postorder* of the operations, the pile first. That order depends on what is made, not on the
robots that make it, and is a witness (Theorem 1): every program ascends in it, so the net is live
whatever is assigned (Theorem 2). Which assignments robots can do, where they stand, is what
`folding`, `parallel` and `deputies` say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from factory.compiler.gearing import gear_net
from factory.plant.approaches import Overlap
from factory.plant.factory import Factory, Operation, Robot, in_turn
from factory.problem.pag import NOPART
from factory.problem.plan import Plan
from factory.problem.robot_types import LIFT, Catalogue
from factory.support.errors import Diagnostic, InputError


def assigned(base: Factory, robots: Sequence[Robot], turns: Sequence[Sequence[int]]) -> Factory:
    """The factory with these `robots`, whose programs are made anew, where in turn t robot
    `turns[t][r]` (index) does the tours of robot r of `base`. Near-linear."""
    period, when = len(turns), base.postorder
    makes, drops = range(len(base.making)), range(len(base.making), len(base.operations))
    every = ((o, turn) for part in (makes, drops) for turn in range(period) for o in part)
    number = {unit: n for n, unit in enumerate(every)}
    operations = tuple(
        _for_unit(o := base.operations[i], n, turn * base.period + o.turn, turns[turn])
        for (i, turn), n in number.items()
    )
    programs: list[list[int]] = [[] for _ in robots]
    tours = sorted(
        (when[tour[-1]], robot, tour) for robot, own in enumerate(base.tours) for tour in own
    )
    for turn, does in enumerate(turns):
        for _, robot, tour in tours:
            programs[does[robot]] += [number[o, turn] for o in tour]
    crew = tuple(
        replace(robot, operations=tuple(program))
        for robot, program in zip(robots, programs, strict=True)
    )
    parents = [number[base.parents[o], turn] if base.parents[o] >= 0 else -1 for o, turn in number]
    return replace(
        base,
        robots=crew,
        operations=operations,
        net=gear_net(crew, operations),
        parents=tuple(parents),
        plan=base.plan.then(turns),
        period=base.period * period,
    )


def shared(base: Factory, plan: Plan, catalogue: Catalogue) -> Factory:
    """The factory of a plan, from that with a robot for each tour. The type of each robot fits all
    its tours. Raises InputError (BadPlan) where the tours or robots of the plan are others."""
    if not plan.turns:
        return base
    tours = range(len(base.robots))
    if any(len(turn) != len(tours) for turn in plan.turns):
        raise _bad(f"each turn must name a robot for each of {len(tours)} tours")
    every = range(1 + max(map(max, plan.turns)))
    for turn in plan.turns:
        for o in base.operations:
            if len({turn[robot] for robot in o.robots}) < len(o.robots):
                raise _bad(f"a robot cannot take two parts in '{o.label}'")
    types, first = dict[int, str](), dict[int, Robot]()
    for tour in tours:
        own = base.robots[tour]
        for robot in dict.fromkeys(turn[tour] for turn in plan.turns):
            first.setdefault(robot, own)
            kind = types.setdefault(robot, own.type)
            types[robot] = catalogue.meet(kind, own.type) or kind
    if len(types) < len(every):
        raise _bad(f"{len(every)} robots are named, and {len(types)} have tours")
    lifts = plan.lifts or frozenset()
    if lifts - {*every}:
        raise _bad(f"r{max(lifts) + 1} has a lift, and there are {len(every)} robots")
    for robot in lifts:
        types[robot] = catalogue.meet(types[robot], LIFT) or LIFT
    robots = [replace(first[n], index=n, name=f"r{n + 1}", type=types[n]) for n in every]
    made = assigned(base, robots, plan.turns)
    return replace(made, plan=plan, adjusted=lifts)


def _bad(words: str) -> InputError:
    return InputError(Diagnostic("BadPlan", f"the plan is not of this product: {words}"))


def _for_unit(o: Operation, index: int, unit: int, does: Sequence[int]) -> Operation:
    """An operation for a unit of a period; `does`: for each of its robots who does its tours."""
    robots = tuple(does[robot] for robot in o.robots)
    if unit == o.turn:
        return replace(o, index=index, robots=robots)

    def named(label: str) -> str:
        return label if label == NOPART else in_turn(label.removesuffix(in_turn("", o.turn)), unit)

    def overlapping(overlap: Overlap) -> Overlap:
        one, other = overlap.parts
        return replace(overlap, parts=(named(one), named(other)))

    before, after = (tuple(map(named, labels)) for labels in (o.before, o.after))
    approach = o.approach and replace(
        o.approach,
        lowered=o.approach.lowered and named(o.approach.lowered),
        overlaps=tuple(tuple(map(overlapping, side)) for side in o.approach.overlaps),
    )
    return replace(
        o,
        index=index,
        label=named(o.label),
        robots=robots,
        before=before,
        after=after,
        approach=approach,
        turn=unit,
    )
