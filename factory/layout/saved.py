"""A layout as a table: what was chosen for it, from which all else of it follows again."""

from __future__ import annotations

from dataclasses import dataclass, replace

from factory.compiler.assigning import assigned
from factory.geometry.solids import Product
from factory.layout.embedding import certified
from factory.layout.guidepath import Box, Guidepath
from factory.layout.hands.hand import Hand, Point3
from factory.layout.layout import Layout
from factory.layout.repeated import repeated
from factory.layout.shapes import payload_boxes
from factory.layout.standby import part_of
from factory.plant.factory import Factory
from factory.support.errors import RunError

LAID_FOR = ("clearance", "hands", "acceleration")
"""The settings that a layout depends on: what is for others is laid out anew."""

AXES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""The ways that guidepaths head."""


@dataclass(frozen=True, slots=True)
class LayoutTable:
    """What is kept of a layout, by the names that `Layout` has. `standby`: where deputies can take
    over, who does the tours of each robot in each turn of the layout of all that robots may do
    (`Layout.standby`), whose values the others are; nothing where none may. `plain`: the layout
    without relays, None where this is one."""

    clearance: float
    guidepaths: tuple[Guidepath, ...]
    stations: tuple[float, ...]
    outfeed: Box
    hands: tuple[Hand | None, ...] = ()
    shifts: tuple[tuple[Point3, ...], ...] = ()
    standby: tuple[tuple[int, ...], ...] = ()
    plain: LayoutTable | None = None

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
        """That of a layout."""
        whole = layout.standby or layout
        return cls(
            whole.clearance,
            whole.guidepaths,
            whole.stations,
            whole.outfeed,
            whole.hands,
            whole.shifts,
            _turns(layout.factory, whole.factory) if layout.standby else (),
            None if layout.plain is None else cls.of(layout.plain),
        )

    def laid_out(self, factory: Factory, product: Product, plain: Factory) -> Layout:
        """The layout of a factory, which without relays is `plain`, and its product, certified
        anew. Raises ValueError where the table is not of that factory, or things are not clear."""
        whole = self._whole(factory)
        self._check(whole)
        laid = Layout(
            whole,
            solids := repeated(product, whole),
            self.clearance,
            self.guidepaths,
            self.stations,
            payload_boxes(whole, solids),
            self.outfeed,
            self.hands,
            self.shifts,
        )
        try:
            laid = certified(laid)
        except RunError as error:
            raise ValueError(f"it is not clear: {error.diagnostics[0].message}") from error
        if self.plain:
            return replace(laid, plain=self.plain.laid_out(plain, product, plain))
        if not self.standby:
            return laid
        known = replace(laid, product=repeated(product, factory), standby=laid)
        made = part_of(known, factory, range(len(factory.robots)))
        assert made is not None, "its robots have their own tours"
        return made

    def _whole(self, factory: Factory) -> Factory:
        """The factory whose robots do all that they may do."""
        if not self.standby:
            return factory
        robots = range(len(factory.robots))
        rows = [len(row) == len(robots) and {*row} <= {*robots} for row in self.standby]
        if not all(rows) or self.standby[0] != (*robots,):
            words = f"lists of {len(robots)} numbers of robots, the first in their order"
            raise ValueError(f"standby must be {words}")
        return assigned(factory, factory.robots, self.standby)

    def _check(self, factory: Factory) -> None:
        """Raises ValueError where the numbers of values are not those of a factory."""
        robots = len(factory.robots)
        wanted: tuple[tuple[str, tuple[object, ...], int], ...] = (
            ("guidepaths", self.guidepaths, robots),
            ("stations", self.stations, len(factory.operations)),
            ("hands", self.hands, len(self.hands) and robots),
            ("shifts", self.shifts, len(self.shifts) and robots),
        )
        for name, values, count in wanted:
            if len(values) != count:
                raise ValueError(f"{name} must be a list of {count}, not of {len(values)}")
        for number, (row, tours) in enumerate(zip(self.shifts, factory.tours, strict=False)):
            if len(row) != len(tours):
                words = f"a list of {len(tours)}, one for each tour, not of {len(row)}"
                raise ValueError(f"shifts[{number}] must be {words}")


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
