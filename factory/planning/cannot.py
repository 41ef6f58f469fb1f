"""Which parts interlock, so that no tree of two-handed straight motions along the axes joins them.

*Theorem.* Parts in place can be joined two by two, each time by one straight motion along an axis,
if and only if no set of two or more of them is strongly connected in the blocking graphs of all
three axes. *Proof.* Such a set would be divided by some motion of the tree, along some axis; some
part that goes is in the way of one that stays in the graph of that direction, as a strongly
connected graph has no closed proper subset. Where there is none, the strong components of the first
axis that has several come out one after the other, and a subset of what comes apart comes apart:
so no choice has to be undone. (Axes are of the product, turned onto the floor in any way: a robot
that hands over to another turns the axis along which its inputs come.)

So the largest interlocked sets are found by refining: all parts are divided by the strong
components of each axis in turn until nothing divides any more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from factory.planning.blocking import AXES, Blocking

Direction = tuple[int, int]
"""An axis of the product, 0 to 2, and the side, +1 or -1, to which something goes out."""

Units = tuple[int, ...]
"""Numbers of units, ascending."""


def named(direction: Direction) -> str:
    """A direction along an axis in words: `+x`."""
    axis, side = direction
    return f"{'-+'[side > 0]}{'xyz'[axis]}"


ROUNDS = 400
"""So many interlocked sets, at most, are looked for to prove that a removal is the smallest."""


@dataclass(frozen=True, slots=True)
class LeastClash:
    """Two parts that get into each other on each of the six ways: how deep [m] on that on which
    they do least, a lower bound, and to where the first goes out there."""

    one: str
    other: str
    depth: float
    way: Direction


@dataclass(frozen=True, slots=True)
class Interlock:
    """Parts no two groups of which come apart: their `labels`, and for each of the six directions a
    circuit through all of them, each of which, going out there, meets the next one (and the last
    the first), so that none can leave the others: a proof. A part may come by several times.
    `clashes`: the pairs of them that hold each other by themselves."""

    labels: tuple[str, ...]
    circuits: tuple[tuple[Direction, tuple[str, ...]], ...]
    clashes: tuple[LeastClash, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """The labels, and the circuits by direction, as `+x`."""
        ways = {named(direction): way for direction, way in self.circuits}
        clashes = [
            {"parts": [c.one, c.other], "depth_mm": round(1e3 * c.depth, 4), "way": named(c.way)}
            for c in self.clashes
        ]
        circuits = {way: list(circuit) for way, circuit in ways.items()}
        return {"parts": list(self.labels), "circuits": circuits, "clashes": clashes}


@dataclass(frozen=True, slots=True)
class Removal:
    """Parts without which, or with whose clashes accepted, the rest can be joined; whether it is
    proved that no fewer do (`smallest`)."""

    labels: tuple[str, ...]
    smallest: Literal[True, False]


def interlocks(found: Blocking) -> tuple[Interlock, ...]:
    """The largest sets of units that interlock, none for a product that can be joined."""
    every = tuple(range(len(found)))
    return tuple(
        Interlock(
            tuple(found.labels[n] for n in core),
            tuple(_circuits(found, core)),
            _clashes(found, core),
        )
        for core in cores(found.locks, every)
    )


def _clashes(found: Blocking, core: Units) -> tuple[LeastClash, ...]:
    """The pairs of an interlocked set that cannot pass each other on any way."""
    if not found.depths.size:
        return ()
    held = np.asarray((found.locks & found.locks.transpose(0, 2, 1)).all(axis=0))
    pairs = [(one, other) for one, other in combinations(core, 2) if held[one, other]]
    made = []
    for one, other in pairs:
        depth, *way = found.least(one, other)
        made.append(LeastClash(found.labels[one], found.labels[other], depth, (way[0], way[1])))
    return tuple(sorted(made, key=lambda clash: (clash.depth, clash.one, clash.other)))


def cores(locks: NDArray[np.bool_], members: Sequence[int]) -> list[Units]:
    """The largest interlocked sets among some units; `locks` (3, n, n)."""
    blocks, found = [np.asarray(members, np.int64)], list[Units]()
    while blocks:
        block = blocks.pop()
        if len(block) < 2:
            continue
        for axis in AXES:
            pieces, piece = strong(locks[axis], block)
            if pieces > 1:
                blocks += [block[piece == number] for number in range(pieces)]
                break
        else:
            found.append(tuple(block.tolist()))
    return sorted(found)


def strong(locks: NDArray[np.bool_], block: NDArray[np.int64]) -> tuple[int, NDArray[np.int32]]:
    """How many strong components some units have along an axis, and that of each."""
    count, piece = connected_components(locks[np.ix_(block, block)], connection="strong")
    return int(count), piece


def smallest_core(locks: NDArray[np.bool_], core: Units) -> Units:
    """An interlocked set within one, of which no part can be left out."""
    for unit in core:
        if unit not in core:
            continue
        rest = cores(locks, [n for n in core if n != unit])
        if rest:
            core = min(rest, key=len)
    return core


def removal(found: Blocking) -> Removal:
    """The fewest units without which nothing interlocks: of every interlocked set one has to go, a
    smallest hitting set of those seen so far; if what is left interlocks, that is one more."""
    locks, seen = found.locks, list[Units]()
    chosen: Units = ()
    for _ in range(ROUNDS):
        rest = [n for n in range(len(found)) if n not in chosen]
        left = cores(locks, rest)
        if not left:
            return Removal(tuple(found.labels[n] for n in chosen), True)
        seen += [smallest_core(locks, core) for core in left]
        chosen = _hitting(seen, len(found))
    while left := cores(locks, [n for n in range(len(found)) if n not in chosen]):
        chosen = (*chosen, smallest_core(locks, left[0])[0])
    return Removal(tuple(found.labels[n] for n in sorted(chosen)), False)


def _hitting(sets: Sequence[Units], count: int) -> Units:
    """The fewest units that have one of every set: an integer program; of several solutions the
    later units of the source, which hold less than the first."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    has = np.zeros((len(sets), count))
    for row, members in enumerate(sets):
        has[row, list(members)] = 1.0
    cost = 1.0 - np.arange(count) / (2.0 * count * count)
    solved = milp(
        cost, constraints=LinearConstraint(has, lb=1.0), integrality=1, bounds=Bounds(0, 1)
    )
    return tuple(np.flatnonzero(np.round(solved.x)).tolist())


def _circuits(found: Blocking, core: Units) -> Iterator[tuple[Direction, tuple[str, ...]]]:
    """For each direction a closed walk through all units of an interlocked set, on to the nearest
    one not yet visited."""
    import networkx as nx

    for axis, side in product(AXES, (+1, -1)):
        locks = found.locks[axis][np.ix_(core, core)]
        graph = nx.from_numpy_array(locks if side > 0 else locks.T, create_using=nx.DiGraph)
        walk, left = [0], set(range(1, len(core)))
        while left:
            ways = nx.single_source_shortest_path(graph, walk[-1])
            walk += ways[min(left, key=lambda n, ways=ways: (len(ways[n]), n))][1:]  # type: ignore[misc]
            left.difference_update(walk)
        back = nx.shortest_path(graph, walk[-1], 0)[1:-1]
        yield (axis, side), tuple(found.labels[core[n]] for n in (*walk, *back))
