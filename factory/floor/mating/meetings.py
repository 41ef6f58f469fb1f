"""Where the parts of a product meet: the tree of its operations as arrays.

The leaves of the tree are the parts, numbered from the left; the parts of a sub-assembly are an
interval of them. Two parts meet at the lowest operation that has both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from factory.support.arrays import Indices
from factory.support.errors import Position
from factory.theory.compiler.expanding import Node


@dataclass(frozen=True, slots=True)
class Meeting:
    """An operation with two inputs or more.

    `axis` along which they come (0 or 1); `first`, `split`, `end`: its parts are the leaves from
    `first` to `end`, those of its last input begin at `split`; `either`: two robots bring the two
    inputs, so that either may be lowered; else only the last.
    """

    label: str
    inputs: tuple[str, ...]
    axis: int
    first: int
    split: int
    end: int
    either: bool
    position: Position | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Meetings:
    """All operations at which parts meet, and the parts' labels in the order of the leaves."""

    parts: tuple[str, ...]
    all: tuple[Meeting, ...]
    borders: Indices = field(repr=False)
    """(parts - 1,): the meeting of each part with the next one; the lowest of both."""
    levels: Indices = field(repr=False)
    """(meetings,): how deep in the tree each is."""

    @classmethod
    def at_once(cls, parts: tuple[str, ...]) -> Meetings:
        """Of parts that all meet in one operation."""
        every = Meeting("", (), 0, 0, 0, len(parts), either=True)
        return cls(parts, (every,), np.zeros(len(parts) - 1, np.int64), np.zeros(1, np.int64))

    @cached_property
    def axes(self) -> Indices:
        """The axis of each meeting (meetings,)."""
        return np.array([m.axis for m in self.all], np.int64)

    @cached_property
    def splits(self) -> Indices:
        """Where the last input of each meeting begins (meetings,)."""
        return np.array([m.split for m in self.all], np.int64)

    @cached_property
    def _table(self) -> list[Indices]:
        """Row k: the highest meeting on 2**k borders from each on, as level * count + number."""
        rows = [self.levels[self.borders] * len(self.all) + self.borders]
        while 2 ** len(rows) <= len(self.borders):
            half = 2 ** (len(rows) - 1)
            rows.append(np.minimum(rows[-1][:-half], rows[-1][half:]))
        return rows

    def of(self, one: Indices, other: Indices) -> Indices:
        """The meetings at which the parts one[i] < other[i] do: the highest between them."""
        highest = np.empty(len(one), np.int64)
        row = np.frexp((other - one).astype(float))[1] - 1
        for k in sorted(set(row.tolist())):
            at = row == k
            table = self._table[k]
            highest[at] = np.minimum(table[one[at]], table[other[at] - 2**k])
        return highest % max(1, len(self.all))


def meetings(nodes: Mapping[str, Node], axes: Mapping[str, int] = MappingProxyType({})) -> Meetings:
    """The meetings of a product, from its operations in postorder (as `Node.expand` gives them).

    The output robot heads along x, so its inputs come along y; what a robot of its own brings is
    made by a robot that heads across; what the carrier holds was made on its own way, and what a
    manipulator picks on the way on which it is brought. `axes`: by operations the axis along which
    inputs come that are not tied to a line.
    """
    spans, parts = _spans(nodes)
    root = next(reversed([*nodes]), "")
    turns, levels = {root: 1}, {root: 0}
    picked = set[str]()
    for label, node in reversed([*nodes.items()]):
        brought = node.template.brought
        for number, name in enumerate(node.inputs):
            is_along = number == node.held or label in picked
            turns[name] = turns[label] if is_along else 1 - turns[label]
            levels[name] = levels[label] + 1
            picked |= {name} if brought and nodes[name].template.name == brought else set()
    made: list[Meeting] = []
    borders = np.zeros(max(0, len(parts) - 1), np.int64)
    for label, node in nodes.items():
        if len(node.inputs) < 2:
            continue
        first, end = spans[label]
        for name in node.inputs[1:]:
            borders[spans[name][0] - 1] = len(made)
        split, either = spans[node.inputs[-1]][0], len(node.inputs) == 2 and node.held < 0
        axis = axes.get(label, turns[label])
        meeting = Meeting(label, node.inputs, axis, first, split, end, either, node.position)
        made.append(meeting)
    depths = np.array([levels[m.label] for m in made], np.int64)
    return Meetings(parts, tuple(made), borders, depths)


def _spans(nodes: Mapping[str, Node]) -> tuple[dict[str, tuple[int, int]], tuple[str, ...]]:
    """The leaves of each label, from and to, and the labels of the leaves."""
    spans: dict[str, tuple[int, int]] = {}
    parts: list[str] = []
    for label, node in nodes.items():
        if node.inputs:
            spans[label] = (spans[node.inputs[0]][0], spans[node.inputs[-1]][1])
        else:
            spans[label] = (len(parts), len(parts) + 1)
            parts.append(label)
    return spans, tuple(parts)
