"""How the inputs of each operation of a product can come together: they slide, one is lowered, or
they are blocked.

Three levels say how strictly. At a *strict* one no two parts ever overlap, nor scrape along each
other; at one that goes *no deeper* they overlap on the way by no more than in the finished product;
at the third, pairs that overlap in the finished product are *left out*. All of it up to TOLERANCE.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from factory.compiler.compiler import expand
from factory.compiler.mating.bodies import bodies
from factory.compiler.mating.contacts import SIGNS, TOLERANCE, Contacts, Finder
from factory.compiler.mating.meetings import Ints, Meeting, Meetings, meetings
from factory.compiler.mating.stroke import strokes
from factory.geometry.solids import Product
from factory.plant.approaches import Approach, Kind, Pair
from factory.problem.pag import PAG
from factory.problem.template import Template
from factory.support.errors import Position

STRICT, NO_DEEPER, LEFT_OUT, BLOCKED = 3, 2, 1, 0
"""The levels, the strictest first."""

UPRIGHT = 2
"""The axis z, along which inputs are lowered."""

SHAPES = frozenset({"mesh", "box", "cylinder", "sphere", "pos"})
"""Parameters that give a part a shape or a place of its own."""


@dataclass(frozen=True, slots=True)
class Clash:
    """Two parts that pass through each other: how deep [m] on the way and in the finished product,
    and how far [m] from its place the last input is where they are deepest."""

    parts: Pair
    depth: float
    finished: float
    shift: float


@dataclass(frozen=True, slots=True)
class Mating:
    """What was found of one operation: the approach chosen, the best levels at which its inputs
    slide or one is lowered, and, where it is blocked, the pairs that clash if the last input comes
    from the first of its sides, the deepest first."""

    label: str
    inputs: tuple[str, ...]
    approach: Approach
    slide: int
    lower: int
    clashes: tuple[Clash, ...] = ()
    position: Position | None = field(default=None, compare=False)

    @property
    def level(self) -> int:
        """The best level of all."""
        return max(self.slide, self.lower)

    def best(self, level: int) -> Kind:
        """How the inputs can come together if it is judged by one level alone."""
        if self.slide >= level:
            return "slide"
        return "lower" if self.lower >= level else "blocked"


@dataclass(frozen=True)
class Matings:
    """All that a product's operations were judged to be, inputs before what is made of them."""

    all: tuple[Mating, ...]
    parts: Mapping[str, tuple[str, ...]] = field(repr=False)
    """The parts of each input of a blocked operation."""

    @cached_property
    def approaches(self) -> Mapping[str, Approach]:
        """The approach of each operation, by its label."""
        return MappingProxyType({mating.label: mating.approach for mating in self.all})

    def count(self, level: int) -> int:
        """How many operations attain a level, by sliding or lowering."""
        return sum(mating.level >= level for mating in self.all)

    def of_kind(self, kind: Kind) -> tuple[Mating, ...]:
        """The operations whose approach is of a kind."""
        return tuple(mating for mating in self.all if mating.approach.kind == kind)


def shaped(pag: PAG) -> bool:
    """Whether some part has a shape or a place of its own. The default boxes of a product in which
    none has can always slide: each sub-assembly is an interval of a path to and fro in a lattice,
    so the next interval goes on ahead of it along x and along y."""
    return any(p.name in SHAPES for node in pag.parts() for p in node.parameters)


def matings(
    pag: PAG, templates: Mapping[str, Template], product: Product, lifts: bool = True
) -> Matings:
    """Judges every operation with two inputs or more, with `lifts` or without. Near-linear in the
    parts, except where very many lie behind one another."""
    found = meetings(expand(pag, templates), pag.root)
    if not found.all:
        return Matings((), {})
    finder = Finder(bodies(product, found.parts), found)
    judge = _Judge(found, product, pag)
    for axis in (0, 1):
        judge.slide(axis, finder.along(axis, found.axes == axis))
    unclean = judge.slides.max(axis=1) < STRICT
    if lifts and unclean.any():
        judge.lower(finder.along(UPRIGHT, unclean), unclean)
    made = tuple(judge.mating(number) for number in range(len(found.all)))
    return Matings(made, judge.contents(made))


class _Judge:
    """The levels of all meetings, and the choice among them."""

    def __init__(self, found: Meetings, product: Product, pag: PAG) -> None:
        self.meetings, self.product, self.pag = found, product, pag
        count = len(found.all)
        self.slides = np.zeros((count, 2), np.int64)
        self.lowers = np.full((count, 2), BLOCKED)
        self.clashing = np.zeros((count, 2), np.int64)
        self.contacts: dict[int, Contacts] = {}

    def slide(self, axis: int, contacts: Contacts) -> None:
        """Takes note of what happens along x or y."""
        at = self.meetings.axes == axis
        levels, clashing = _levels(contacts, len(at))
        self.slides[at], self.clashing[at] = levels[at], clashing[at]
        self.contacts[axis] = contacts

    def lower(self, contacts: Contacts, tried: NDArray[np.bool_]) -> None:
        """Takes note of what happens along z: column 0, the first is lowered, 1, the last."""
        either = np.array([m.either for m in self.meetings.all])
        levels = _levels(contacts, len(tried))[0]
        self.lowers[tried] = levels[tried]
        self.lowers[~either, 0] = BLOCKED
        self.contacts[UPRIGHT] = contacts

    def mating(self, number: int) -> Mating:
        """The best: the stricter, and of the same level to slide."""
        meeting = self.meetings.all[number]
        slide, lower = max(self.slides[number].tolist()), max(self.lowers[number].tolist())
        clashes: tuple[Clash, ...] = ()
        if slide == lower == BLOCKED:
            approach, clashes = self._blocked(number, meeting)
        elif slide >= lower:
            approach = self._sliding(number, meeting, slide)
        else:
            approach = self._lowering(number, meeting, lower)
        position = _position(self.pag, meeting)
        return Mating(meeting.label, meeting.inputs, approach, slide, lower, clashes, position)

    def _sliding(self, number: int, meeting: Meeting, level: int) -> Approach:
        """From all sides of a level."""
        found = self.slides[number].tolist()
        columns = [column for column in (0, 1) if found[column] == level]
        return self._from(number, meeting, "slide", columns, level == STRICT)

    def _from(
        self, number: int, meeting: Meeting, kind: Kind, columns: list[int], clean: bool = False
    ) -> Approach:
        sides = tuple(SIGNS[column] for column in columns)
        pairs = tuple(() if clean else self._excluded(number, meeting.axis, c) for c in columns)
        return Approach(kind, meeting.axis, sides, "", 0.0, pairs)

    def _lowering(self, number: int, meeting: Meeting, level: int) -> Approach:
        """Of two that can be lowered the one with the shorter stroke, or else the last."""
        stroke = strokes(self.product, self.meetings.parts, meeting)
        columns = [c for c in (1, 0) if self.lowers[number, c] == level]
        column = min(columns, key=lambda c: stroke[c])
        lowered = meeting.inputs[-1] if column else meeting.inputs[0]
        pairs = self._excluded(number, UPRIGHT, column)
        return Approach("lower", meeting.axis, SIGNS, lowered, stroke[column], (pairs, pairs))

    def _blocked(self, number: int, meeting: Meeting) -> tuple[Approach, tuple[Clash, ...]]:
        counts = self.clashing[number].tolist()
        columns = [column for column in (0, 1) if counts[column] == min(counts)]
        column = columns[0]
        contacts = self.contacts[meeting.axis]
        rows = [r for r in contacts.rows(number) if _clashes(contacts)[r, column]]
        clashes = [self._clash(contacts, row, column) for row in rows]
        ordered = tuple(sorted(clashes, key=lambda c: (-c.depth, c.parts)))
        return self._from(number, meeting, "blocked", columns), ordered

    def _clash(self, contacts: Contacts, row: int, column: int) -> Clash:
        return Clash(
            self._pair(contacts, row),
            float(contacts.path[row, column]),
            float(contacts.finished[row]),
            float(contacts.shift[row, column]),
        )

    def _excluded(self, number: int, axis: int, column: int) -> tuple[Pair, ...]:
        contacts = self.contacts[axis]
        rows = [r for r in contacts.rows(number) if contacts.faulty[r, column]]
        return tuple(sorted(self._pair(contacts, row) for row in rows))

    def _pair(self, contacts: Contacts, row: int) -> Pair:
        parts = self.meetings.parts
        one, other = sorted((parts[contacts.one[row]], parts[contacts.other[row]]))
        return one, other

    def contents(self, made: tuple[Mating, ...]) -> dict[str, tuple[str, ...]]:
        """The parts of all inputs of blocked operations; piles count as one with their last."""
        found: dict[str, tuple[str, ...]] = {}
        for mating, meeting in zip(made, self.meetings.all, strict=True):
            if mating.approach.kind == "blocked":
                parts = self.meetings.parts
                found[meeting.inputs[-1]] = parts[meeting.split : meeting.end]
                found[meeting.inputs[0]] = parts[meeting.first : meeting.split]
        return found


def _position(pag: PAG, meeting: Meeting) -> Position | None:
    """Where the last input of an operation is written; a pile is labelled as what it becomes, with
    a slash and a number."""
    node = pag.by_label.get(meeting.label) or pag[meeting.label.rpartition("/")[0]]
    if len(node.input_positions) != len(node.inputs):
        return meeting.position
    return node.input_positions[node.inputs.index(meeting.inputs[-1])]


def _clashes(contacts: Contacts) -> NDArray[np.bool_]:
    """Which pairs (n, 2) that are apart in the end pass through each other from each side."""
    return _deeper(contacts) & (contacts.finished <= TOLERANCE)[:, None]


def _deeper(contacts: Contacts) -> NDArray[np.bool_]:
    return np.asarray(contacts.path > contacts.finished[:, None] + TOLERANCE)


def _levels(contacts: Contacts, count: int) -> tuple[Ints, Ints]:
    """The level of each meeting from each side (count, 2), and how many pairs clash there."""
    levels, clashing = np.empty((count, 2), np.int64), np.empty((count, 2), np.int64)
    faults = (_clashes(contacts), _deeper(contacts), contacts.faulty)
    for side in (0, 1):
        clashing[:, side], deeper, overlaps = (
            np.bincount(contacts.meeting[fault[:, side]], minlength=count) for fault in faults
        )
        levels[:, side] = np.select(
            [overlaps == 0, deeper == 0, clashing[:, side] == 0],
            [STRICT, NO_DEEPER, LEFT_OUT],
            BLOCKED,
        )
    return levels, clashing
