"""A layout as a table of its choices, from which everything else is derived."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from factory.compiler.assigning import assigned
from factory.geometry.solids import Product
from factory.layout.embedding import certified
from factory.layout.guidepath import Box, Guidepath
from factory.layout.hands.hand import Hand, Point3
from factory.layout.layout import Layout
from factory.layout.shapes import payload_boxes
from factory.layout.standby import part_of
from factory.layout.visits import Visit
from factory.plant.factory import Factory
from factory.plant.fused_bodies import repeated
from factory.support.errors import RunError

LAID_FOR = ("clearance", "acceleration")
"""The settings that a layout depends on: what is for others is laid out anew."""

AXES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""The ways that guidepaths head."""


@dataclass(frozen=True, slots=True)
class LayoutTable:
    """What is kept of a layout, by the names that `Layout` has; `visits`: for each operation those
    of its robots. `standby`: where deputies can take over, who does the tours of each robot in each
    turn of the layout of all that robots may do (`Layout.standby`), whose values the others are;
    nothing where none may. `plain`: the layout without relays, None where this is one. `frame`: the
    box (low, high) about the product's middle, None where that is the product's own; `tile`: the
    size of the tiles of a platen [m], 0 without one."""

    clearance: float
    guidepaths: tuple[Guidepath, ...]
    visits: tuple[tuple[Visit, ...], ...]
    outfeed: Box
    hands: tuple[Hand | None, ...] = ()
    standby: tuple[tuple[int, ...], ...] = ()
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
            if hand and hand.kind != "none" and not (hand.places and hand.radius > 0):
                raise ValueError(f"hands[{number}] must have places, and a radius above 0")

    @classmethod
    def of(cls, layout: Layout) -> LayoutTable:
        """The table of a layout."""
        whole = layout.whole
        visits = (
            tuple(whole.visits[o.index, robot] for robot in o.robots)
            for o in whole.factory.operations
        )
        return cls(
            whole.clearance,
            whole.guidepaths,
            tuple(visits),
            whole.outfeed,
            whole.hands,
            _turns(layout.factory, whole.factory) if layout.standby else (),
            None if layout.plain is None else cls.of(layout.plain),
            _frame_of(layout.product),
            whole.tile,
        )

    def laid_out(self, factory: Factory, product: Product, plain: Factory) -> Layout:
        """The layout of a factory, which without relays is `plain`, and its product, certified
        anew. Raises ValueError where the table is not of that factory, or things are not clear."""
        whole = self._whole(factory)
        if self.frame is not None:
            low, high = map(np.array, self.frame)
            product = replace(product, low=low, high=high)
        self._check(whole)
        laid = Layout(
            whole,
            solids := repeated(product, whole),
            self.clearance,
            self.guidepaths,
            self._visits(whole),
            payload_boxes(whole, solids),
            self.outfeed,
            self.hands,
            tile=self.tile,
        )
        try:
            laid = certified(laid)
        except RunError as error:
            raise ValueError(f"it is not clear: {error.diagnostics[0].message}") from error
        if self.plain:
            return replace(laid, plain=self.plain.laid_out(plain, product, plain))
        if not self.standby:
            return laid
        standing = replace(laid, product=repeated(product, factory), standby=laid)
        made = part_of(standing, factory)
        assert made is not None, "its robots have their own tours"
        return made

    def _whole(self, factory: Factory) -> Factory:
        """The factory in which robots do all that they may do."""
        if not self.standby:
            return factory
        robots = range(len(factory.robots))
        rows = [len(row) == len(robots) and {*row} <= {*robots} for row in self.standby]
        if not all(rows) or self.standby[0] != (*robots,):
            words = f"lists of {len(robots)} numbers of robots, the first in their order"
            raise ValueError(f"standby must be {words}")
        return assigned(factory, factory.robots, self.standby)

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


def _turns(factory: Factory, whole: Factory) -> tuple[tuple[int, ...], ...]:
    """Who does the tours of each robot of a factory, for each turn of that in which deputies do
    some."""
    count = whole.period // factory.period
    turns = [[*range(len(factory.robots))] for _ in range(count)]
    for o in whole.operations:
        first = factory.by_label[o.within(factory.period)]
        for robot, does in zip(first.robots, o.robots, strict=True):
            turns[o.turn // factory.period][robot] = does
    return tuple(map(tuple, turns))


def _frame_of(product: Product) -> tuple[Point3, Point3] | None:
    """The box (low, high) of a product that is in the frame of another [m]; None for its own."""
    solids = product.solids.values()
    low = np.min([solid.low for solid in solids], axis=0)
    high = np.max([solid.high for solid in solids], axis=0)
    if np.array_equal(low, product.low) and np.array_equal(high, product.high):
        return None
    (x, y, z), (u, v, w) = product.low.tolist(), product.high.tolist()
    return (x, y, z), (u, v, w)
