"""Piles that a robot can carry back to the B end of its guidepath.

A pile is swept from where it is complete back to B, and compared with all regions of the layout,
wherever the other robots are. A pile that may come too near to one of them is dropped
where it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from factory.floor.layout.certificate import HAND_BODY, PAYLOAD_BODY, Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.dimensions import PAYLOADS
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import Pile, piles_of, regions
from factory.theory.problem.pag import NOPART


def not_carried_back(layout: Layout) -> frozenset[tuple[int, str]]:
    """The pairs (robot index, label) that the robot cannot carry back to B. Near linear."""
    by_label = piles_of(layout)
    robots = range(len(layout.factory.robots))
    ways = [way for robot in robots for way in _ways_back(layout, robot, by_label)]
    here = [region for region in regions(layout) if region.layer == PAYLOADS]
    crowding, back = Crowding(layout), {id(way) for way in ways}
    barred = set[tuple[int, str]]()
    for one, other in crowding.near([*here, *ways]):
        mine = [region for region in (one, other) if id(region) in back]
        if len(mine) == 1 and not crowding.may_meet(one, other):
            barred.add((mine[0].robot, mine[0].label))
    return frozenset(barred)


def _ways_back(layout: Layout, robot: int, by_label: Mapping[str, Pile]) -> Iterator[Region]:
    """The region of each pile of a robot, with its hand, on its way back to B."""
    path, operations = layout.guidepaths[robot], layout.factory.operations
    gear, stops = layout.factory.robots[robot].operations, layout.stops(robot)
    grip = layout.grip(robot)
    for step, number in enumerate(gear):
        label = operations[number].after[operations[number].robots.index(robot)]
        if label == NOPART:
            continue
        onward = (step + 1) % len(gear)
        then = operations[gear[onward]]
        leaves = then.after[then.robots.index(robot)] == NOPART
        pile = by_label[label].carried(layout.visits[number, robot])
        at = stops[step if leaves else onward]
        for box in path.sweeps(pile.box, path.length, at):
            yield Region(robot, PAYLOADS, PAYLOAD_BODY, box, pile.z, label)
        if grip is not None:
            for box in path.sweeps(path.world(grip, (0.0, 0.0)), path.length, at):
                yield Region(robot, PAYLOADS, HAND_BODY, box, pile.z, label)
