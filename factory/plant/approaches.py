"""How the inputs of an operation can come together: a value, found by `compiler/mating/` from the
geometry of a product, used by Compile (robot types), the layout (sides) and the run (contacts)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["slide", "lower", "blocked"]

Pair = tuple[str, str]
"""Labels of two parts, in alphabetical order."""

MARGIN = 0.02
"""What is to be lowered comes at least this far above everything of the others [m]."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two parts that overlap on the way of one to its place, or in it, or scrape along each other:
    how `deep` they get into each other [m], negative where they only scrape; `bodies`, of each two
    convex bodies of theirs that do, their numbers and how far [m] those must recede from each other
    so that they do not."""

    parts: Pair
    deep: float
    bodies: tuple[tuple[int, int, float], ...]


@dataclass(frozen=True, slots=True)
class Approach:
    """The admissible approaches of one operation with two inputs (or a pile and one more).

    `axis`: 0 for x or 1 for y of the product, along which its inputs come in the layout. `sides`:
    the sides of that axis, +1 or -1, from which the *last* input may come (moving against it); the
    other comes from, or stands on, the opposite side. `lowered`: the label of the input that comes
    `stroke` [m] above its place and is lowered when all others stand, "" where none is. `overlaps`:
    for each of `sides` the parts that cannot come so without overlapping or scraping.
    """

    kind: Kind
    axis: int
    sides: tuple[int, ...] = (-1, +1)
    lowered: str = ""
    stroke: float = 0.0
    overlaps: tuple[tuple[Overlap, ...], ...] = ((), ())

    @property
    def told(self) -> str:
        """In words: "lid is lowered 0.057 m", "slides from -x or +x"."""
        if self.kind == "lower":
            return f"{self.lowered} is lowered {self.stroke:g} m"
        sides = " or ".join(f"{'-+'[side > 0]}{'xy'[self.axis]}" for side in self.sides)
        return f"{'slides' if self.kind == 'slide' else 'is blocked'} from {sides}"
