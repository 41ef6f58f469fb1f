"""Places for ways on which robots move ahead while they wait, and the cycle time with them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from factory.theory.nets.cycle_ratio import CycleRatio, max_cycle_ratio
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import PetriNet, Place

Way = tuple[int, int]
"""A robot, and the place of the operation that it goes ahead to, by index."""


def with_ways(net: MarkedNet, gears: GearNet, ways: Iterable[Way]) -> MarkedNet:
    """`net`, whose first places are those of `gears`, with a place [Y_e; X_e] for each way: of a
    robot that goes from where Y has left it to where X, its next operation, needs it.

    It is beside the robot's own places from Y_e to X_e, and has as many tokens as its wait for X.
    So the simple circuits of a gear net still lie in one gear each: one that took a way of a gear
    and left that gear before X_e would come by X_e a second time. A gear takes the longer of the
    two at each operation.
    """
    places, tokens = list(net.net.places), list(net.tokens)
    for robot, number in ways:
        gear, operation = gears.gears[robot], places[number]
        wait = gear.places[gear.places.index(number) - 1]
        name = f"way:{gear.robot}:{operation.name}"
        ends = places[wait].left, operation.right
        places.append(Place(name, *ends, "way", operation.name))
        tokens.append(net.tokens[wait])
    return MarkedNet(PetriNet(net.net.transitions, tuple(places)), tuple(tokens))


def ways_apart(gears: GearNet, seconds: list[float], ways: Mapping[Way, float]) -> dict[Way, float]:
    """The ways that get places of their own. One in a gear of one operation would lead back to
    where it begins: its wait takes longer instead, in `seconds`."""
    apart = dict[Way, float]()
    for (robot, number), taken in ways.items():
        wait, *others = (p for p in gears.gears[robot].places if p != number)
        if others:
            apart[robot, number] = taken
        else:
            seconds[wait] = max(seconds[wait], taken - seconds[number])
    return apart


def train_ratio(
    gears: GearNet, seconds: Sequence[float], ways: Mapping[Way, float]
) -> tuple[CycleRatio, list[int]]:
    """The maximum cycle ratio of a live gear train, with the seconds of each of its places and the
    `ways` that robots go ahead, and the robots on the critical circuit (`busiest`). Raises
    ValueError where it is not live."""
    delays = list(seconds)
    apart = ways_apart(gears, delays, ways)
    delays += apart.values()
    ratio = max_cycle_ratio(with_ways(MarkedNet.of(gears), gears, apart), delays)
    owners: dict[int, tuple[int, ...]] = dict(enumerate(gears.slots))
    owners |= {len(seconds) + number: key[:1] for number, key in enumerate(apart)}
    return ratio, busiest(owners, ratio.circuit, delays)


def busiest(
    owners: Mapping[int, tuple[int, ...]], circuit: Iterable[int], seconds: Sequence[float]
) -> list[int]:
    """The robots on a circuit, in descending order of the time that they spend on it; `owners`: the
    robots of each place."""
    spent: dict[int, float] = {}
    for place in circuit:
        for robot in owners.get(place, ()):
            spent[robot] = spent.get(robot, 0.0) + seconds[place]
    return sorted(spent, key=lambda robot: (-spent[robot], robot))
