"""Pins: the values of a layout that hold in the factory of the product's next revision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from factory.api import Hand, Layout, LayoutSearch, Product
from factory.apps.revise.pairing import Pairing
from factory.support.arrays import Array
from factory.support.boxes import Point2

SAME = 1e-6
"""Lengths that differ by less are the same [m]."""


@dataclass(frozen=True)
class StayingRobot:
    """A robot that stays, by its numbers in both factories, and which grades it keeps."""

    old: int
    new: int
    program: bool
    contents: bool
    module: bool
    place: bool

    @property
    def whole(self) -> bool:
        """Whether it keeps all grades."""
        return self.program and self.contents and self.module and self.place


@dataclass(frozen=True)
class Pins:
    """By the numbers of a new factory the values of an old layout: `sides` and `travel` [m] of
    robots, `stations` of operations [m], `hands`; `ends`: where guidepaths end, as `ends_of`."""

    sides: Mapping[int, int] = field(default_factory=dict)
    travel: Mapping[int, float] = field(default_factory=dict)
    stations: Mapping[int, float] = field(default_factory=dict)
    hands: Mapping[int, Hand] = field(default_factory=dict)
    ends: Mapping[int, Array] = field(default_factory=dict)

    @classmethod
    def of(cls, old: Layout, pairing: Pairing) -> Pins:
        """Those of a layout for the new factory of a pairing."""
        was, kept = LayoutSearch(old.factory, old.product), pairing.robots
        on, on_new = was.carriers, LayoutSearch(pairing.new, old.product).carriers
        beside = (r for r in kept if r and kept.get(on[r]) == on_new[kept[r]])
        paths = old.guidepaths
        stations = {
            pairing.operations[n]: round(paths[robot].length - old.station(n), 6)
            for robot in kept
            for n in was.carried(robot)
            if n in pairing.operations
        }
        return cls(
            {kept[r]: -1 if paths[r].heading == paths[on[r]].side else 1 for r in beside},
            {new: paths[robot].travel for robot, new in kept.items()},
            stations,
            {new: hand for robot, new in kept.items() if (hand := old.hand(robot)) is not None},
            {new: ends_of(old, robot) for robot, new in kept.items()},
        )

    def in_place(self, layout: Layout) -> tuple[Point2, frozenset[int]]:
        """By how much the floor of a layout lies elsewhere [m], and the robots whose guidepaths end
        there where they did; of the output robot's the B end. Of all such displacements the one
        that leaves most in place."""
        places = dict[Point2, set[int]]()
        for robot, before in self.ends.items():
            away = (ends_of(layout, robot) - before)[int(robot == 0) :].round(6) + 0.0
            if np.ptp(away, axis=0).max() < SAME:
                x, y = away[-1].tolist()
                places.setdefault((x, y), set()).add(robot)
        shift = max(places, key=lambda shift: len(places[shift]))
        return shift, frozenset(places[shift])


def ends_of(layout: Layout, robot: int) -> Array:
    """Where the product's middle is at the A and the B end of a guidepath (2, 2) [m]."""
    path = layout.guidepaths[robot]
    return np.array([path.middle(path.reach), path.middle(path.length)])


def same_module(layouts: tuple[Layout, Layout], robots: tuple[int, int]) -> bool:
    """Whether robots of two layouts have the same hand, length, offset and arm; the length of the
    output robot's path does not count."""
    paths = [made.guidepaths[robot] for made, robot in zip(layouts, robots, strict=True)]
    hands = [made.hand(robot) for made, robot in zip(layouts, robots, strict=True)]
    holds = [hand and (hand.kind, hand.tip, hand.places, hand.radius) for hand in hands]
    lengths = np.array([[path.offset, path.arm, path.travel * (robots[0] > 0)] for path in paths])
    return holds[0] == holds[1] and bool(np.abs(lengths[0] - lengths[1]).max() < SAME)


def framed(product: Product, old: Product) -> Product:
    """The product in the frame of another: in a box about the middle of that, which holds both."""
    middle = old.middle
    reach = np.max([old.high - middle, product.high - middle, middle - product.low], axis=0)
    low, high = middle - reach, middle + reach
    low[2], high[2] = min(old.low[2], product.low[2]), max(old.high[2], product.high[2])
    return replace(product, low=low, high=high)
