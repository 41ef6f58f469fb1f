"""The kinds of hands: from where they reach a payload, and what room they take there.

*Below*: a finger under the plane of payloads, and a column from it up to the place. *Behind*: a
tower behind the payload, and a bar from it ahead to the place. *Above*: a tower, a beam over all
that there is, and a stem from it down to the place.
"""

from __future__ import annotations

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.dimensions import BEAM, FINGER
from factory.floor.layout.hands.reach import AIR, APART, halves
from factory.floor.layout.hands.surfaces import Way
from factory.support.arrays import Array
from factory.support.named import Named

Boxes = tuple[Array, Array]
"""The lower and upper corners (n, 3) of boxes [m]."""


class HandKind(Named):
    """A kind of hand, by its name; in itself that of a hand which holds nothing.

    Attributes:
        rises: whether it comes up from under the plane of payloads.
        level: whether it comes from behind, along the heading of its robot.
        hangs: whether it comes down from over everything.
        up: which way along z its pads face: +1, -1, or 0 where it is level.
    """

    rises = level = hangs = False
    up = 0

    @property
    def holds(self) -> bool:
        """Whether it holds anything."""
        return self.rises or self.tall

    @property
    def tall(self) -> bool:
        """Whether its mast reaches up among the payloads."""
        return self.level or self.hangs

    def toward(self, heading: Way) -> tuple[float, float, float]:
        """Direction from the faces of its pads to the payload, for a robot with a heading."""
        return 0.0, 0.0, float(self.up)

    def side(self, heading: Way) -> tuple[int, int]:
        """The side of a payload that it holds: an axis, and the way (+1, -1) along it in which that
        side faces."""
        toward = self.toward(heading)
        axis = max(range(3), key=lambda axis: abs(toward[axis]))
        return axis, -round(toward[axis])

    def boxes(self, product: Product, at: Array, radius: Array, heading: Way) -> Boxes:
        """The boxes of pad and column, of pad and bar, or of pad and stem among the parts, with
        play, for pads of some radii (n,) at places (n, 3)."""
        raise NotImplementedError(f"a hand of the kind '{self}' takes no room")

    def over_all(self, low: Array, high: Array, radius: Array) -> Boxes:
        """Its boxes for parts that are lowered from over everything."""
        return low, high

    def with_room(self, low: Array, high: Array, heading: Way, room: float) -> Boxes:
        """Boxes with room ahead of its face [m]."""
        axis, way = self.side(heading)
        (low if way > 0 else high)[:, axis] -= way * room
        return low, high


class _Below(HandKind):
    rises, up = True, 1

    def boxes(self, product: Product, at: Array, radius: Array, heading: Way) -> Boxes:
        """Over a pad half its air is play: a payload sags, and may hang lower than the pad."""
        low, high = _about(at, radius)
        low[:, 2], high[:, 2] = product.low[2] - 1.0, at[:, 2] - AIR / 2
        return low, high


class _Behind(HandKind):
    level = True

    def toward(self, heading: Way) -> tuple[float, float, float]:
        return (*heading, 0.0)

    def boxes(self, product: Product, at: Array, radius: Array, heading: Way) -> Boxes:
        low, high = _about(at, halves(radius))
        low[:, 2] = np.minimum(low[:, 2], at[:, 2] - BEAM / 2)
        high[:, 2] = np.maximum(high[:, 2], at[:, 2] + BEAM / 2)
        axis, way = self.side(heading)
        (low if way > 0 else high)[:, axis] = at[:, axis] + way * AIR
        return low, high


class _Above(HandKind):
    hangs, up = True, -1

    def boxes(self, product: Product, at: Array, radius: Array, heading: Way) -> Boxes:
        low, high = _about(at, radius)
        low[:, 2], high[:, 2] = at[:, 2] + AIR, product.high[2] + 10.0
        return low, high

    def over_all(self, low: Array, high: Array, radius: Array) -> Boxes:
        """As wide as its beam, which is over its pad."""
        more = np.maximum(0.0, FINGER / 2 - radius)[:, None] * [1.0, 1.0, 0.0]
        return low - more, high + more


NONE = HandKind("none")
BELOW, BEHIND, ABOVE = _Below("below"), _Behind("behind"), _Above("above")


def _about(at: Array, half: Array) -> Boxes:
    return at - half[:, None] - APART, at + half[:, None] + APART
