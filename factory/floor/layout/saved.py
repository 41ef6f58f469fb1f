"""A layout as a table of its choices, from which everything else is derived."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.certificate import Certificate
from factory.floor.layout.embedding import certified
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.hand import Hand, Point3
from factory.floor.layout.layout import Layout
from factory.floor.layout.shapes import payload_boxes
from factory.floor.layout.visits import Visit
from factory.support.boxes import Box
from factory.support.errors import RunError
from factory.theory.plant.factory import Factory

AXES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""The ways that guidepaths head."""


@dataclass(frozen=True, slots=True)
class LayoutTable:
    """A layout as it is kept in a file, by the names that `Layout` has.

    Attributes:
        LAID_FOR: the settings that a layout depends on: what is for others is laid out anew.
        clearance: least distance between machines [m].
        guidepaths: of each robot.
        visits: for each operation those of its robots.
        outfeed: the box of the conveyor [m].
        hands: of each robot; None for tools.
        plain: the layout without relays; None where this is one.
        frame: the box (low, high) about the product's middle [m]; None where that is the
            product's own.
        tile: size of the tiles of a platen [m]; 0 without one.
    """

    LAID_FOR: ClassVar[tuple[str, ...]] = ("clearance", "acceleration")

    clearance: float
    guidepaths: tuple[Guidepath, ...]
    visits: tuple[tuple[Visit, ...], ...]
    outfeed: Box
    hands: tuple[Hand | None, ...] = ()
    plain: LayoutTable | None = None
    frame: tuple[Point3, Point3] | None = None
    tile: float = 0.0

    def __post_init__(self) -> None:
        if not self.clearance > 0:
            raise ValueError(f"clearance must be above 0, not {self.clearance}")
        for number, path in enumerate(self.guidepaths):
            across = path.heading[0] * path.side[0] + path.heading[1] * path.side[1]
            if {path.heading, path.side} - {*AXES} or across:
                raise ValueError(f"guidepaths[{number}] must lie along the axes of the floor")
            if not (path.travel >= 0 and path.reach > 0):
                words = f"a travel from 0 and a reach above 0, not {path.travel} and {path.reach}"
                raise ValueError(f"guidepaths[{number}] must have {words}")
        for number, hand in enumerate(self.hands):
            if hand and hand.kind.holds and not (hand.places and hand.radius > 0):
                raise ValueError(f"hands[{number}] must have places, and a radius above 0")

    @classmethod
    def of(cls, layout: Layout) -> LayoutTable:
        """The table of a layout."""
        visits = (
            tuple(layout.visits[o.index, robot] for robot in o.robots)
            for o in layout.factory.operations
        )
        return cls(
            layout.clearance,
            layout.guidepaths,
            tuple(visits),
            layout.outfeed,
            layout.hands,
            None if layout.plain is None else cls.of(layout.plain),
            _frame_of(layout.product),
            layout.tile,
        )

    def laid_out(
        self,
        factory: Factory,
        product: Product,
        plain: Factory,
        certificate: Certificate | None = None,
    ) -> Layout:
        """The layout of a factory, which without relays is `plain`, and its product, with its
        `certificate`, or certified anew. Raises ValueError where the table is not of that factory,
        or things are not clear."""
        if self.frame is not None:
            low, high = map(np.array, self.frame)
            product = replace(product, low=low, high=high)
        self._check(factory)
        laid = Layout(
            factory,
            solids := product.repeated(factory),
            self.clearance,
            self.guidepaths,
            self._visits(factory),
            payload_boxes(factory, solids),
            self.outfeed,
            self.hands,
            tile=self.tile,
        )
        try:
            laid = certified(laid, certificate=certificate)
        except RunError as error:
            raise ValueError(f"it is not clear: {error.diagnostics[0].message}") from error
        if self.plain:
            return replace(laid, plain=self.plain.laid_out(plain, product, plain))
        return laid

    def _check(self, factory: Factory) -> None:
        """Raises ValueError if the numbers of values do not fit a factory."""
        robots = len(factory.robots)
        wanted: tuple[tuple[str, tuple[object, ...], int], ...] = (
            ("guidepaths", self.guidepaths, robots),
            ("visits", self.visits, len(factory.operations)),
            ("hands", self.hands, len(self.hands) and robots),
        )
        for name, values, count in wanted:
            if len(values) != count:
                raise ValueError(f"{name} must be a list of {count}, not of {len(values)}")

    def _visits(self, factory: Factory) -> dict[tuple[int, int], Visit]:
        """The visits of a factory. Raises ValueError where they are not, or where a robot holds its
        payload in several ways on one tour."""
        visit_of = dict[tuple[int, int], Visit]()
        for o, row in zip(factory.operations, self.visits, strict=True):
            if len(row) != len(o.robots):
                words = f"a list of {len(o.robots)}, one for each robot, not of {len(row)}"
                raise ValueError(f"visits[{o.index}] must be {words}")
            visit_of |= {
                (o.index, robot): visit for robot, visit in zip(o.robots, row, strict=True)
            }
        for robot, tours in enumerate(factory.tours):
            for tour in tours:
                visits = [visit_of[number, robot] for number in tour]
                if len({(visit.up, visit.elevation, visit.shift) for visit in visits}) > 1:
                    words = f"visits of {factory.robots[robot].name} for one payload"
                    raise ValueError(f"{words} must have the same up, elevation and shift")
        return visit_of


def _frame_of(product: Product) -> tuple[Point3, Point3] | None:
    """The box (low, high) of a product that is in the frame of another [m]; None for its own."""
    solids = product.solids.values()
    low = np.min([solid.low for solid in solids], axis=0)
    high = np.max([solid.high for solid in solids], axis=0)
    if np.array_equal(low, product.low) and np.array_equal(high, product.high):
        return None
    (x, y, z), (u, v, w) = product.low.tolist(), product.high.tolist()
    return (x, y, z), (u, v, w)
