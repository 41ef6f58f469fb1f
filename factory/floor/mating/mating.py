"""How the inputs of each operation of a product can come together: they slide, one is lowered, or
they are blocked; and the room that they have on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import ceil
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.solids import Product
from factory.floor.mating.finder import Finder
from factory.floor.mating.findings import Level, Mating, Matings
from factory.floor.mating.meetings import Meeting, Meetings, meetings
from factory.floor.mating.overlaps import Overlaps
from factory.floor.mating.paths import SIGNS
from factory.support.errors import Position
from factory.theory.compiler.expanding import Node
from factory.theory.plant.approaches import MARGIN, Approach, Clash, Kind, Overlap, Pair
from factory.theory.plant.factory import Factory


def matings(
    nodes: Mapping[str, Node],
    product: Product,
    lifts: bool = True,
    lowered: Mapping[str, str] = MappingProxyType({}),
    as_drawn: bool = False,
    axes: Mapping[str, int] = MappingProxyType({}),
) -> Matings:
    """Judges every operation with two inputs or more, with `lifts` or without. Near-linear in the
    parts, except where very many lie behind one another. `lowered`: by operations the input that is
    to be lowered if it can be, even where it could slide. `as_drawn`: the bodies that collide for
    parts that are tested as they are drawn are not compared: runs alone need what they overlap.
    `axes`: by operations the axis along which inputs come that are not tied to a line."""
    met = meetings(nodes, axes)
    if not met.all:
        return Matings((), {})
    finder = Finder(product, met, as_drawn)
    judge = _Judge(met, product, {label: node.last for label, node in nodes.items()})
    for axis in (0, 1):
        judge.slide(axis, finder.along(axis, met.axes == axis))
    asked = [lowered.get(meeting.label, "") for meeting in met.all]
    unclean = (judge.slides.max(axis=1) < Level.STRICT) | (np.array(asked) != "")
    if lifts and unclean.any():
        judge.lower(finder.lowering(unclean), unclean)
    made = tuple(judge.mating(number, label) for number, label in enumerate(asked))
    return Matings(made, judge.contents(made))


def judged(factory: Factory, product: Product) -> Factory:
    """A factory that was compiled without approaches, with one for every operation that has inputs
    to join: its robots have no lifts, so all inputs slide, or are blocked."""
    if all(o.approach is not None for o in factory.operations if len(o.inputs) > 1):
        return factory
    approaches = matings(Node.of_factory(factory), product, lifts=False).approaches
    operations = tuple(
        replace(o, approach=o.approach or approaches.get(o.label)) for o in factory.operations
    )
    return replace(factory, operations=operations)


class _Judge:
    """The levels of all meetings, and the choice among them."""

    def __init__(self, met: Meetings, product: Product, at: Mapping[str, Position | None]) -> None:
        self.meetings, self.product, self.at = met, product, at
        count = len(met.all)
        self.slides = np.zeros((count, 2), np.int64)
        self.lowers = np.full((count, 2), Level.BLOCKED)
        self.clashing = np.zeros((count, 2), np.int64)
        self.overlaps: dict[int, Overlaps] = {}

    def slide(self, axis: int, overlaps: Overlaps) -> None:
        """Note the levels along x or y."""
        at = self.meetings.axes == axis
        levels, clashing = overlaps.levels(len(at))
        self.slides[at], self.clashing[at] = levels[at], clashing[at]
        self.overlaps[axis] = overlaps

    def lower(self, overlaps: Overlaps, tried: NDArray[np.bool_]) -> None:
        """Note the levels along z: column 0 if the first input is lowered, 1 if the last is."""
        either = np.array([m.either for m in self.meetings.all])
        self.lowers[tried] = overlaps.levels(len(tried))[0][tried]
        self.lowers[~either, 0] = Level.BLOCKED
        self.overlaps[Finder.UPRIGHT] = overlaps

    def mating(self, number: int, asked: str = "") -> Mating:
        """The best approach: that of the stricter level, or sliding if both are equal; lowering of
        the input that is `asked` for, if that can be lowered, else of the one with the shorter
        stroke, the last if both are equal."""
        meeting = self.meetings.all[number]
        slides, clashing = self.slides[number].tolist(), self.clashing[number].tolist()
        slide, lower = max(slides), max(self.lowers[number].tolist())
        column = 0 if asked == meeting.inputs[0] else 1
        if asked and self.lowers[number, column] > Level.BLOCKED:
            approach = self._lowered(number, column)
        elif slide == lower == Level.BLOCKED:
            column = clashing.index(min(clashing))
            clashes = self._clashes(number, meeting.axis, column, "clashing")
            other = self._clashes(number, meeting.axis, 1 - column, "clashing")
            same = {c.parts for c in clashes} == {c.parts for c in other}
            approach = self._along(number, "blocked", [0, 1] if same else [column])
            approach = replace(approach, clashes=clashes)
        elif slide >= lower:
            columns = [column for column in (0, 1) if slides[column] == slide]
            approach = self._along(number, "slide", columns)
        else:
            stroke = self._strokes(meeting)
            columns = [c for c in (1, 0) if self.lowers[number, c] == lower]
            approach = self._lowered(number, min(columns, key=stroke.__getitem__))
        position = self.at[meeting.label] or meeting.position
        return Mating(meeting.label, meeting.inputs, approach, slide, lower, position)

    def _along(self, number: int, kind: Kind, columns: list[int]) -> Approach:
        """From some of the sides."""
        axis = self.meetings.all[number].axis
        sides = tuple(SIGNS[column] for column in columns)
        overlaps = tuple(self._overlaps(number, axis, column) for column in columns)
        clashes = self._clashes(number, axis, columns[0], "cutting")
        return Approach(kind, axis, sides, "", 0.0, overlaps, clashes)

    def _lowered(self, number: int, column: int) -> Approach:
        """Lowering of the first input (0) or the last (1)."""
        meeting = self.meetings.all[number]
        stroke = self._strokes(meeting)
        overlaps = self._overlaps(number, Finder.UPRIGHT, column)
        lowered = meeting.inputs[-1 if column else 0]
        clashes = self._clashes(number, Finder.UPRIGHT, column, "cutting")
        both = overlaps, overlaps
        return Approach("lower", meeting.axis, SIGNS, lowered, stroke[column], both, clashes)

    def _strokes(self, meeting: Meeting) -> tuple[float, float]:
        """How high the first, or the last input is raised above its place, so that it clears the
        others wherever it comes: from its bottom to the top of the others, and a margin [whole
        mm]."""
        (low, high), (last_low, last_high) = (
            (min(s.low[2] for s in solids), max(s.high[2] for s in solids))
            for solids in (
                [self.product.solids[part] for part in parts] for parts in self._sides(meeting)
            )
        )
        heights = (float(last_high - low), float(high - last_low))
        first, last = (ceil((max(h, 0.0) + MARGIN) * 1e3 - 1e-6) / 1e3 for h in heights)
        return first, last

    def _sides(self, meeting: Meeting) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The parts of all inputs but the last, and those of the last."""
        parts = self.meetings.parts
        return parts[meeting.first : meeting.split], parts[meeting.split : meeting.end]

    def _clashes(
        self, number: int, axis: int, column: int, how: Literal["clashing", "cutting"]
    ) -> tuple[Clash, ...]:
        """The pairs that are `clashing` or `cutting` from one side, the deepest first."""
        overlaps = self.overlaps[axis].of(number)
        depths, rows = overlaps.depths, np.flatnonzero(getattr(overlaps, how)[:, column])
        clashes = [
            Clash(
                self._pair(overlaps, row),
                float(depths.path[row, column]),
                float(depths.finished[row]),
                float(depths.shift[row, column]),
            )
            for row in rows.tolist()
        ]
        return tuple(sorted(clashes, key=lambda c: (-round(c.depth, 9), c.parts)))

    def _overlaps(self, number: int, axis: int, column: int) -> tuple[Overlap, ...]:
        """What collides or scrapes as the inputs of an operation come from a side."""
        overlaps = self.overlaps[axis].of(number)
        rows = np.flatnonzero(overlaps.colliding.faulty[:, column]).tolist()
        listed = (self._overlap(overlaps, row, column) for row in rows)
        return tuple(sorted(listed, key=lambda overlap: overlap.parts))

    def _overlap(self, overlaps: Overlaps, row: int, column: int) -> Overlap:
        parts = self._pair(overlaps, row)
        rows = slice(*overlaps.starts[row : row + 2].tolist())
        bodies = overlaps.bodies.receding(rows, column)
        if self.meetings.parts[overlaps.one[row]] != parts[0]:
            bodies = [(other, one, far) for one, other, far in bodies]
        return Overlap(parts, float(overlaps.colliding.path[row, column]), tuple(sorted(bodies)))

    def _pair(self, overlaps: Overlaps, row: int) -> Pair:
        parts = self.meetings.parts
        one, other = sorted((parts[overlaps.one[row]], parts[overlaps.other[row]]))
        return one, other

    def contents(self, made: tuple[Mating, ...]) -> dict[str, tuple[str, ...]]:
        """The parts of all inputs of blocked operations; piles count as one with their last."""
        parts: dict[str, tuple[str, ...]] = {}
        for mating, meeting in zip(made, self.meetings.all, strict=True):
            if mating.approach.kind == "blocked":
                parts[meeting.inputs[0]], parts[meeting.inputs[-1]] = self._sides(meeting)
        return parts
