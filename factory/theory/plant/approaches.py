"""How the inputs of an operation can come together: a value, found by `floor/mating/` from the
geometry of a product, used by Compile (robot types), the layout (sides) and the run (contacts)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from factory.support.errors import Diagnostic, Position
from factory.theory.problem.pag import ROUNDING, AllowedOverlap, most_allowed

Kind = Literal["slide", "lower", "blocked"]

Pair = tuple[str, str]
"""Labels of two parts, in alphabetical order."""

MARGIN = 0.02
"""What is to be lowered comes at least this far above everything of the others [m]."""

NAMED = 3
"""The most pairs that clash that a diagnostic names."""


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
class Clash:
    """Two parts that pass through each other: how deep [m] on the way and in the finished product,
    and how far [m] from its place the last input is where they are deepest."""

    parts: Pair
    depth: float
    finished: float
    shift: float

    def is_allowed(self, allowed: Iterable[AllowedOverlap]) -> bool:
        """Whether they may get so deep into each other."""
        return self.depth <= most_allowed(allowed, *self.parts) + ROUNDING


@dataclass(frozen=True, slots=True)
class Approach:
    """The admissible approaches of one operation with two inputs (or a pile and one more).

    Attributes:
        kind: whether inputs slide, one is lowered, or they are blocked.
        axis: 0 for x or 1 for y of the product, along which the inputs come in the layout.
        sides: the sides of that axis, +1 or -1, from which the *last* input may come (moving
            against it); the other comes from, or stands on, the opposite side.
        lowered: the input that comes from above and is lowered when all others stand; "" for
            none.
        stroke: height from which it is lowered [m].
        overlaps: for each of `sides` the parts that cannot come so without overlapping or
            scraping.
        clashes: where it is blocked, the pairs that pass through each other as they are drawn
            if the last input comes from the first of its sides, the deepest first; otherwise
            the pairs that get no deeper into each other than they are in the finished product,
            but cut more out of each other.
    """

    MARGIN: ClassVar[float] = MARGIN

    kind: Kind
    axis: int
    sides: tuple[int, ...] = (-1, +1)
    lowered: str = ""
    stroke: float = 0.0
    overlaps: tuple[tuple[Overlap, ...], ...] = ((), ())
    clashes: tuple[Clash, ...] = ()

    def renamed(self, name: Callable[[str], str]) -> Approach:
        """The same approach of inputs and parts that have other labels."""
        overlaps = (
            tuple(replace(o, parts=(name(o.parts[0]), name(o.parts[1]))) for o in side)
            for side in self.overlaps
        )
        lowered = self.lowered and name(self.lowered)
        return replace(self, lowered=lowered, overlaps=tuple(overlaps))

    def on(self, side: int) -> Approach:
        """The same from one of its sides alone; itself where it has only one."""
        if len(self.sides) == 1:
            return self
        overlaps = self.overlaps[self.sides.index(side)]
        return replace(self, sides=(side,), overlaps=(overlaps,))

    def fault(
        self,
        label: str,
        coming: str,
        position: Position | None,
        allowed: Iterable[AllowedOverlap],
    ) -> Diagnostic | None:
        """What is said of the operation that makes a label, where an input, the last, cannot come
        (Blocked); None where it can, or all that it passes through is allowed."""
        if self.kind != "blocked":
            return None
        allowed = [*allowed]
        clashes = [clash for clash in self.clashes if not clash.is_allowed(allowed)]
        if not clashes:
            return None
        named = [f"{' and '.join(c.parts)} {c.depth * 1e3:.2f} mm" for c in clashes[:NAMED]]
        more = f", and {len(clashes) - NAMED} more" if len(clashes) > NAMED else ""
        message = f"{coming} cannot come to {label}: {', '.join(named)}{more}"
        return Diagnostic("Blocked", message, position)

    @property
    def told(self) -> str:
        """In words: "lid is lowered 0.057 m", "slides from -x or +x"."""
        if self.kind == "lower":
            return f"{self.lowered} is lowered {self.stroke:g} m"
        sides = " or ".join(f"{'-+'[side > 0]}{'xy'[self.axis]}" for side in self.sides)
        return f"{'slides' if self.kind == 'slide' else 'is blocked'} from {sides}"
