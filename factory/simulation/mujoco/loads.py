"""What each holder carries, and between which places: robots by the operations in their gears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from factory.mjcf.model import Model


@dataclass(frozen=True, slots=True)
class Load:
    """What a holder (its code) has by some `welds`, and the places on its slide [m] between which
    it may be with that."""

    holder: int
    welds: tuple[int, ...] = ()
    low: float = 0.0
    high: float = 0.0


def loads(model: Model, grip: Mapping[tuple[int, str], int]) -> dict[tuple[int, str], Load]:
    """Of each robot (index) with what it brings to its operations, by label; where it may be with
    that are its ways there. `grip`: the weld by which a robot holds a body."""
    layout, factory = model.layout, model.factory
    found: dict[tuple[int, str], Load] = {}
    for robot in factory.robots:
        for step, number in enumerate(robot.operations):
            last, operation = (factory.operations[n] for n in (robot.operations[step - 1], number))
            slots = [o.robots.index(robot.index) for o in (last, operation)]
            places = [layout.home(robot.index, number)]
            places += map(layout.goal, (last.index, number), slots)
            label = operation.before[slots[1]]
            before = found.get((robot.index, label))
            if before is not None:
                places += before.low, before.high
            welds = tuple(grip[robot.index, body] for body in model.carried.carried.get(label, ()))
            load = Load(robot.index + 1, welds, min(places), max(places))
            found[robot.index, label] = load
    return found
