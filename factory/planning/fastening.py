"""Screws: which parts are screws, and where in a tree they are driven in, after all that they
clamp."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from factory.geometry.meshes import Array
from factory.planning.blocking import Blocking
from factory.planning.cannot import Direction, Units
from factory.planning.exact import Tree
from factory.planning.judging import Join, Judged
from factory.planning.parts import InPlace, PlacedPart
from factory.planning.subsets import ROOT_AXIS, Stance
from factory.planning.writing import Screwed

WORDS = re.compile(
    r"(?:^|[^a-z])(?:(?:cap|set|wood|grub)?screws?|bolts?|vis|schrauben?|tornillos?|viti?|"
    r"(?:din|iso|en)[ _-]?\d{3,5}|m\d+(?:[.,]\d+)?x\d+)(?![a-z])"
)
"""Words in the names of screws, in lower case."""

HEAD, SHANK, SHORT, ROUND = 0.85, 0.75, 0.5, 0.16
"""Proportions of a bolt. Its head is farther from the axis than HEAD times the largest radius; its
shank is no farther than SHANK times that radius, longer than the head, and longer than half its
width. A round part has sides that differ by no more than ROUND."""


def fasteners(source: InPlace, named: Sequence[str]) -> tuple[str, ...]:
    """The units of a source that are screws: those that are `named`, those whose name says so, and
    those with a head that is wider than their shank, which is inside another part."""
    kept = {keep.label for keep in source.kept}

    def is_screw(part: PlacedPart) -> bool:
        return _is_called(part) or _is_in_another(_shank(part.vertices), part, source)

    return tuple(
        label
        for label, parts in source.units()
        if label in named or (label not in kept and is_screw(parts[0]))
    )


def _is_in_another(point: Array | None, part: PlacedPart, source: InPlace) -> bool:
    """Whether a point is inside the box of another part (the shank of an antenna is not)."""
    boxes = ((o.solid.low, o.solid.high) for o in source.parts if o is not part)
    return point is not None and any((a < point).all() and (point < b).all() for a, b in boxes)


def _is_called(part: PlacedPart) -> bool:
    name = f"{part.label} {part.node.parameter('mesh', '')}".lower()
    return bool(WORDS.search(re.sub(r"(?<=\D)\d{1,2}(?=$|\W|_)", "", name)))


def _shank(vertices: Array) -> Array | None:
    """The middle of the shank, if points (n, 3) are those of a bolt along an axis; None
    otherwise."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    for axis in range(3):
        across = np.delete(vertices - (low + high) / 2, axis, axis=1)
        wide = np.ptp(across, axis=0)
        radius, along = np.linalg.norm(across, axis=1), vertices[:, axis] - low[axis]
        head, length = radius > HEAD * radius.max(), high[axis] - low[axis]
        if np.ptp(wide) > ROUND * wide.max() or np.ptp(along[head]) > SHORT * length:
            continue
        ends = along[head].min(), length - along[head].max()
        tip = along > along[head].max() + 1e-6 if ends[0] < ends[1] else along < ends[0] - 1e-6
        outer = min(ends) < SHORT * length / 4 and bool(tip.any())
        slim = outer and radius[tip].max() <= SHANK * radius.max()
        if slim and radius.max() < max(ends):  # a brick has a stud that is shorter
            middle = (low + high) / 2
            middle[axis] = (vertices[tip, axis].min() + vertices[tip, axis].max()) / 2
            return np.asarray(middle)
    return None


@dataclass(frozen=True)
class _Place:
    """A sub-assembly of a tree: its path from the root, its units, and the axis of the floor along
    which its inputs come."""

    path: tuple[int, ...]
    units: Units
    axis: int


@dataclass
class Fastening:
    """Places screws in a tree of the other units of a product."""

    graphs: Blocking
    judged: Judged
    up: Stance
    places: list[_Place] = field(default_factory=list)
    joins: list[tuple[tuple[int, ...], int, Join]] = field(default_factory=list)
    driven: dict[tuple[int, ...], list[Join]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._walk(self.judged.tree, (), ROOT_AXIS, iter(self.judged.joins))
        self.places.sort(key=lambda place: (len(place.units), -len(place.path)))

    def _walk(self, tree: Tree, path: tuple[int, ...], axis: int, joins: Iterator[Join]) -> Units:
        if isinstance(tree, int):
            self.places.append(_Place(path, (tree,), axis))
            return (tree,)
        units = self._walk(tree[0], (*path, 0), 1 - axis, joins)
        for number, below in enumerate(tree[1:]):
            units = (*units, *self._walk(below, (*path, number + 1), 1 - axis, joins))
            self.joins.append((path, number, next(joins)))
        if len(tree) > 1:
            self.places.append(_Place(path, units, axis))
        return units

    def drive(self, screw: int, clamped: Sequence[int]) -> bool:
        """Drive a screw into the smallest sub-assembly that contains all parts that it clamps, if
        it can get there and no later operation collides with it. Returns whether there is such a
        place."""
        for place in self.places:
            if set(clamped) <= set(place.units) and self._passes(screw, place):
                join = self._way(screw, place)
                if join is not None:
                    self.driven.setdefault(place.path, []).append(join)
                    return True
        return False

    def _with_screws(self, units: Units, path: tuple[int, ...]) -> Units:
        """Units, and the screws that are driven in at a path or below it."""
        screws = [
            join.come[0]
            for at, joins in self.driven.items()
            for join in joins
            if at[: len(path)] == path or set(join.pile) <= set(units)
        ]
        return (*units, *dict.fromkeys(screws))

    def _way(self, screw: int, place: _Place) -> Join | None:
        """The motion of a screw to a place: from above, or else along the axis of its carrier."""
        units = self._with_screws(place.units, place.path)
        ways: list[tuple[Direction, bool]] = [((self.up.axes[2], self.up.up), True)]
        ways += [((self.up.axes[place.axis], side), False) for side in (+1, -1)]
        for (axis, side), lowered in ways:
            at = np.ix_([screw], units) if side > 0 else np.ix_(units, [screw])
            if not self.graphs.locks[axis][at].any():
                level = int(self.graphs.levels[axis][at].max())
                return Join(tuple(sorted(units)), (screw,), (axis, side), level, lowered)
        return None

    def _passes(self, screw: int, place: _Place) -> bool:
        """Whether a screw in a place blocks no later operation."""
        for path, number, join in self.joins:
            here = place.path[: len(path)] == path and len(place.path) > len(path)
            child = place.path[len(path)] if here else number + 2
            if child > number + 1:
                continue
            comes = child == number + 1
            others = self._with_screws(join.pile if comes else join.come, (-1,))
            axis, side = join.direction
            at = np.ix_([screw], others) if comes == (side > 0) else np.ix_(others, [screw])
            if self.graphs.locks[axis][at].any():
                return False
        return True

    def result(self, dwell: float) -> Judged:
        """The tree with its screws. Each takes a robot that brings it, and a driver for `dwell`
        [s]; screws with equal labels are driven in one after the other."""
        screws = [join for joins in self.driven.values() for join in joins]
        most = max(map(len, self.driven.values()), default=0)
        return replace(
            self.judged,
            tree=self._rebuilt(self.judged.tree, ()),
            joins=(*self.judged.joins, *screws),
            robots=self.judged.robots + 2 * len(screws),
            seconds=self.judged.seconds + dwell * most,
        )

    def _rebuilt(self, tree: Tree, path: tuple[int, ...]) -> Tree:
        if not isinstance(tree, int):
            tree = tuple(self._rebuilt(below, (*path, n)) for n, below in enumerate(tree))
        joins = self.driven.get(path)
        return Screwed(tree, tuple(join.come[0] for join in joins)) if joins else tree


def renumbered(judged: Judged, units: Sequence[int]) -> Judged:
    """A judged tree with renumbered units."""

    def tree(old: Tree) -> Tree:
        return units[old] if isinstance(old, int) else tuple(map(tree, old))

    def many(old: Units) -> Units:
        return tuple(units[n] for n in old)

    joins = tuple(replace(j, pile=many(j.pile), come=many(j.come)) for j in judged.joins)
    return replace(judged, tree=tree(judged.tree), joins=joins)


def fastened(
    graphs: Blocking, judged: Judged, screws: Sequence[int], dwell: float
) -> tuple[Judged, tuple[int, ...]]:
    """A tree of all other units with the screws in it, and the screws for which there is no
    place."""
    work = Fastening(graphs, judged, judged.stance)
    others = np.ones(len(graphs), bool)
    others[list(screws)] = False
    left = tuple(
        screw
        for screw in screws
        if not work.drive(screw, np.flatnonzero(graphs.touch[screw] & others).tolist())
    )
    return work.result(dwell), left
