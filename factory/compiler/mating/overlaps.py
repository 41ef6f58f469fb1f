"""The pairs of parts that come to overlap when the inputs of operations come along an axis.

Candidates are the bodies whose boxes overlap across the axis. Boxes bound the depth, and for boxes
they give it; for the others it is computed from the facets of the Minkowski difference. Bodies of
two shapes are computed together, wherever they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factory.compiler.mating.bodies import ConvexBodies
from factory.compiler.mating.depth import Difference, Polytope, exact, polytope
from factory.compiler.mating.meetings import Ints, Meetings
from factory.compiler.mating.paths import CLEAR, LAST, SIGNS, Depths, depths_of
from factory.compiler.mating.seeking import MANY, sought
from factory.geometry.meshes import Array
from factory.support import array_cache
from factory.support.array_cache import digest, program

FOLDER = "overlaps"
"""Where overlaps are kept, in the user's cache."""

KEYS = ("meeting", "moving", "standing", "finished", "path", "shift", "graze")
"""The arrays of an entry."""

CHUNK = 4096
"""Bodies whose candidates are sought at a time."""


@dataclass(frozen=True)
class BodyPairs:
    """Pairs of convex bodies: their numbers among those of their parts, and their depths (m,)."""

    one: Ints
    other: Ints
    depths: Depths = field(repr=False)

    def receding(self, rows: slice, side: int) -> list[tuple[int, int, float]]:
        """Those of `rows` that overlap or scrape on the way from a side, and how far [m] they must
        recede from each other so that they do not."""
        depths = self.depths.at(rows)
        chosen = np.flatnonzero(depths.faulty[:, side])
        pairs = self.one[rows][chosen].tolist(), self.other[rows][chosen].tolist()
        return list(zip(*pairs, depths.receding[chosen, side].tolist(), strict=True))


@dataclass(frozen=True)
class Overlaps:
    """Pairs of parts that overlap by more than the tolerance in some place of a path, or scrape, by
    meeting. `meeting`, `one` < `other` (n,): numbers of the meeting and the parts; `bodies`: what
    overlaps of them, those of row i from `starts[i]` to `starts[i + 1]` (n + 1,)."""

    meeting: Ints
    one: Ints
    other: Ints
    depths: Depths = field(repr=False)
    bodies: BodyPairs = field(repr=False)
    starts: Ints = field(repr=False)

    def of(self, meeting: int) -> Overlaps:
        """Those of one meeting."""
        first, end = np.searchsorted(self.meeting, [meeting, meeting + 1]).tolist()
        rows = slice(first, end)
        at = self.meeting[rows], self.one[rows], self.other[rows]
        return Overlaps(*at, self.depths.at(rows), self.bodies, self.starts[first : end + 1])


class Finder:
    """Finds overlaps in one product; shapes are kept from one axis to the next, what is found in
    the user's cache."""

    def __init__(self, found: ConvexBodies, where: Meetings) -> None:
        self.bodies, self.meetings = found, where
        self._keys: dict[int, bytes] = {}
        self._shapes: dict[bytes, Array] = {}
        self._polytopes: dict[bytes, Polytope] = {}
        self._differences: dict[tuple[bytes, bytes], Difference] = {}

    def along(self, axis: int, wanted: NDArray[np.bool_]) -> Overlaps:
        """The overlaps of the wanted meetings when their inputs come along an axis: x, y or z."""
        if self.bodies.boxes.all():  # found at once
            return self._by_parts(*self._search(axis, wanted))
        name = digest(self._product, axis, wanted)
        kept = array_cache.find(FOLDER, name, KEYS)
        if kept is None:
            meeting, moving, standing, depths = self._search(axis, wanted)
            arrays = (meeting, moving, standing, *astuple(depths))
            kept = dict(zip(KEYS, arrays, strict=True))
            array_cache.keep(FOLDER, name, kept)
        meeting, moving, standing, *rest = (kept[key] for key in KEYS)
        return self._by_parts(meeting, moving, standing, Depths(*rest))

    @cached_property
    def _product(self) -> str:
        """A digest of all that overlaps depend on."""
        where = self.meetings.borders, self.meetings.levels, self.meetings.splits
        own = program(Path(__file__).parent, "numpy", "scipy", "shapely")
        return digest(own, self.bodies.part, *where, *self.bodies.vertices)

    def _search(self, axis: int, wanted: NDArray[np.bool_]) -> tuple[Ints, Ints, Ints, Depths]:
        """The bodies, moving and standing, that overlap or scrape, and the meetings at which they
        do."""
        parts = [self._near(axis, wanted, *pairs) for pairs in self._chunks(axis)]
        moving, standing, meeting = np.concatenate([np.zeros((3, 0), np.int64), *parts], axis=1)
        depths = _box_depths(self.bodies, moving, standing, axis)
        self._refine(moving, standing, axis, depths)
        idle = self.bodies.part[moving] < self.meetings.splits[meeting]
        depths.path[idle], depths.shift[idle] = depths.finished[idle, None], 0.0
        depths.graze[idle] = -np.inf
        kept = np.flatnonzero(depths.faulty.any(axis=1))
        return meeting[kept], moving[kept], standing[kept], depths.at(kept)

    def _chunks(self, axis: int, apart: float = CLEAR) -> Iterator[tuple[Ints, Ints]]:
        """Pairs (moving, standing) of bodies whose boxes overlap or are at most so far `apart`
        across the axis, the part of the moving one being the later, in chunks."""
        from shapely import STRtree, box

        u, v = (i for i in range(3) if i != axis)
        low, high, part = self.bodies.low, self.bodies.high, self.bodies.part
        c = apart / 2
        flat = box(low[:, u] - c, low[:, v] - c, high[:, u] + c, high[:, v] + c)
        tree = STRtree(flat)
        for start in range(0, len(flat), CHUNK):
            one, other = tree.query(flat[start : start + CHUNK])
            one = one + start
            later = part[one] > part[other]
            yield one[later], other[later]

    def near(self, gap: float) -> tuple[Ints, Ints]:
        """Pairs of bodies of two parts that are at most so far [m] from each other, the later part
        first, wherever they meet. Bodies that meet with corners may be a little further apart."""
        one, other, depths = self.passing(2, gap, still=True)
        found = depths.finished >= -gap
        return one[found], other[found]

    def passing(self, axis: int, gap: float, still: bool = False) -> tuple[Ints, Ints, Depths]:
        """Pairs of bodies (moving, standing) of two parts, the later one moving, whose boxes are at
        most so far [m] from each other in some place of the way along an axis, `still` in the
        finished product, with their depths."""
        pairs = [self._beside(axis, gap, still, *pair) for pair in self._chunks(axis, gap)]
        one, other = np.concatenate([np.zeros((2, 0), np.int64), *pairs], axis=1)
        depths = _box_depths(self.bodies, one, other, axis)
        self._refine(one, other, axis, depths)
        return one, other, depths

    def _beside(self, axis: int, gap: float, still: bool, moving: Ints, standing: Ints) -> Ints:
        depths = _box_depths(self.bodies, moving, standing, axis)
        near = depths.finished if still else depths.path.max(axis=1)
        return np.asarray(np.stack([moving, standing])[:, near >= -gap])

    def _near(self, axis: int, wanted: NDArray[np.bool_], moving: Ints, standing: Ints) -> Ints:
        """Those that meet at a wanted meeting and whose boxes come to overlap there: rows moving,
        standing, meeting (3, n)."""
        meeting = self.meetings.of(self.bodies.part[standing], self.bodies.part[moving])
        found = np.stack([moving, standing, meeting])[:, wanted[meeting]]
        depths = _box_depths(self.bodies, found[0], found[1], axis)
        return np.asarray(found[:, depths.faulty.any(axis=1)])

    def _refine(self, moving: Ints, standing: Ints, axis: int, depths: Depths) -> None:
        """Replaces the depths of boxes by those of the bodies where these are no boxes."""
        groups: dict[tuple[bytes, bytes], list[int]] = {}
        both = self.bodies.boxes[moving] & self.bodies.boxes[standing]
        for row in np.flatnonzero(~both).tolist():
            pair = self._key(int(moving[row])), self._key(int(standing[row]))
            groups.setdefault(pair, []).append(row)
        low = self.bodies.low
        for pair, members in groups.items():
            rows = np.array(members)
            apart = low[moving[rows]] - low[standing[rows]]
            one, other = (self._shapes[key] for key in pair)
            if len(one) * len(other) > MANY:
                depths.put(rows, sought(one, other, apart, axis))
            else:
                difference = self._exact(pair)
                heights, slopes = difference.heights(apart), difference.normals[:, axis]
                depths.put(rows, depths_of(heights, slopes)[0])

    def _exact(self, pair: tuple[bytes, bytes]) -> Difference:
        if pair not in self._differences:
            self._differences[pair] = exact(*map(self._polytope, pair))
        return self._differences[pair]

    def _polytope(self, key: bytes) -> Polytope:
        if key not in self._polytopes:
            self._polytopes[key] = polytope(self._shapes[key])
        return self._polytopes[key]

    def _key(self, body: int) -> bytes:
        if body not in self._keys:
            vertices, key = self.bodies.shape(body)
            self._keys[body] = key
            self._shapes.setdefault(key, vertices)
        return self._keys[body]

    def _by_parts(self, meeting: Ints, moving: Ints, standing: Ints, depths: Depths) -> Overlaps:
        """Of all bodies of two parts the deepest."""
        part = self.bodies.part
        order = np.lexsort((part[moving], part[standing], meeting))
        meeting, one, other = meeting[order], part[standing[order]], part[moving[order]]
        depths, first = depths.at(order), np.searchsorted(part, part)
        standing, moving = standing[order], moving[order]
        bodies = BodyPairs(standing - first[standing], moving - first[moving], depths)
        new = np.ones(len(order), bool)
        new[1:] = (np.diff(one) != 0) | (np.diff(other) != 0)
        starts = np.flatnonzero(new)
        ends = np.append(starts, len(order))
        if not len(starts):
            return Overlaps(meeting, one, other, depths, bodies, ends)
        path = np.maximum.reduceat(depths.path, starts)
        at = np.where(depths.path >= path[np.cumsum(new) - 1], depths.shift, np.inf)
        by_parts = Depths(
            np.maximum(np.maximum.reduceat(depths.finished, starts), 0.0),
            path,
            np.minimum.reduceat(at, starts),
            np.maximum.reduceat(depths.graze, starts),
        )
        at_parts = meeting[starts], one[starts], other[starts]
        return Overlaps(*at_parts, by_parts, bodies, ends)


def _box_depths(bodies: ConvexBodies, moving: Ints, standing: Ints, axis: int) -> Depths:
    """The depths of bounding boxes (see `depth.py`), in closed form."""
    low, high = bodies.low, bodies.high
    up, down = high[standing] - low[moving], high[moving] - low[standing]
    depth = np.minimum(up, down)
    across = np.delete(depth, axis, axis=1).min(axis=1)[:, None]
    half = ((up[:, axis] + down[:, axis]) / 2)[:, None]
    ahead = (up[:, axis] - down[:, axis])[:, None] * np.array(SIGNS) / 2

    def most(ahead: Array) -> Array:
        along = np.where(ahead > 0, half, half - np.abs(ahead))
        return np.asarray(np.minimum(across, along))

    path = most(ahead)
    shift = np.where(ahead > 0, np.maximum(ahead - (half - path), 0.0), 0.0)
    finished = np.minimum(across[:, 0], depth[:, axis])
    return Depths(finished, path, shift, most(ahead - LAST))
