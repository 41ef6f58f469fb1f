"""The overlaps of parts on the ways on which their operations bring them together."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from factory.floor.mating.findings import Level
from factory.floor.mating.paths import TOLERANCE, Depths
from factory.support.arrays import Indices

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class BodyPairs:
    """Pairs of convex bodies: their numbers among those of their parts, and their depths (m,)."""

    one: Indices
    other: Indices
    depths: Depths = field(repr=False)

    def receding(self, rows: slice, side: int) -> list[tuple[int, int, float]]:
        """Those of `rows` that overlap or scrape on the way from a side, and how far [m] they must
        recede from each other so that they do not."""
        depths = self.depths.at(rows)
        chosen = np.flatnonzero(depths.faulty[:, side])
        pairs = self.one[rows][chosen].tolist(), self.other[rows][chosen].tolist()
        return list(zip(*pairs, depths.receding[chosen, side].tolist(), strict=True))


@dataclass(frozen=True)
class Overlaps:
    """Pairs of parts that overlap by more than the tolerance in some place of a path, or scrape, by
    meeting.

    Attributes:
        meeting: the number of the meeting (n,).
        one, other: the numbers of the parts, one < other (n,).
        depths: their depths as they are drawn.
        colliding: their depths as their bodies collide.
        rough: whether one of them is known by its hull alone (n,).
        bodies: the bodies that overlap.
        starts: those of row i are from `starts[i]` to `starts[i + 1]` (n + 1,).
    """

    meeting: Indices
    one: Indices
    other: Indices
    depths: Depths = field(repr=False)
    colliding: Depths = field(repr=False)
    rough: NDArray[np.bool_] = field(repr=False)
    bodies: BodyPairs = field(repr=False)
    starts: Indices = field(repr=False)

    def of(self, meeting: int) -> Overlaps:
        """Those of one meeting."""
        first, end = np.searchsorted(self.meeting, [meeting, meeting + 1]).tolist()
        rows = slice(first, end)
        at = self.meeting[rows], self.one[rows], self.other[rows]
        depths = self.depths.at(rows), self.colliding.at(rows), self.rough[rows]
        return Overlaps(*at, *depths, self.bodies, self.starts[first : end + 1])

    def levels(self, count: int) -> tuple[Indices, Indices]:
        """The level of each of so many meetings from each side (count, 2), and how many pairs
        clash there."""
        clashing, deeper, faulty = (
            np.stack(
                [np.bincount(self.meeting[fault[:, side]], minlength=count) for side in (0, 1)],
                axis=1,
            )
            for fault in (self.clashing, self.deeper, self.depths.faulty)
        )
        conditions = [faulty == 0, deeper == 0, clashing == 0]
        levels = [Level.STRICT, Level.NO_DEEPER, Level.LEFT_OUT]
        return np.select(conditions, levels, Level.BLOCKED), clashing

    @property
    def drawn_in(self) -> Flags:
        """Which pairs (n,) overlap in the finished product."""
        return np.asarray(self.depths.finished > TOLERANCE)

    @cached_property
    def deeper(self) -> NDArray[np.bool_]:
        """Which pairs (n, 2) get deeper into each other on the way from either side than they are
        in the finished product, or cut more out of each other."""
        return np.asarray(self._passing | self.depths.cuts)

    @property
    def _passing(self) -> Flags:
        """Which of them get deeper, or cut although they share nothing in the end."""
        finished = self.depths.finished[:, None]
        apart = finished <= TOLERANCE
        return (self.depths.path > finished + TOLERANCE) | (self.depths.cuts & apart)

    @cached_property
    def cutting(self) -> Flags:
        """Which of those (n, 2) do no more than cut: they get no deeper."""
        return np.asarray(self.depths.cuts & ~self._passing)

    @cached_property
    def clashing(self) -> NDArray[np.bool_]:
        """Which of those (n, 2) pass through each other: all but those that do no more than cut,
        and those of which a hull shows no more than that they are drawn into each other."""
        unknown = self.rough & (self.depths.finished > TOLERANCE)
        return self._passing & ~unknown[:, None]
