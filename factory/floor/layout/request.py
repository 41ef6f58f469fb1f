"""How a factory is laid out for a run: at the pace of its settings, with relays if asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING

from factory.support.apps import layout_variant
from factory.support.bounds import check_values
from factory.support.boxes import Box
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings
from factory.theory.plant.factory import Factory

if TYPE_CHECKING:
    from factory.floor.geometry.solids import Product
    from factory.floor.layout.hands.choosing import Hands
    from factory.floor.layout.layout import Layout


TILE = 0.24
"""The usual size of the tiles of a platen [m]."""

WIDEST = 10**5
"""Upper bound on the width and depth of a floor [m]."""


def is_side(length: object) -> bool:
    """Whether it is a width or depth [m] that a floor can have."""
    return isinstance(length, Real) and not isinstance(length, bool) and 0 < float(length) <= WIDEST


@dataclass(frozen=True, slots=True)
class Ground:
    """The floor that a layout is asked for, and its variant.

    Attributes:
        floor: width and depth [m]; None for as much as it takes.
        relay: whether robots relay each other on shared guidepaths.
        cycle: the cycle time that relays are to reach [s]; None for the shortest.
        tile: size of the tiles of a platen [m]; None for rails.

    Raises InputError: BadValue for a wrong floor, Usage for a wrong time or tile.
    """

    floor: tuple[float, float] | None = None
    relay: bool = False
    cycle: float | None = None
    tile: float | None = None

    def __post_init__(self) -> None:
        check_values({"cycle": self.cycle, "tile": self.tile})
        sides = self.floor if isinstance(self.floor, tuple) else ()
        fits = len(sides) == 2 and all(map(is_side, sides))
        if self.floor is not None and not fits:
            message = f"floor = {self.floor!r:.60} is not two positive lengths up to {WIDEST} m"
            raise InputError(Diagnostic("BadValue", message, None, "for example (4.0, 3.0)"))

    @property
    def machines(self) -> str:
        """What the operations on it are coordinated with, in words."""
        return "hands, magazines and the tray"

    @property
    def reach_bound(self) -> bool:
        """Whether only a layout tells whether a product can be made: robots reach so far and no
        further. On rails they come wherever the rails lead."""
        return False

    @property
    def is_named(self) -> bool:
        """Whether all that it depends on is named by options, and no file but the product's."""
        return True

    @property
    def relays(self) -> bool:
        """Whether relays are asked for: a cycle time asks for them too."""
        return self.relay or self.cycle is not None

    @property
    def variants(self) -> tuple[str, ...]:
        """The variants of a layout that are asked for, which apps give."""
        asked = {"platen": self.tile is not None, "relay": self.relays and self.tile is None}
        return tuple(name for name, is_asked in asked.items() if is_asked)

    @staticmethod
    def tiles(layout: Layout) -> list[Box]:
        """The tiles of a platen that a layout needs [m]; none on rails."""
        from factory.floor.layout.tiles import tiles_of

        return tiles_of(layout)

    def check(self, shared: bool) -> None:
        """Raises InputError (BadValue) where relays are asked for of robots with several tours
        (`shared`)."""
        if self.relay and shared:
            message = "--relay does not go with robots that have several tours"
            hint = "leave out --relay, or what shares robots: a mix, --robots, --parallel, [lines]"
            words = f"{message}: a relay cuts the way of one tour"
            raise InputError(Diagnostic("BadValue", words, None, hint))

    def lay_out(
        self,
        factory: Factory,
        product: Product,
        settings: Settings,
        hands: Hands | None = None,
        draft: Layout | None = None,
    ) -> Layout:
        """The layout of a compiled factory; `hands`: those to choose from, where they are known;
        `draft`: what was drafted for it with these hands. Raises RunError (Layout) where there is
        no room."""
        from factory.floor.layout.durations import Pace
        from factory.floor.layout.embedding import lay_out
        from factory.floor.layout.kept_layouts import kept_or
        from factory.floor.mating.mating import judged

        self.check(factory.folded)
        pace = Pace.of(settings)
        factory, product = judged(factory, product), product.repeated(factory)
        hands = hands or hands_of(factory, product, settings)
        floor = None if self.tile else self.floor
        asked = settings.clearance, floor, pace
        find = partial(lay_out, factory, product, *asked, hands, draft)
        layout = kept_or(find, factory, product, hands, *asked)
        for variant in self.variants:
            layout = layout_variant(variant)(layout, self, settings, hands)
        return layout

    def drafted(
        self, factory: Factory, product: Product, settings: Settings, hands: Hands | None
    ) -> Layout:
        """The draft of the layout of a compiled factory with these hands: the best one found,
        before it is certified."""
        from factory.floor.layout.dimensions import Clearance
        from factory.floor.layout.durations import Pace
        from factory.floor.layout.embedding import drafted
        from factory.floor.mating.mating import judged

        factory, product = judged(factory, product), product.repeated(factory)
        c, pace = Clearance(settings.clearance, factory.carriage), Pace.of(settings)
        return drafted(factory, product, c, pace, self.floor, hands)


def hands_of(factory: Factory, product: Product, settings: Settings) -> Hands:
    """The hands to choose from for a compiled factory."""
    from factory.floor.layout.hands.choosing import Hands
    from factory.floor.mating.mating import judged
    from factory.theory.compiler.tees import on_stems

    stems, _ = on_stems(judged(factory, product))
    return Hands(stems, product.repeated(factory), settings.acceleration)
