"""What the arms of a cell bring, how they hold it, and how high they rise with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from factory.api import Array, Factory, Layout, Product
from factory.apps.arms.body import STEM
from factory.apps.arms.burdens import Burden, burden_of
from factory.apps.arms.cell import GAP, down, shown_height
from factory.apps.arms.lines import Line, line_of
from factory.floor.geometry.suction import GAP as SUCTION_GAP
from factory.floor.geometry.turning import about_vertical, axis_of, presented
from factory.floor.layout.dimensions import PAYLOAD

ABOVE = 0.018
"""How far above the product a payload, or an empty tool, is where a carrier may come and go [m]."""

OVER_WELL = 0.06
"""Length of a straight end at a feeder at least [m]."""

CURVE = 0.06
"""Length of the most of a straight end that may be rounded, beyond what stays straight [m]."""


KEPT = "burdens", "drafts", "sizes", "tip", "show", "top", "ring"
"""What does not depend on the size of pads, or on where an arm stands."""


@dataclass(frozen=True, slots=True)
class Rise:
    """A straight end of a way, above the visit.

    Attributes:
        straight: how far it stays straight; what is beyond may be rounded [m].
        length: of it all [m].
    """

    straight: float
    length: float

    @classmethod
    def of(cls, straight: float) -> Rise:
        """One that stays straight so far [m]."""
        return cls(straight, straight + min(straight, CURVE))


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
        axis = axis_of(burden.solids[0])
        return np.asarray(about_vertical(burden.fed) @ (self.tip[label] - axis) + axis)

    @cached_property
    def show(self) -> float:
        """Height at which the bottoms of parts are shown [m]."""
        fed = (presented(b.solids[0]) for b in self.burdens.values() if b.source is None)
        return shown_height([*fed], self.clearance)

    @cached_property
    def sizes(self) -> list[float]:
        """The radii of pads for which there is room on some burden [m]."""
        return sorted({round(float(burden.pad.radius), 4) for burden in self.burdens.values()})

    @property
    def pad(self) -> float:
        """Radius of the pads of the arms' tools, which may be larger than what they hold [m]."""
        return self.sizes[self.size]

    def covered(self, label: str) -> float:
        """Radius of what a pad covers of a burden [m]."""
        return min(self.pad, float(self.burdens[label].pad.radius))

    @cached_property
    def tip(self) -> dict[str, Array]:
        """Where an arm's tool is on each part, in the product's frame (3,) [m]."""
        off = np.array([0.0, 0.0, GAP - SUCTION_GAP])
        return {label: np.asarray(b.pad.at + off) for label, b in self.burdens.items()}

    @cached_property
    def top(self) -> float:
        """Height of the product's top [m]."""
        return PAYLOAD + float(self.product.high[2] - self.product.low[2])

    def _height(self, z: float) -> float:
        """Height of a place of the product's frame on a carrier [m]."""
        return PAYLOAD + z - float(self.product.low[2])

    def rises(self, label: str) -> Rise:
        """How what an arm brings comes straight down to its place, from where a carrier may still
        come and go."""
        burden = self.burdens[label]
        stroke = burden.join.approach.stroke if burden.join.approach else 0.0
        bottom = self._height(float(burden.low[2]))
        return Rise.of(max(stroke, self.drafts[burden.onto].top - bottom + ABOVE))

    def leaves(self, label: str) -> Rise:
        """How the empty tool goes straight up from where it has placed something."""
        tip = self._height(float(self.tip[label][2]))
        return Rise.of(self.drafts[self.burdens[label].onto].top + ABOVE - tip)

    def enters(self, label: str) -> Rise:
        """How the empty tool comes straight down to what it takes."""
        source = self.burdens[label].source
        if source is None:
            length = max(OVER_WELL, self.top + 2 * ABOVE - self.show)
            return Rise(length / 2, length)
        return Rise.of(self.drafts[source].top + ABOVE - self._height(float(self.tip[label][2])))

    def exits(self, label: str) -> Rise:
        """How it goes straight up with it."""
        burden = self.burdens[label]
        if burden.source is None:
            return self.enters(label)
        return Rise.of(self.drafts[burden.source].top + ABOVE - self._height(float(burden.low[2])))

    def loads(self, label: str) -> list[tuple[Array, Array, Array]]:
        """The boxes of what an arm brings in the tool's frame, held with the tool's angle at 0:
        place, half sizes, quaternion."""
        boxes = list[tuple[Array, Array, Array]]()
        for solid in self.burdens[label].solids:
            middle, half = (solid.low + solid.high) / 2, (solid.high - solid.low) / 2
            place = down(0.0).T @ (middle - self.tip[label]) + [0.0, 0.0, STEM]
            boxes.append((place, half, np.array([0.0, 1.0, 0.0, 0.0])))
        return boxes
