"""The net of a factory: one gear for each robot, from its program."""

from __future__ import annotations

from factory.nets.gears import Gear, GearNet
from factory.nets.petri import PetriNet, Place, Transition
from factory.nets.threaded import Redistribution, ThreadedNet
from factory.plant.factory import Operation, Robot
from factory.problem.pag import NOPART


def gear_net(robots: tuple[Robot, ...], operations: tuple[Operation, ...]) -> GearNet:
    """N: for each operation a start, an end and a place; for each robot a gear through them.

    Operation i has transitions 2i and 2i + 1 and place i; the wait places follow, robot by robot. A
    robot that is gone has no operations, and a gear without places.
    """
    transitions = tuple(
        Transition(f"{o.label}_{end}", o.position) for o in operations for end in ("s", "e")
    )
    places = [
        Place(
            o.label,
            (o.start,),
            (o.end,),
            o.template.name,
            "" if o.after[o.template.carrier - 1] == NOPART else o.label,
            len(o.robots),
            o.position,
        )
        for o in operations
    ]
    slots = [o.robots for o in operations]
    slot_of = [{robot: i for i, robot in enumerate(o.robots)} for o in operations]
    pairs: list[list[tuple[tuple[int, int], tuple[int, int]]]] = [[] for _ in transitions]
    gears = []
    for robot in robots:
        gear_places, gear_events = [], []
        several = (
            sum(operations[n].before[slot_of[n][robot.index]] == NOPART for n in robot.operations)
            > 1
        )
        for step, number in enumerate(robot.operations):
            before, operation = operations[robot.operations[step - 1]], operations[number]
            done, begun = before.end, operation.start
            slot = slot_of[number][robot.index]
            label = operation.before[slot]
            stays = label != NOPART and operation.after[slot] != NOPART
            wait = len(places)
            places.append(
                Place(
                    _wait_name(robot, label, operation, several),
                    (done,),
                    (begun,),
                    "hold" if stays else "wait",
                    label,
                    1,
                    operation.position,
                )
            )
            slots.append((robot.index,))
            pairs[begun].append(((wait, 0), (number, slot)))
            pairs[done].append(((before.place, slot_of[before.index][robot.index]), (wait, 0)))
            gear_places += [wait, number]
            gear_events += [done, begun]
        gears.append(Gear(robot.name, robot.type, tuple(gear_places), tuple(gear_events)))
    redistribution: tuple[Redistribution, ...] = tuple(tuple(sorted(p)) for p in pairs)
    net = ThreadedNet(PetriNet(transitions, tuple(places)), redistribution)
    return GearNet(net, tuple(gears), tuple(g.places[0] for g in gears if g.places), tuple(slots))


def _wait_name(robot: Robot, label: str, onward: Operation, several: bool) -> str:
    """What the place is called where a robot waits for an operation `onward`: `r2:part1`. One that
    comes home several times in its gear waits with nothing for each tour, `r2:nopart/part3`."""
    if label == NOPART and several:
        return f"{robot.name}:{label}/{onward.label}"
    return f"{robot.name}:{label}"
