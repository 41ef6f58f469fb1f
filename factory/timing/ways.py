"""The net with the ways that robots go while they wait (`modes/staging.py`)."""

from __future__ import annotations

from collections.abc import Iterable

from factory.nets.marked import MarkedNet
from factory.nets.petri import PetriNet, Place
from factory.plant.factory import Factory


def with_ways(net: MarkedNet, factory: Factory, ways: Iterable[tuple[int, int]]) -> MarkedNet:
    """`net`, whose first places are the factory's, with a place [Y_e; X_e] for each way: of a robot
    that goes from where Y has left it to where X, its next operation, needs it.

    It is beside the robot's own places from Y_e to X_e, and has as many tokens as its wait for X.
    So the simple circuits of a gear net still lie in one gear each: one that took a way of a gear
    and left that gear before X_e would come by X_e a second time. A gear takes the longer of the
    two at each operation.
    """
    places, tokens = list(net.net.places), list(net.tokens)
    for robot, number in ways:
        gear, operation = factory.robots[robot], factory.operations[number]
        step = gear.operations.index(number)
        before = factory.operations[gear.operations[step - 1]]
        name = f"way:{gear.name}:{operation.label}"
        places.append(Place(name, (before.end,), (operation.end,), "way", operation.label))
        tokens.append(net.tokens[factory.net.gears[robot].places[2 * step]])
    return MarkedNet(PetriNet(net.net.transitions, tuple(places)), tuple(tokens))
