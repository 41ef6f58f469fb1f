"""Legs: ways of an arm from one visit to the next.

A leg leaves a visit along a straight line, crosses clear of everything that stands, and comes to
the next visit along a straight line. It crosses along the straight joint line where that is clear,
else along one found by RRT-connect (Kuffner, LaValle 2000) and shortened.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.slowness import STIFF, way_through
from factory.support.arrays import Array, Index

Clearance = Callable[[Array], tuple[Array, Index]]
"""From configurations (m, n) to their margins (m,), the distance to what is nearest less the
clearance that it needs [m], and the number of the nearest pair (m,)."""

SPACING = 0.04
"""Between configurations of a polyline that are asked for their clearance [rad, m]."""

RESERVE = 0.006
"""Margin of a transfer's polyline: it is rounded afterwards, and more is between its samples
[m]."""

REACH, BEYOND = 0.36, 0.7
"""How far a tree grows at once, and how far beyond the two ends it may go [rad, m]."""

ROUNDS, SHORTCUTS = 4000, 60

ROUNDINGS = 0.1, 0.05, 0.025, 0.0125
"""Half widths of the average that rounds corners, tried in turn [s at the joints' full speed]."""

CHECKS = 150
"""Number of configurations of a way that are asked for their clearance."""


@dataclass(frozen=True, slots=True)
class NoWay:
    """Why there is no leg between two visits.

    Attributes:
        pair: number of the pair that was nearest in most configurations that were not clear.
        depth: greatest violation of its clearance [m].
        count: number of configurations that were not clear.
    """

    pair: int
    depth: float
    count: int


class _Search:
    """The search for a transfer: what is clear, and what was not."""

    def __init__(self, clearance: Clearance) -> None:
        self.clearance = clearance
        self.pairs: dict[int, list[float]] = {}

    def clear(self, a: Array, b: Array) -> bool:
        """Whether the straight joint line between two configurations is clear."""
        margin, pair = self.clearance(line(a, b))
        bad = margin < RESERVE
        for number, depth in zip(pair[bad].tolist(), margin[bad].tolist(), strict=True):
            self.pairs.setdefault(number, []).append(RESERVE - depth)
        return not bad.any()

    def no_way(self) -> NoWay:
        pair = max(sorted(self.pairs), key=lambda number: len(self.pairs[number]))
        return NoWay(pair, max(self.pairs[pair]), sum(map(len, self.pairs.values())))

    def shorten(self, path: list[Array], rng: np.random.Generator) -> list[Array]:
        """A polyline with shortcuts at random."""
        corners, asked = [*range(len(path))], dict[tuple[int, int], bool]()
        for _ in range(SHORTCUTS):
            if len(corners) < 3:
                break
            i, j = sorted(rng.choice(len(corners), 2, replace=False).tolist())
            ends = corners[i], corners[j]
            if j - i > 1 and ends not in asked:
                asked[ends] = self.clear(path[ends[0]], path[ends[1]])
            if asked.get(ends):
                corners = corners[: i + 1] + corners[j:]
        return [path[corner] for corner in corners]


def line(a: Array, b: Array) -> Array:
    """Configurations (k, n) on the straight joint line between two, at most SPACING apart.

    Args:
        a: the first (n,) [rad, m].
        b: the last (n,) [rad, m].
    """
    count = max(2, int(np.ceil(np.abs(b - a).max() / SPACING)) + 1)
    return np.asarray(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a))


def transfer(
    a: Array,
    b: Array,
    clearance: Clearance,
    limits: tuple[Array, Array],
    rounds: int = ROUNDS,
) -> Array | NoWay:
    """A clear polyline (k, n) in joint space [rad, m], or why none was seen.

    Args:
        a: its beginning (n,) [rad, m].
        b: its end (n,) [rad, m].
        clearance: of configurations.
        limits: least and greatest joint positions (n,) [rad, m].
        rounds: how often the trees grow.
    """
    search, rng = _Search(clearance), np.random.default_rng(0)
    if search.clear(a, b):
        return line(a, b)
    ends = clearance(np.stack([a, b]))[0] >= RESERVE
    path = _connect(a, b, search, limits, rng, rounds) if ends.all() else None
    if path is None:
        return search.no_way()
    path = search.shorten(path, rng)
    rows = [line(p, q)[1:] for p, q in pairwise(path)]
    return np.concatenate([a[None], *rows])


def _connect(
    a: Array,
    b: Array,
    search: _Search,
    limits: tuple[Array, Array],
    rng: np.random.Generator,
    rounds: int,
) -> list[Array] | None:
    """Corners of a clear polyline, by two trees that grow from its ends towards each other."""
    low = np.maximum(np.minimum(a, b) - BEYOND, limits[0])
    high = np.minimum(np.maximum(a, b) + BEYOND, limits[1])
    trees = ([a], [-1]), ([b], [-1])
    for number in range(rounds):
        (nodes, parents), (others, back) = trees[number % 2], trees[1 - number % 2]
        aim = rng.uniform(low, high)
        near = _nearest(nodes, aim)
        off = aim - nodes[near]
        grown = nodes[near] + off * min(1.0, REACH / float(np.abs(off).max()))
        if not search.clear(nodes[near], grown):
            continue
        nodes.append(grown)
        parents.append(near)
        meeting = _nearest(others, grown)
        if search.clear(grown, others[meeting]):
            one, two = _trace(nodes, parents, len(nodes) - 1), _trace(others, back, meeting)
            return one[::-1] + two if number % 2 == 0 else two[::-1] + one
    return None


def _nearest(nodes: Sequence[Array], q: Array) -> int:
    return int(np.abs(np.array(nodes) - q).max(axis=1).argmin())


def _trace(nodes: Sequence[Array], parents: Sequence[int], node: int) -> list[Array]:
    """The nodes from one to the root of its tree."""
    path = []
    while node >= 0:
        path.append(nodes[node])
        node = parents[node]
    return path


def leg(
    chain: SerialChain,
    out: Array,
    into: Array,
    clearance: Clearance,
    ends: Clearance,
    pace: WayLimits,
    stiff: tuple[float, float] = STIFF,
) -> JointWay | NoWay:
    """The way from one visit to the next, or why there is none.

    Args:
        chain: the arm.
        out: configurations along the straight beginning, from the visit (k, n) [rad, m].
        into: configurations along the straight end, to the visit (k, n) [rad, m].
        clearance: of configurations on the transfer.
        ends: of configurations on the straight beginning and end.
        pace: limits of the coordinate and the tool.
        stiff: shares of the straight beginning and end that are not rounded.
    """
    limits = chain.limits.low, chain.limits.high
    middle = transfer(out[-1], into[0], clearance, limits)
    if isinstance(middle, NoWay):
        return middle
    blocked: NoWay | None = None
    for rounding in ROUNDINGS:
        way = way_through(chain, out, middle, into, pace, stiff, rounding)
        blocked = obstruction(way, clearance, ends)
        if blocked is None:
            return way
    assert blocked
    return blocked


def obstruction(way: JointWay, clearance: Clearance, ends: Clearance) -> NoWay | None:
    """What a way comes nearer to than it may, at equal distances along it; None if nothing.

    Args:
        way: to be followed.
        clearance: of configurations on the transfer.
        ends: of configurations on the straight beginning and end.
    """
    x = np.linspace(0.0, way.length, CHECKS)
    q = way.at(x)[0]
    inside = (way.off <= x) & (x <= way.hover)
    margin, pair = np.empty(CHECKS), np.empty(CHECKS, int)
    for part, asked in ((inside, clearance), (~inside, ends)):
        margin[part], pair[part] = asked(q[part])
    if margin.min() >= 0.0:
        return None
    return NoWay(int(pair[margin.argmin()]), -float(margin.min()), int((margin < 0.0).sum()))
