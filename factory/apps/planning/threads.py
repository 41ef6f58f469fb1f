"""What each screw of a product goes through, and what comes after it: the nuts, and their washers,
that can be taken off while it is in place.

A stud, which has a nut but no head, is driven in before the parts that come over it; so is a screw
without which the other parts would touch nowhere. They are searched for as one unit with the part
that they are driven into.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from factory.apps.planning.blocking import Blocking
from factory.apps.planning.cannot import Units
from factory.apps.planning.parts import InPlace, PlacedPart
from factory.apps.planning.shanks import Shank, shank_of


@dataclass(frozen=True, slots=True)
class Thread:
    """A `screw` of some `kind`; the units that it `clamps`, which come before it; the rings that
    `follow` it, in their order; the unit `into` which it is driven before any other comes, -1 for
    none, and the one that this would be (`first`)."""

    screw: int
    kind: str
    clamps: Units
    follow: Units = ()
    into: int = -1
    first: int = -1


def threads(
    source: InPlace, graphs: Blocking, screws: Sequence[int], plain: Collection[int] = ()
) -> tuple[Thread, ...]:
    """The threads of some screws; `plain`: rings that are joined as other parts."""
    units = [parts for _, parts in source.units()]
    made: list[Thread] = []
    others = np.ones(len(graphs), bool)
    others[list(screws)] = False
    taken = {*plain}
    for screw in screws:
        near = np.flatnonzero(graphs.near[screw] & others).tolist()
        shank = shank_of(units[screw][0], bare=True) if len(units[screw]) == 1 else None
        thread = Thread(screw, units[screw][0].kind, tuple(near))
        if shank is not None:
            thread = _thread(graphs, units, near, thread, shank, taken)
        taken |= {*thread.follow}
        made.append(thread)
    follow = {ring for thread in made for ring in thread.follow}
    made = [replace(one, clamps=tuple(n for n in one.clamps if n not in follow)) for one in made]
    return tuple(_connected(graphs, made))


def _thread(
    graphs: Blocking,
    units: Sequence[tuple[PlacedPart, ...]],
    near: Sequence[int],
    thread: Thread,
    shank: Shank,
    taken: Collection[int],
) -> Thread:
    """A thread, with what surrounds its shank."""
    screw, axis = thread.screw, shank.axis
    around = [n for n in near if any(map(shank.is_in, units[n]))]
    rings = [
        n
        for n in around
        if n not in taken and len(units[n]) == 1 and shank.is_ringed_by(units[n][0])
    ]
    left, peeled = [*around], list[int]()
    locks = graphs.locks[axis]
    sides = set[int]()
    while len(left) > 1:
        there = [screw, *left]
        free = [
            (n, side)
            for n in rings
            if n in left
            for side in (+1, -1)
            if not (locks[n, there] if side > 0 else locks[there, n]).any()
        ]
        if not free:
            break
        sides.add(free[0][1])
        peeled.append(free[0][0])
        left.remove(free[0][0])
    clamps = tuple(sorted({*near} - {*peeled}))
    tail = shank.ends[0] if shank.headed else shank.ends[1 if sides == {-1} else 0]
    first = min(left, key=lambda n: _apart(graphs, n, axis, float(tail[axis])), default=-1)
    into = first if peeled and not shank.headed and len(sides) == 1 else -1
    needed = (into,) if into >= 0 else clamps
    return replace(thread, clamps=needed, follow=tuple(peeled[::-1]), into=into, first=first)


def _apart(graphs: Blocking, unit: int, axis: int, at: float) -> float:
    """The distance [m] of the middle of a unit from a place along an axis."""
    return abs(float(graphs.low[unit, axis] + graphs.high[unit, axis]) / 2 - at)


def _connected(graphs: Blocking, made: list[Thread]) -> list[Thread]:
    """The threads, of which as many are driven in before all other parts as are needed so that the
    others touch each other."""
    while True:
        free = {thread.screw for thread in made if thread.into < 0}
        free |= {ring for thread in made for ring in thread.follow}
        rest = [n for n in range(len(graphs)) if n not in free]
        groups = _groups(graphs, rest)
        if not rest or max(groups.values()) == 0:
            return made
        spans = {
            number: len({groups[n] for n in rest if graphs.near[thread.screw, n]})
            for number, thread in enumerate(made)
            if thread.into < 0 and thread.first >= 0
        }
        best = max(spans, key=spans.__getitem__, default=-1)
        if best < 0 or spans[best] < 2:
            return made
        made[best] = replace(made[best], into=made[best].first, clamps=(made[best].first,))


def _groups(graphs: Blocking, units: Sequence[int]) -> dict[int, int]:
    """The number of the connected group of each of some units."""
    touch: NDArray[np.bool_] = graphs.touch[np.ix_(units, units)]
    number = connected_components(touch, directed=False)[1]
    return dict(zip(units, number.tolist(), strict=True))
