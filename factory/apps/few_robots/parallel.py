"""Parallel stations: branches of a factory that are there several times, and serve in turn.

The product is unrolled: a *period* has k units, each with operations of its own, `x` for the first,
`x@2`, `x@3` for the next. A robot outside the branch does its program for one unit after the other;
the branch that makes and brings a label is there k times, the j-th for the j-th unit of each
period. It delivers to the same robot, at a station of its own; or two of them at the station where
that robot begins, over a tee (`tees`).

This is a fold of k units (`folding`): the tours of a period are assigned to lines, and each robot
does them in the order in which its carrier asks for them. So the net is a gear train, live, safe
and reversible, and products keep their order. Theorem 4: the cycle time is the greater of the ratio
of the rest and that of the branch, divided by k.

Guarantees: so, or it is refused (Parallel).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from math import lcm

from factory.api import NOPART, Diagnostic, Factory, InputError, Plan, Settings
from factory.apps.few_robots.tees import ROOM
from factory.support.errors import Position, did_you_mean

Branches = Sequence[tuple[str, int]]
"""Labels, and how often the branch that brings each is to be there."""


def in_parallel(factory: Factory, branches: Branches) -> Plan:
    """The plan with branches that are there several times. Raises InputError (Parallel) with
    everything that forbids it."""
    faults = [*_faults(factory, branches)]
    if faults:
        raise InputError(faults)
    times = {_brings(factory, label): k for label, k in branches}
    lines: list[int] = []  # how many robots stand for each
    for robot in factory.robots:
        above = lines[factory.last(robot.index).carrier] if lines else 1
        lines.append(above * times.get(robot.index, 1))
    period = lcm(*lines)
    most = Settings.MOST_BRANCHES
    if (units := period * factory.period) > most:
        names = ", ".join(f"{label} = {k}" for label, k in branches)
        message = f"{names} would make {units} units in one period; {most} are the most"
        raise InputError(_fault(message, None, "take numbers with a small common multiple"))
    if period == 1:
        return factory.plan
    first = [0, *accumulate(lines)]
    return factory.plan.then(
        [[first[r] + t % count for r, count in enumerate(lines)] for t in range(period)]
    )


def _brings(factory: Factory, label: str) -> int:
    """The robot that brings a label to another, -1 for none."""
    robots = (
        robot
        for o in factory.making
        for robot, brought in zip(o.robots, o.before, strict=True)
        if brought == label and robot != o.carrier
    )
    return next(robots, -1)


def _faults(factory: Factory, branches: Branches) -> Iterator[Diagnostic]:
    """What forbids that these branches are there several times."""
    times: dict[int, tuple[str, int]] = {}
    taken = [o.label for o in factory.operations if "@" in o.written]
    for label, k in branches:
        robot = _brings(factory, label)
        if robot < 0:
            yield _not_brought(factory, label)
            continue
        other, number = times.setdefault(robot, (label, k))
        if (other, number) != (label, k):
            message = f"one robot brings both '{other}' ({number} branches) and '{label}' ({k})"
            yield _fault(message, factory.robots[robot].position, "name one of the two")
        if k > 1:
            yield from _not_inserted(factory, robot, k)
    yield from _within_tees(factory, {r: label for r, (label, k) in times.items() if k > 1})
    if taken and any(k > 1 for _, k in branches):
        message = f"the label '{taken[0]}' is reserved for further units"
        position = factory.by_label[taken[0]].position
        yield _fault(message, position, "give it a name without '@'")


def _within_tees(factory: Factory, several: Mapping[int, str]) -> Iterator[Diagnostic]:
    """Robots that are to be there `several` times, by the label that each brings, in a branch that
    comes over a tee."""
    for robot, label in several.items():
        above = robot
        while above and (above := factory.last(above).carrier) not in several:
            pass
        if above in several and factory.last(above).pile == NOPART:
            message = f"'{label}' is in the branch of '{several[above]}', which comes over a tee"
            position = factory.robots[robot].position
            yield _fault(message, position, "take more branches of one of the two")


def _not_brought(factory: Factory, label: str) -> Diagnostic:
    """Why the branch of a label cannot be there several times that no robot brings to another."""
    made = factory.by_label.get(label)
    if made is None or factory.drops(made.index):
        labels = [o.label for o in factory.making]
        return _fault(f"there is no label '{label}'", None, did_you_mean(label, labels, "labels"))
    robot = made.carrier
    if robot == 0:
        message = f"'{label}' is made by the output robot, of which there is only one"
        hint = "let a third robot carry the slow sub-assembly, by `mate`"
        return _fault(message, made.position, hint)
    brought = factory.deliveries(robot)[0]
    message = f"no robot brings '{label}' to another: it becomes '{brought}' on its robot"
    return _fault(message, made.position, f"name '{brought}'")


def _not_inserted(factory: Factory, robot: int, k: int) -> Iterator[Diagnostic]:
    """Deliveries of a robot that do not admit k branches."""
    for tour in factory.tours[robot]:
        o = factory.operations[tour[-1]]
        label = o.before[o.robots.index(robot)]
        hint = f"write it with `insert`, '{label}' last: then there is a station for each branch"
        if o.pile == NOPART and k > ROOM:
            message = (
                f"'{label}' comes to the start of a robot's path in '{o.label}', where there is"
                f" room for {ROOM} branches, on a tee"
            )
            yield _fault(message, o.position, hint)
        elif o.pile != NOPART and len(o.robots) > 2:
            message = f"'{o.label}' takes '{label}' and other inputs at the same place"
            yield _fault(message, o.position, hint)


def _fault(message: str, position: Position | None, hint: str) -> Diagnostic:
    return Diagnostic("Parallel", message, position, hint)
