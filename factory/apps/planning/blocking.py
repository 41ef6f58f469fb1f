"""Directional blocking graphs: which parts block which along each axis, and which touch.

A part i that leaves along +axis past j, both in the finished product, is *blocked* by j as `check`
would find (`floor/mating/`): with the same bodies, depths and tolerance. The pairs of an axis
are a directional blocking graph (Wilson and Latombe, *Geometric Reasoning about Mechanical
Assembly*, 1994) for an infinite translation, so a part that is free in it can be removed
completely. The graph of the opposite direction is its transpose.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from factory.api import Finder
from factory.apps.planning.parts import InPlace
from factory.apps.planning.standing import Feet
from factory.floor.geometry.overlapping import Overlapping
from factory.floor.mating.overlaps import Overlaps
from factory.support.arrays import Array, Indices

FREE, SCRAPES, DEEPER, LOCKED, CLASHES = range(5)
"""Levels of blocking: none; the parts scrape, or stay drawn into each other; parts that were drawn
into each other get a little deeper; they pass through each other, which `check` leaves out; parts
that are apart in the end pass through each other, which `check` calls blocked. From LOCKED on,
parts interlock."""

TIMES, SLACK = 2.0, 3e-4
"""Parts that are drawn into each other and known only by their hulls interlock if they get deeper
on the way than so many times their depth when finished, plus SLACK [m]."""

NEAR = 5e-4
"""Parts no further apart than this [m] are near each other, as a bolt in a clearance hole."""

CONTACT = 5e-5
"""Parts no further apart than this [m] touch. If the product is then not connected, the nearest
parts of its components touch as well."""

GUIDED = 4
"""Of two units that are near each other one is in a hole of the other, and touches it whatever its
play, if it cannot leave past it in so many of the six directions."""

WIDER = 2.0
"""The growth factor of the gap by which components are connected."""

AXES = range(3)
"""x, y and z of the product."""


NO_RELATION = np.zeros((0, 0), bool)
"""A relation that does not matter."""

Unheld = tuple[frozenset[int], frozenset[int]]
"""Units that no hand can hold, and those to which they are joined then."""


@dataclass(frozen=True)
class Blocking:
    """The blocking graphs of the units of a plan, by their `labels`.

    `levels` (3, n, n): how much j blocks i that leaves along +x, +y or +z; the opposite direction
    has the transpose. `locks` (3, n, n): whether j prevents i from leaving. `touch` (n, n): which
    units touch; `near` (n, n): which are near each other. `low`, `high` (n, 3): their boxes [m].
    `depths` (3, n, n): how deep i gets into j [m]; empty if unknown. `hidden`: the parts of two
    units that overlap in the finished product according to the hull of an open mesh, the deepest
    first. `feet`: what units stand on; None if tipping does not matter. `base`: the unit onto which
    all others come, -1 for none. `pressed` (n, n): which are drawn into each other when finished,
    and hold by that. `rests` (n, n): whether i cannot fall past j, which is near it; empty if that
    does not matter. `worth` (n,): how much a unit is like a base; empty if unknown.
    """

    labels: tuple[str, ...]
    levels: NDArray[np.int8] = field(repr=False)
    locks: NDArray[np.bool_] = field(repr=False)
    touch: NDArray[np.bool_] = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)
    depths: Array = field(default_factory=lambda: np.zeros((3, 0, 0)), repr=False)
    hidden: tuple[Overlapping, ...] = field(default=(), repr=False)
    feet: Feet | None = field(default=None, repr=False)
    base: int = -1
    near: NDArray[np.bool_] = field(default_factory=lambda: NO_RELATION, repr=False)
    pressed: NDArray[np.bool_] = field(default_factory=lambda: NO_RELATION, repr=False)
    rests: NDArray[np.bool_] = field(default_factory=lambda: NO_RELATION, repr=False)
    worth: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    unheld: frozenset[Unheld] = field(default=frozenset(), repr=False)

    def __post_init__(self) -> None:
        for array in (self.levels, self.locks, self.touch, self.low, self.high, self.depths):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.labels)

    def allowing(self, allowed: Sequence[str]) -> Blocking:
        """The same graphs if units with these labels may pass through all others, or two (`a:b`)
        through each other."""
        free = np.isin(self.labels, allowed)
        accepted = free[:, None] | free
        for one, _, other in (name.partition(":") for name in allowed if ":" in name):
            both = np.isin(self.labels, one), np.isin(self.labels, other)
            accepted |= np.outer(*both) | np.outer(*both[::-1])
        return replace(self, locks=self.locks & ~accepted)

    @cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """The units that each unit touches."""
        return _rows(self.touch)

    @cached_property
    def carries(self) -> tuple[tuple[int, ...], ...]:
        """The units that rest on each unit."""
        return _rows(self.rests.T)

    def hangs(self, members: Sequence[int]) -> bool:
        """Whether units are connected by contacts."""
        left = {*members}
        return len(left) < 2 or len(_reached(self.neighbours, next(iter(left)), left)) == len(left)

    def stands(self, members: Sequence[int]) -> bool:
        """Whether units stay together by themselves: whichever falls, one of them is below it, down
        to a single one, or to several that hold each other, by which they are held."""
        if not len(self.rests) or len(members) < 2:
            return True
        every, seen, root = {*members}, set[int](), members[0]
        for unit in members:  # only the last one from which new ones are reached may carry all
            if unit not in seen:
                root = unit
                seen |= _reached(self.carries, unit, every)
        return len(_reached(self.carries, root, every)) == len(every)

    def standing(self, axis: int, side: int) -> Blocking:
        """The same graphs with what units rest on, if a side of an axis is up."""
        falling = self.levels[axis].T if side > 0 else self.levels[axis]
        return replace(self, rests=self.near & (self.pressed | (falling >= LOCKED)))

    def puts_under(self, pile: Sequence[int], come: Sequence[int]) -> bool:
        """Whether what comes is put under a pile, and does not rest on it."""
        below = len(self.rests) > 0 and bool(self.rests[np.ix_(pile, come)].any())
        return below and not self.rests[np.ix_(come, pile)].any()

    def can_hold(self, one: Sequence[int], other: Sequence[int]) -> bool:
        """Whether hands may hold both sides of a join: nothing is known that speaks against it."""
        if not self.unheld:
            return True
        sides = frozenset(one), frozenset(other)
        return not any(
            (mine == sides[0] and theirs <= sides[1]) or (mine == sides[1] and theirs <= sides[0])
            for mine, theirs in self.unheld
        )

    def least(self, one: int, other: int) -> tuple[float, int, int]:
        """The direction in which a unit gets least deep into another: the depth [m], the axis, and
        the side, +1 or -1, to which the first leaves."""
        sides = ((+1, one, other), (-1, other, one))
        return min(
            (float(self.depths[axis, i, j]), axis, side) for axis in AXES for side, i, j in sides
        )

    def grouped(self, groups: Sequence[Sequence[int]]) -> Blocking:
        """The graphs of groups of units that are already joined; each is named after its first
        unit."""
        count = len(groups)
        member = np.zeros((count, len(self)), bool)
        for number, group in enumerate(groups):
            member[number, list(group)] = True
        order = np.concatenate([np.flatnonzero(row) for row in member])
        starts = np.concatenate([[0], np.cumsum(member.sum(axis=1))[:-1]])

        def most(table: NDArray[Any]) -> NDArray[Any]:
            rows = np.maximum.reduceat(table[..., order, :][..., order], starts, axis=-2)
            return np.asarray(np.maximum.reduceat(rows, starts, axis=-1))

        itself = np.eye(count, dtype=bool)
        based = [number for number, group in enumerate(groups) if self.base in group]
        return Blocking(
            tuple(self.labels[group[0]] for group in groups),
            np.where(itself, FREE, most(self.levels)).astype(np.int8),
            most(self.locks) & ~itself,
            most(self.touch),
            np.minimum.reduceat(self.low[order], starts),
            np.maximum.reduceat(self.high[order], starts),
            feet=self.feet and self.feet.grouped(groups),
            base=based[0] if based else -1,
            rests=most(self.rests) if len(self.rests) else self.rests,
            worth=np.maximum.reduceat(self.worth[order], starts) if len(self.worth) else self.worth,
            unheld=frozenset(self._unheld_of(groups)),
        )

    def _unheld_of(self, groups: Sequence[Sequence[int]]) -> Iterator[Unheld]:
        """What no hand can hold, by the numbers of groups: what is made of whole groups."""
        for mine, theirs in self.unheld:
            here = frozenset(n for n, group in enumerate(groups) if not mine.isdisjoint(group))
            if sum(len(groups[n]) for n in here) == len(mine) and here:
                beside = (n for n, group in enumerate(groups) if not theirs.isdisjoint(group))
                yield here, frozenset(beside)


def _rows(table: NDArray[np.bool_]) -> tuple[tuple[int, ...], ...]:
    """The numbers of the columns that are set in each row, that on the diagonal left out."""
    return tuple(
        tuple(n for n in np.flatnonzero(row).tolist() if n != number)
        for number, row in enumerate(table)
    )


def _reached(ways: Sequence[Sequence[int]], first: int, among: Collection[int]) -> set[int]:
    """The units among some that are reached from a first one, itself included."""
    reached, todo = {first}, [first]
    while todo:
        for unit in ways[todo.pop()]:
            if unit in among and unit not in reached:
                reached.add(unit)
                todo.append(unit)
    return reached


def closure(relation: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The reflexive and transitive closure of a relation (n, n): the units that must leave with
    each unit, if the relation has those that lock it."""
    reach = (relation | np.eye(len(relation), dtype=bool)).astype(np.float32)
    while True:
        further = (reach @ reach > 0).astype(np.float32)
        if np.array_equal(further, reach):
            return np.asarray(reach > 0)
        reach = further


def blocking(source: InPlace, watch: Callable[[], None] = lambda: None) -> Blocking:
    """The blocking graphs of a source's units. Almost linear in the number of bodies, unless very
    many lie behind one another. `watch` is called often, and may raise."""
    units = source.units()
    finder, unit = _finder(source, watch)
    convex = finder.bodies
    count = len(units)
    levels, depths = np.zeros((3, count, count), np.int8), np.zeros((3, count, count))
    for axis in AXES:
        overlaps = finder.along(axis, np.ones(1, bool))
        _enter(overlaps, unit, levels[axis], depths[axis])
    bounds = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(bounds[0], unit[convex.part], convex.low)
    np.maximum.at(bounds[1], unit[convex.part], convex.high)
    labels = tuple(label for label, _ in units)
    touch = _touching(finder, unit, count)
    near = touch | _within(finder, unit, count, NEAR)
    hidden = _hidden(overlaps, unit, [part.label for _, members in units for part in members])
    locks, pressed = levels >= LOCKED, np.zeros((count, count), bool)
    locked = locks.sum(axis=0)
    touch |= near & (locked + locked.T >= GUIDED)
    drawn_in = overlaps.drawn_in
    pressed[unit[overlaps.one[drawn_in]], unit[overlaps.other[drawn_in]]] = True
    graphs = Blocking(labels, levels, locks, touch, *bounds, depths, hidden)
    return replace(graphs, near=near, pressed=pressed | pressed.T)


def rooms(source: InPlace, axis: int) -> Array:
    """The least clearance (n, n) [m] between units while the first leaves along an axis past the
    second: negative where they overlap, infinite where it is ample."""
    finder, unit = _finder(source)
    count = len(source.units())
    room = np.full((count, count), np.inf)
    moving, standing, least = finder.rooms(axis)
    one, other = unit[moving], unit[standing]
    for column, at in enumerate(((other, one), (one, other))):
        apart = one != other
        np.minimum.at(room, (at[0][apart], at[1][apart]), least[apart, column])
    return room


def _finder(source: InPlace, watch: Callable[[], None] = lambda: None) -> tuple[Finder, Indices]:
    """The finder of all parts, unit by unit, and the unit of each part."""
    units = source.units()
    unit = np.repeat(np.arange(len(units)), [len(members) for _, members in units])
    return Finder.at_once(source.product, watch), unit


def _hidden(overlaps: Overlaps, unit: Indices, labels: Sequence[str]) -> tuple[Overlapping, ...]:
    """The parts of two units that overlap in the finished product according to hulls alone; any
    axis shows them."""
    finished = overlaps.depths.finished
    drawn_in = overlaps.rough & overlaps.drawn_in & (unit[overlaps.one] != unit[overlaps.other])
    rows = np.flatnonzero(drawn_in)[np.argsort(-finished[drawn_in], kind="stable")]
    one, other = (array[rows].tolist() for array in (overlaps.one, overlaps.other))
    pairs = zip(one, other, finished[rows].tolist(), strict=True)
    return tuple(Overlapping(labels[one], labels[other], depth) for one, other, depth in pairs)


def _enter(overlaps: Overlaps, unit: Indices, levels: NDArray[np.int8], deep: Array) -> None:
    """Enter the overlaps along an axis. The later part of a pair leaves to the lower side and the
    earlier one to the upper side, or the other way round."""
    one, other, depths = unit[overlaps.one], unit[overlaps.other], overlaps.depths
    slack = TIMES * depths.finished[:, None] + SLACK
    level = np.where(depths.faulty, SCRAPES, FREE)
    level[overlaps.deeper] = DEEPER
    level[overlaps.deeper & (depths.path > slack)] = LOCKED
    level[overlaps.clashing] = CLASHES
    for column, (moving, standing) in enumerate(((one, other), (other, one))):
        apart = moving != standing
        at = moving[apart], standing[apart]
        np.maximum.at(levels, at, level[apart, column].astype(np.int8))
        np.maximum.at(deep, at, depths.path[apart, column])


def _touching(finder: Finder, unit: Indices, count: int) -> NDArray[np.bool_]:
    """Which units touch: those in contact, then those that connect components."""
    convex = finder.bodies
    touch = np.eye(count, dtype=bool)
    gap, furthest = CONTACT, float((convex.high.max(axis=0) - convex.low.min(axis=0)).max())
    while count > 1 and gap < 2 * furthest:
        near = _within(finder, unit, count, gap)
        pieces, piece = connected_components(touch, directed=False)
        if gap > CONTACT:
            near &= piece[:, None] != piece[None, :]
        touch |= near
        if pieces > 1 and connected_components(touch, directed=False)[0] == 1:
            break
        gap *= WIDER
    return touch


def _within(finder: Finder, unit: Indices, count: int, gap: float) -> NDArray[np.bool_]:
    """Which units (n, n) are at most so far from each other [m]."""
    near = np.zeros((count, count), bool)
    one, other = finder.near(gap)
    near[unit[one], unit[other]] = True
    return near | near.T
