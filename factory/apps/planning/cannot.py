"""Interlocking parts, which no sequence of two-handed straight motions along the axes can join.

*Theorem.* Parts in place can be joined two by two, each time by one straight motion along an axis,
if and only if no set of two or more of them is strongly connected in the blocking graphs of all
three axes. *Proof.* Some motion of the tree would divide such a set along some axis; a part that
leaves is blocked by one that stays, because a strongly connected graph has no closed proper subset.
If there is no such set, the strong components of the first axis that has several leave one after
the other. A subset of parts that can be separated can be separated, so no choice has to be undone.
(Axes are those of the product, which may stand on the floor in any orientation: a robot that hands
over to another turns the axis along which its inputs come.)

So the largest interlocked sets are found by refinement: all parts are divided by the strong
components of each axis in turn until no set is divided any more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from factory.apps.planning.blocking import AXES, Blocking

Direction = tuple[int, int]
"""An axis of the product, 0 to 2, and the side of it, +1 or -1, to which a part leaves."""

Units = tuple[int, ...]
"""Numbers of units, ascending."""


def named(direction: Direction) -> str:
    """A direction along an axis in words: `+x`."""
    axis, side = direction
    return f"{'-+'[side > 0]}{'xyz'[axis]}"


ROUNDS = 400
"""The most interlocked sets that are enumerated to prove that a removal is the smallest."""


@dataclass(frozen=True, slots=True)
class LeastClash:
    """Two parts that block each other in all six directions: the least depth [m] of their overlap,
    a lower bound, and the direction in which the first leaves with that depth."""

    one: str
    other: str
    depth: float
    way: Direction


@dataclass(frozen=True, slots=True)
class Interlock:
    """Parts that cannot be divided into two groups by one motion: their `labels`, and as a proof
    for each of the six directions a circuit through all of them, in which each part, leaving in
    that direction, is blocked by the next one, and the last by the first. A part may occur several
    times. `clashes`: the pairs that block each other by themselves."""

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
    """Parts without which, or with whose clashes accepted, the rest can be joined. `smallest`:
    whether it is proved that no smaller set suffices."""

    labels: tuple[str, ...]
    smallest: Literal[True, False]


def interlocks(graphs: Blocking) -> tuple[Interlock, ...]:
    """The largest sets of units that interlock; none for a product that can be assembled."""
    every = tuple(range(len(graphs)))
    return tuple(
        Interlock(
            tuple(graphs.labels[n] for n in core),
            tuple(_circuits(graphs, core)),
            _clashes(graphs, core),
        )
        for core in cores(graphs.locks, every)
    )


def _clashes(graphs: Blocking, core: Units) -> tuple[LeastClash, ...]:
    """The pairs of an interlocked set that cannot pass each other in any direction."""
    if not graphs.depths.size:
        return ()
    held = np.asarray((graphs.locks & graphs.locks.transpose(0, 2, 1)).all(axis=0))
    pairs = [(one, other) for one, other in combinations(core, 2) if held[one, other]]
    made = []
    for one, other in pairs:
        depth, *way = graphs.least(one, other)
        made.append(LeastClash(graphs.labels[one], graphs.labels[other], depth, (way[0], way[1])))
    return tuple(sorted(made, key=lambda clash: (clash.depth, clash.one, clash.other)))


def cores(locks: NDArray[np.bool_], members: Sequence[int]) -> list[Units]:
    """The largest interlocked sets among some units; `locks` (3, n, n)."""
    blocks, interlocked = [np.asarray(members, np.int64)], list[Units]()
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
            interlocked.append(tuple(block.tolist()))
    return sorted(interlocked)


def strong(locks: NDArray[np.bool_], block: NDArray[np.int64]) -> tuple[int, NDArray[np.int32]]:
    """The number of strong components of some units along an axis, and the component of each
    unit."""
    count, piece = connected_components(locks[np.ix_(block, block)], connection="strong")
    return int(count), piece


def smallest_core(locks: NDArray[np.bool_], core: Units) -> Units:
    """A minimal interlocked subset of an interlocked set."""
    for unit in core:
        if unit not in core:
            continue
        rest = cores(locks, [n for n in core if n != unit])
        if rest:
            core = min(rest, key=len)
    return core


def removal(graphs: Blocking) -> Removal:
    """The smallest set of units without which nothing interlocks: a smallest hitting set of the
    interlocked sets seen so far. If the remaining units still interlock, their sets are added."""
    locks, seen = graphs.locks, list[Units]()
    chosen: Units = ()
    for _ in range(ROUNDS):
        rest = [n for n in range(len(graphs)) if n not in chosen]
        left = cores(locks, rest)
        if not left:
            return Removal(tuple(graphs.labels[n] for n in chosen), True)
        seen += [smallest_core(locks, core) for core in left]
        chosen = _hitting(seen, len(graphs))
    while left := cores(locks, [n for n in range(len(graphs)) if n not in chosen]):
        chosen = (*chosen, smallest_core(locks, left[0])[0])
    return Removal(tuple(graphs.labels[n] for n in sorted(chosen)), False)


def _hitting(sets: Sequence[Units], count: int) -> Units:
    """The smallest set of units that contains one of every set, by an integer program. Among equal
    solutions, later units of the source are preferred: they usually hold less."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    has = np.zeros((len(sets), count))
    for row, members in enumerate(sets):
        has[row, list(members)] = 1.0
    cost = 1.0 - np.arange(count) / (2.0 * count * count)
    solved = milp(
        cost, constraints=LinearConstraint(has, lb=1.0), integrality=1, bounds=Bounds(0, 1)
    )
    return tuple(np.flatnonzero(np.round(solved.x)).tolist())


def _circuits(graphs: Blocking, core: Units) -> Iterator[tuple[Direction, tuple[str, ...]]]:
    """For each direction a closed walk through all units of an interlocked set, always to the
    nearest unit that is not yet visited."""
    import networkx as nx

    for axis, side in product(AXES, (+1, -1)):
        locks = graphs.locks[axis][np.ix_(core, core)]
        graph = nx.from_numpy_array(locks if side > 0 else locks.T, create_using=nx.DiGraph)
        walk, left = [0], set(range(1, len(core)))
        while left:
            ways = nx.single_source_shortest_path(graph, walk[-1])
            walk += ways[min(left, key=lambda n, ways=ways: (len(ways[n]), n))][1:]  # type: ignore[misc]
            left.difference_update(walk)
        back = nx.shortest_path(graph, walk[-1], 0)[1:-1]
        yield (axis, side), tuple(graphs.labels[core[n]] for n in (*walk, *back))
