"""What the arms of a cell bring, how they hold it, and how high they rise with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from factory.api import Dimensions, Factory, Layout, Product
from factory.apps.arms.body import STEM
from factory.apps.arms.burdens import Burden, burden_of
from factory.apps.arms.cell import GAP, down, shown_height
from factory.apps.arms.holds import facing_up, product_of, quaternion
from factory.apps.arms.lines import Line, line_of
from factory.apps.arms.rises import Rise
from factory.floor.geometry.suction import PadPlace
from factory.support.arrays import Array
from factory.support.rotations import about_vertical

ABOVE = 0.018
"""How far above the product a payload, or an empty tool, is where a carrier may come and go [m]."""

OVER_WELL = 0.06
"""Length of a straight end at a feeder at least [m]."""

BACK = 0.03
"""How far an empty tool goes back from a face before it rises beside what stands [m]."""

WRIST = 0.065
"""Radius of what of an arm is behind a tool, at most [m]."""

KEPT = "burdens", "drafts", "sizes", "tip", "show", "top", "ring"
"""What does not depend on the size of pads, or on where an arm stands."""


@dataclass(frozen=True, eq=False)
class Handling:
    """What arms bring from where to where.

    Attributes:
        factory: of carriers, tools that work on what these carry, and arms.
        product: the solids.
        rails: by carrier (index), the layout on rails of what it brings, whose line and hand it
            takes; the first brings the product.
        size: of the tools' pads, the number of those that some burden has room for.
    """

    factory: Factory
    product: Product
    rails: Mapping[int, Layout]
    size: int

    def otherwise(self, **values: float) -> Self:
        """The same with other values, on which nothing `KEPT` depends."""
        made = replace(self, **values)  # type: ignore[arg-type]
        kept = {name: value for name, value in self.__dict__.items() if name in KEPT}
        made.__dict__.update(kept)
        return made

    @property
    def clearance(self) -> float:
        """Between what stands [m]."""
        return self.rails[0].clearance

    @cached_property
    def arms(self) -> tuple[int, ...]:
        """The arms (index)."""
        return tuple(robot.index for robot in self.factory.robots if robot.body.first.moves)

    def labels(self, arm: int) -> list[str]:
        """What an arm takes, in the order of its program."""
        operations = self.factory.operations
        return [operations[tour[0]].label for tour in self.factory.tours[arm]]

    @cached_property
    def arm_of(self) -> dict[str, int]:
        """The arm (index) that takes each part and sub-assembly."""
        return {label: arm for arm in self.arms for label in self.labels(arm)}

    @cached_property
    def burdens(self) -> dict[str, Burden]:
        """What the arms bring."""
        tours = (tour[0] for arm in self.arms for tour in self.factory.tours[arm])
        every = (burden_of(self.factory, self.product, first) for first in tours)
        return {burden.label: burden for burden in every}

    def names(self, label: str) -> list[str]:
        """All labels of what an arm brings: of the operations that change nothing of it, too."""
        contents, parts = self.factory.contents, {*self.burdens[label].parts}
        return [o.label for o in self.factory.making if {*contents[o.label]} == parts]

    @cached_property
    def drafts(self) -> dict[int, Line]:
        """The lines by carrier (index), wherever they are."""
        return {
            carrier: line_of(self.factory, carrier, self.product, rails)
            for carrier, rails in self.rails.items()
        }

    def tip_shown(self, label: str) -> Array:
        """Where an arm's tool is on it where it is taken, as it is turned there, in the product's
        frame (3,) [m]."""
        burden = self.burdens[label]
        if not burden.fed:
            return self.tip[label]
        axis = burden.solids[0].axis
        return np.asarray(about_vertical(burden.fed) @ (self.tip[label] - axis) + axis)

    @cached_property
    def show(self) -> float:
        """Height at which the bottoms of parts are shown that are held on top [m]."""
        fed = (b.solids[0].presented() for b in self.burdens.values() if b.source is None)
        return shown_height([*fed], self.clearance)

    def shows(self, label: str) -> float:
        """Height at which the bottom of a part is shown: an arm's wrist is above other feeders
        [m]."""
        return self.show if self.is_upright(label) else self.show + WRIST

    def is_straight(self, label: str) -> bool:
        """Whether something is held on top, and lowered."""
        return self.is_upright(label) and bool(self.burdens[label].comes[2])

    def is_upright(self, label: str) -> bool:
        """Whether something is held on top."""
        return bool(self.burdens[label].hold.normal[2])

    @cached_property
    def sizes(self) -> list[float]:
        """The radii of pads for which there is room on some burden [m]."""
        return sorted({round(float(burden.hold.pad.radius), 4) for burden in self.burdens.values()})

    @property
    def pad(self) -> float:
        """Radius of the pads of the arms' tools, which may be larger than what they hold [m]."""
        return self.sizes[self.size]

    @property
    def largest(self) -> int:
        """The greatest `size` of a pad that has room beside what each burden is placed onto."""
        room = min(burden.hold.room for burden in self.burdens.values())
        return max(self.size, int(np.searchsorted(self.sizes, room, "right")) - 1)

    def covered(self, label: str) -> float:
        """Radius of what a pad covers of a burden [m]."""
        return min(self.pad, float(self.burdens[label].hold.pad.radius))

    @cached_property
    def tip(self) -> dict[str, Array]:
        """Where an arm's tool is on each part, in the product's frame (3,) [m]."""
        off = GAP - PadPlace.GAP
        return {
            label: np.asarray(b.hold.pad.at + off * b.hold.normal)
            for label, b in self.burdens.items()
        }

    @cached_property
    def top(self) -> float:
        """Height of the product's top [m]."""
        return Dimensions.PAYLOAD + float(self.product.high[2] - self.product.low[2])

    def _height(self, z: float) -> float:
        """Height of a place of the product's frame on a carrier [m]."""
        return Dimensions.PAYLOAD + z - float(self.product.low[2])

    def _lowest(self, label: str) -> float:
        """Height above its place in the product's frame of what is lowest of a burden, or of the
        wrist behind it [m]."""
        low, tip = float(self.burdens[label].low[2]), float(self.tip[label][2])
        return low if self.is_upright(label) else min(low, tip - WRIST)

    def _over(self, carrier: int, z: float) -> float:
        """How far a place of the product's frame rises to where a carrier comes and goes [m]."""
        return self.drafts[carrier].top + ABOVE - self._height(z)

    def rises(self, label: str) -> Rise:
        """How what an arm brings comes straight to its place, down or from a side, from where a
        carrier may still come and go."""
        burden = self.burdens[label]
        up, along = self._over(burden.onto, self._lowest(label)), burden.comes
        if along[2]:
            return Rise.of(max(burden.join.approach.stroke if burden.join.approach else 0.0, up))
        aside = burden.reach(along, burden.there) + burden.reach(-along, burden.parts)
        return Rise.beside(along, aside + ABOVE, up)

    def leaves(self, label: str) -> Rise:
        """How the empty tool goes straight from what it has placed: up, or back and up."""
        return self._off(label, self.burdens[label].onto)

    def _off(self, label: str, carrier: int) -> Rise:
        """How the empty tool goes straight from what it holds of what is on a carrier."""
        burden, tip = self.burdens[label], self.tip[label]
        normal = burden.hold.normal
        if normal[2]:
            return Rise.of(self._over(carrier, float(tip[2])))
        there = burden.there if carrier == burden.onto else ()
        beyond = burden.reach(normal, [*there, *burden.parts]) - float(normal @ tip)
        return Rise.beside(
            normal, BACK + max(beyond, 0.0), self._over(carrier, float(tip[2]) - WRIST)
        )

    def enters(self, label: str) -> Rise:
        """How the empty tool comes straight to what it takes, from above or from a side and
        above."""
        burden = self.burdens[label]
        if burden.source is not None:
            return self._off(label, burden.source)
        up = self.exits(label)
        if self.is_upright(label):
            return up
        normal = about_vertical(burden.fed) @ burden.hold.normal
        return Rise.beside(normal, BACK, up.length)

    def exits(self, label: str) -> Rise:
        """How it goes straight up with it."""
        burden, lowest = self.burdens[label], self._lowest(label)
        if burden.source is not None:
            return Rise.of(self._over(burden.source, lowest))
        bottom = self.shows(label) + lowest - float(burden.low[2])
        length = max(OVER_WELL, self.top + 2 * ABOVE - bottom)
        return Rise(length / 2, length)

    def loads(self, label: str) -> list[tuple[Array, Array, Array]]:
        """The boxes of what an arm brings in the tool's frame, held with the tool's angle at 0:
        place, half sizes, quaternion."""
        boxes, turn = list[tuple[Array, Array, Array]](), facing_up(self.burdens[label].hold.normal)
        about = product_of(np.array([0.0, 1.0, 0.0, 0.0]), quaternion(turn))
        for solid in self.burdens[label].solids:
            middle, half = (solid.low + solid.high) / 2, (solid.high - solid.low) / 2
            place = down(0.0).T @ turn @ (middle - self.tip[label]) + [0.0, 0.0, STEM]
            boxes.append((place, half, about))
        return boxes
