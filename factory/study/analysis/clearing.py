"""Which robots stand for what is lost in which operation, from a layout: those that a run lets
stand, too, for something that lies there."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array
from factory.control.profile import places_after
from factory.layout.sweeping import SweptFloor
from factory.plant.factory import Operation
from factory.plant.fused_bodies import bodies_of
from factory.simulation.recovery.striking import EARLY, LATE
from factory.study.analysis.timing import Timing
from factory.timing.failing import Clearing


def clearing_of(timing: Timing, seconds: float) -> Clearing | None:
    """That of what lies for so many seconds; None in the ideal world, where nothing lies about."""
    if timing.world == "ideal" or not seconds:
        return None
    return Clearing(_Floor(timing).near, seconds, timing.seed)


class _Floor:
    """Where things fall, and the robots that sweep it."""

    def __init__(self, timing: Timing) -> None:
        self._timing, self._swept = timing, SweptFloor.of(timing.layout)
        self._radius = bodies_of(timing.factory, timing.layout.product).radius

    def near(self, operation: Operation, label: str, share: float) -> frozenset[int]:
        """The robots that could touch what is lost in an operation after a share of the time in
        which a run lets robots drop things: it falls where its robot is then. A part that is lost
        as it is taken lies there."""
        brought = label in operation.before
        slots = operation.before if brought else operation.after
        slot, moment = slots.index(label), (EARLY + share * (LATE - EARLY)) if brought else LATE
        parts = self._timing.factory.contents[label]
        radii = np.array([self._radius[part] for part in parts])
        return self._swept.near(self._places(operation, slot, parts, moment), radii)

    def _places(
        self, operation: Operation, slot: int, parts: tuple[str, ...], moment: float
    ) -> Array:
        """Where parts (k, 2) [m] are that the robot in a slot holds, after a share of the time of
        an operation."""
        timing, number, robot = self._timing, operation.index, operation.robots[slot]
        layout, product = timing.layout, timing.layout.product
        limits = timing.limits.of(timing.factory.axes[number])
        after = moment * timing.delays[number]
        x = float(places_after(timing.modes[number], timing.starts[number], limits, after)[slot])
        at = np.add(layout.guidepaths[robot].middle(x), layout.shift(robot, number))
        return np.array([at + (product.solids[part].centre - product.middle)[:2] for part in parts])
