"""Screws: which parts are screws, and where in a tree they are driven in, after all that they
clamp, and their nuts put on."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from factory.apps.planning.bases import EQUAL
from factory.apps.planning.blocking import Blocking
from factory.apps.planning.cannot import Direction, Units
from factory.apps.planning.drivers import Drivers
from factory.apps.planning.exact import Tree
from factory.apps.planning.judging import Join, Judged
from factory.apps.planning.parts import InPlace
from factory.apps.planning.shanks import screws_among
from factory.apps.planning.subsets import ROOT_AXIS, Stance
from factory.apps.planning.threads import Thread
from factory.apps.planning.writing import Screwed

ROW = 1e-3
"""Screws are in one row if the next one is no further than this along their carrier's way [m]."""


def fasteners(source: InPlace, named: Sequence[str]) -> tuple[str, ...]:
    """The units of a source that are screws: those that are `named`, and parts that are recognised
    (`shanks`)."""
    kept = {keep.label for keep in source.kept}
    screws = {*screws_among(source.parts, named), *named}
    return tuple(label for label, _ in source.units() if label in named or label in screws - kept)


@dataclass(frozen=True)
class _Place:
    """A sub-assembly of a tree: its path from the root, its units, and the axis of the floor along
    which its inputs come."""

    path: tuple[int, ...]
    units: Units
    axis: int

    def is_on(self, base: _Place) -> bool:
        """Whether another place is the pile, of the pile, ... of this one."""
        more = base.path[len(self.path) :]
        return base.path[: len(self.path)] == self.path and not any(more)


@dataclass
class Fastening:
    """Places screws in a tree of the other units of a product; `late`: not in the smallest
    sub-assembly in which they can be, but in the largest of which that is the base."""

    graphs: Blocking
    judged: Judged
    up: Stance
    drivers: Drivers
    late: bool = False
    places: list[_Place] = field(default_factory=list)
    joins: list[tuple[tuple[int, ...], int, Join]] = field(default_factory=list)
    driven: dict[tuple[int, ...], list[Join]] = field(default_factory=dict)
    put: dict[tuple[int, ...], list[Join]] = field(default_factory=dict)

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

    def drive(self, threads: Sequence[Thread]) -> bool:
        """Drive screws, one after the other, into the smallest sub-assembly that contains all parts
        that they clamp, if they can get there and no later operation collides with them. Returns
        whether there is such a place."""
        needed = {unit for thread in threads for unit in thread.clamps}
        late = self.late and all(thread.into < 0 for thread in threads)
        screws = [thread.screw for thread in threads]
        return any(
            self._joined(screws, needed, self.driven, (self.up.up,), late, passed)
            for passed in (False, True)
        )

    def put_on(self, ring: int, screw: int, near: Sequence[int]) -> bool:
        """Put a nut or a washer on a screw, from above or from below, in the smallest sub-assembly
        that has that screw and all that is `near` the ring. Returns whether there is such a
        place."""
        return self._joined([ring], {screw, *near}, self.put, (self.up.up, -self.up.up))

    def _joined(
        self,
        come: Sequence[int],
        needed: Collection[int],
        at: dict[tuple[int, ...], list[Join]],
        upright: Sequence[int],
        late: bool = False,
        passed: bool = False,
    ) -> bool:
        """Whether there is a place for some units; `passed`: where they come across the way of its
        carrier, which passes the pile on to another robot."""
        chosen: tuple[_Place, list[Join]] | None = None
        for place in self.places:
            if chosen is not None and not (late and place.is_on(chosen[0])):
                continue
            if {*needed} <= {*self._with_screws(place.units, place.path)}:
                axis = 1 - place.axis if passed else place.axis
                joins = self._ways(come, replace(place, axis=axis), upright, at is self.driven)
                chosen = (place, joins) if joins else chosen
        if chosen is not None:
            at.setdefault(chosen[0].path, []).extend(chosen[1])
        return chosen is not None

    def _ways(
        self, come: Sequence[int], place: _Place, upright: Sequence[int], turned: bool
    ) -> list[Join]:
        """The motions of some units to a place, one after the other; empty if one cannot get there,
        or a driver to it (`turned`)."""
        joins = list[Join]()
        there = self._with_screws(place.units, place.path)
        for unit in self._in_rows(come, place):
            join = self._way(unit, there, place.axis, upright)
            if join is None or not self._passes(unit, place):
                return []
            if turned and not self.drivers.reach(unit, join.direction, there):
                return []
            joins.append(join)
            there = (*there, unit)
        return joins

    def _in_rows(self, come: Sequence[int], place: _Place) -> Iterator[int]:
        """Some units in an order in which their carrier, which goes on along an axis of the floor,
        goes the least: row by row across its way, to and fro, the row that is ahead first."""
        middles = (self.graphs.low + self.graphs.high) / 2 @ self.up.rotation.T
        along, across = middles[:, 1 - place.axis], middles[:, place.axis]
        rows, last = list[list[int]](), np.inf
        for unit in sorted(come, key=lambda unit: -float(along[unit])):
            if last - along[unit] > ROW:
                rows.append([])
            rows[-1].append(unit)
            last = along[unit]
        for number, row in enumerate(rows):
            yield from sorted(row, key=lambda unit: float(across[unit]), reverse=number % 2 > 0)

    def _with_screws(self, units: Units, path: tuple[int, ...]) -> Units:
        """Units, and the screws that are driven in at a path or below it, with their rings."""
        screws = [
            join.come[0]
            for at, joins in (*self.driven.items(), *self.put.items())
            for join in joins
            if at[: len(path)] == path or set(join.pile) <= set(units)
        ]
        return (*units, *dict.fromkeys(screws))

    def _way(self, unit: int, there: Units, across: int, upright: Sequence[int]) -> Join | None:
        """The motion of a unit to others: along the vertical, or else along the axis of their
        carrier."""
        ways: list[tuple[Direction, bool]] = [((self.up.axes[2], side), True) for side in upright]
        ways += [((self.up.axes[across], side), False) for side in (+1, -1)]
        for (axis, side), lowered in ways:
            at = np.ix_([unit], there) if side > 0 else np.ix_(there, [unit])
            if not self.graphs.locks[axis][at].any():
                level = int(self.graphs.levels[axis][at].max())
                return Join(tuple(sorted(there)), (unit,), (axis, side), level, lowered)
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
        """The tree with its screws, and with their nuts. Each screw takes a robot that brings it,
        and those of one sub-assembly a driver for `dwell` [s] one after the other."""
        turns = sum(len(self._runs(place.path)) // 2 * 2 for place in self.places)
        screws = [join for joins in self.driven.values() for join in joins]
        rings = [join for joins in self.put.values() for join in joins]
        most = max(map(len, self.driven.values()), default=0)
        return replace(
            self.judged,
            tree=self._rebuilt(self.judged.tree, ()),
            joins=(*self.judged.joins, *screws, *rings),
            relays=self.judged.relays + turns,
            robots=self.judged.robots + len(screws) + len(self.driven) + 2 * len(rings) + turns,
            seconds=self.judged.seconds + dwell * most,
        )

    def _rebuilt(self, tree: Tree, path: tuple[int, ...]) -> Tree:
        if not isinstance(tree, int):
            tree = tuple(self._rebuilt(below, (*path, n)) for n, below in enumerate(tree))
        runs = self._runs(path)
        for number, run in enumerate(runs):
            tree = (tree,) if number else tree
            tree = Screwed(tree, tuple(run)) if run else tree
        return self._with_rings(tree if len(runs) % 2 else (tree,), path)

    def _runs(self, path: tuple[int, ...]) -> list[list[int]]:
        """The screws of a place one after the other, in runs between which it is passed on to a
        robot on the other axis: those of the first, which may be none, come from above or along the
        axis of its carrier, those of the second along the other one."""
        runs, here = [list[int]()], ROOT_AXIS ^ len(path) % 2
        for join in self.driven.get(path, []):
            along = self.up.axes.index(join.direction[0])
            if along != here and not join.lowered:
                runs.append([])
                here = 1 - here
            runs[-1].append(join.come[0])
        return runs

    def _with_rings(self, tree: Tree, path: tuple[int, ...]) -> Tree:
        """A sub-assembly with its nuts and washers: those from above, or from the side, are
        inserted one after the other, and it is lowered onto each of those from below. Each time its
        axis turns, so that it may have to be handed over first."""
        joins = self.put.get(path, [])
        under = [join.lowered and join.direction[1] != self.up.up for join in joins]
        above = [join.come[0] for join, is_below in zip(joins, under, strict=True) if not is_below]
        below = [join.come[0] for join, is_below in zip(joins, under, strict=True) if is_below]
        if self._slides_below(path) and (bool(above) + len(below)) % 2:
            tree = (tree,)
        tree = (tree, *above) if above else tree
        for ring in below:
            tree = (tree, ring)
        return tree

    def _slides_below(self, path: tuple[int, ...]) -> bool:
        """Whether the way of some join below a path, or at it, is horizontal."""
        every = [(at, join) for at, _, join in self.joins]
        every += [(at, join) for at, joins in self.driven.items() for join in joins]
        return any(at[: len(path)] == path and not join.lowered for at, join in every)


def renumbered(judged: Judged, units: Sequence[int]) -> Judged:
    """A judged tree with renumbered units."""

    def tree(old: Tree) -> Tree:
        return units[old] if isinstance(old, int) else tuple(map(tree, old))

    def many(old: Units) -> Units:
        return tuple(units[n] for n in old)

    joins = tuple(replace(j, pile=many(j.pile), come=many(j.come)) for j in judged.joins)
    return replace(judged, tree=tree(judged.tree), joins=joins)


def fastened(
    graphs: Blocking, judged: Judged, threads: Sequence[Thread], dwell: float, drivers: Drivers
) -> tuple[Judged, tuple[int, ...]]:
    """A tree of all other units with the screws in it, and their nuts, and those of both for which
    there is no place. They come last where that takes no longer, and costs no more."""
    early, late = (_fastened(graphs, judged, threads, dwell, drivers, n) for n in (False, True))
    no_worse = len(late[1]) <= len(early[1]) and late[0].price <= early[0].price
    return late if no_worse and late[0].seconds <= EQUAL * early[0].seconds else early


def _fastened(
    graphs: Blocking,
    judged: Judged,
    threads: Sequence[Thread],
    dwell: float,
    drivers: Drivers,
    late: bool,
) -> tuple[Judged, tuple[int, ...]]:
    work, left = Fastening(graphs, judged, judged.stance, drivers, late), list[int]()
    alike: dict[tuple[str, int], list[Thread]] = {}
    for one in threads:
        alike.setdefault((one.kind, one.into), []).append(one)
    for several in alike.values():
        if not work.drive(several):  # in one place, to share a driver
            left += [one.screw for one in several if not work.drive([one])]
    screws, follow = {one.screw for one in threads}, {n for one in threads for n in one.follow}
    for one in threads:
        for ring in one.follow if one.screw not in left else ():
            near = np.flatnonzero(graphs.touch[ring]).tolist()
            needed = [n for n in near if n not in screws | follow]
            if not work.put_on(ring, one.screw, needed):
                left.append(ring)
    return work.result(dwell), tuple(left)
