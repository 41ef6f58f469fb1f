"""The pairs of parts that come to overlap when the inputs of operations come along an axis.

Candidates are the bodies whose boxes overlap across the axis. Boxes bound the depth, and for boxes
they give it; for the others the faces bound it better, and what is left is computed. Bodies of two
shapes are computed together, wherever they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.compiler.mating.bodies import Bodies
from factory.compiler.mating.depth import Difference, Polytope, deepest, exact, polytope, rough
from factory.compiler.mating.meetings import Ints, Meetings
from factory.geometry.meshes import Array

TOLERANCE = 2e-5
"""Overlaps of no more than this [m] do not count: what welds in the engine give way, and far above
what numbers written with five digits are rounded by."""

CLEAR = 5e-5
"""On their way bodies that do not overlap still need so much room between them [m], or they scrape:
faces that are flush catch at their edges when a weld gives way by its 0.03 mm."""

LAST = 1e-3
"""But for the last bit of the way [m]: finished parts may touch."""

SIGNS = (-1, +1)
"""The sides from which the last input comes: its path is shifted to this side of the axis."""

CHUNK = 4096
"""Bodies whose candidates are sought at a time."""


@dataclass(frozen=True)
class Contacts:
    """Pairs of parts that overlap by more than the tolerance in some place of a path, or scrape, by
    meeting.

    `meeting`, `one` < `other` (n,): numbers of the meeting and the parts; `finished` (n,): the
    depth in the finished product, 0 where apart; `path` (n, 2): the greatest depth if the last
    input comes from the lower or the upper side, and `shift` (n, 2) how far from its place that is
    [m]; `graze` (n, 2): the greatest depth but for the last bit of the way.
    """

    meeting: Ints
    one: Ints
    other: Ints
    finished: Array
    path: Array = field(repr=False)
    shift: Array = field(repr=False)
    graze: Array = field(repr=False)

    @property
    def faulty(self) -> NDArray[np.bool_]:
        """Which pairs (n, 2) overlap or scrape on the way from either side."""
        return np.asarray((self.path > TOLERANCE) | (self.graze > -CLEAR))

    def rows(self, meeting: int) -> range:
        """The rows of one meeting."""
        first, end = np.searchsorted(self.meeting, [meeting, meeting + 1])
        return range(int(first), int(end))


class Finder:
    """Finds contacts in one product; shapes are kept from one axis to the next."""

    def __init__(self, found: Bodies, where: Meetings) -> None:
        self.bodies, self.meetings = found, where
        self._polytopes: dict[bytes, Polytope] = {}
        self._differences: dict[tuple[bytes, bytes], Difference] = {}

    def along(self, axis: int, wanted: NDArray[np.bool_]) -> Contacts:
        """The contacts of the wanted meetings when their inputs come along an axis: x, y or z."""
        parts = [self._near(axis, wanted, n) for n in self._chunks(axis)]
        pairs = np.concatenate(parts, axis=1) if parts else np.zeros((3, 0), np.int64)
        moving, standing, meeting = pairs
        finished, path, shift = _box_paths(self.bodies, moving, standing, axis)
        graze = _box_paths(self.bodies, moving, standing, axis, LAST)[1]
        self._refine(moving, standing, axis, finished, path, shift, graze)
        idle = self.bodies.part[moving] < self.meetings.splits[meeting]
        path[idle], shift[idle], graze[idle] = finished[idle, None], 0.0, -np.inf
        return self._by_parts(meeting, moving, standing, finished, path, shift, graze)

    def _chunks(self, axis: int) -> Iterator[tuple[Ints, Ints]]:
        """Pairs (moving, standing) of bodies whose boxes overlap or are near across the axis, the
        part of the moving one being the later, in chunks."""
        from shapely import STRtree, box

        u, v = (i for i in range(3) if i != axis)
        low, high, part = self.bodies.low, self.bodies.high, self.bodies.part
        c = CLEAR / 2
        flat = box(low[:, u] - c, low[:, v] - c, high[:, u] + c, high[:, v] + c)
        tree = STRtree(flat)
        for start in range(0, len(flat), CHUNK):
            one, other = tree.query(flat[start : start + CHUNK])
            one = one + start
            later = part[one] > part[other]
            yield one[later], other[later]

    def _near(self, axis: int, wanted: NDArray[np.bool_], pairs: tuple[Ints, Ints]) -> Ints:
        """Those that meet at a wanted meeting and whose boxes come to overlap there: rows moving,
        standing, meeting (3, n)."""
        moving, standing = pairs
        meeting = self.meetings.of(self.bodies.part[standing], self.bodies.part[moving])
        chosen = wanted[meeting]
        moving, standing, meeting = moving[chosen], standing[chosen], meeting[chosen]
        path = _box_paths(self.bodies, moving, standing, axis)[1]
        graze = _box_paths(self.bodies, moving, standing, axis, LAST)[1]
        hit = ((path > TOLERANCE) | (graze > -CLEAR)).any(axis=1)
        return np.stack([moving[hit], standing[hit], meeting[hit]])

    def _refine(
        self,
        moving: Ints,
        standing: Ints,
        axis: int,
        finished: Array,
        path: Array,
        shift: Array,
        graze: Array,
    ) -> None:
        """Replaces the depths of boxes by those of the bodies where these are no boxes."""
        groups: dict[tuple[bytes, bytes], list[int]] = {}
        keys: dict[int, bytes] = {}
        both = self.bodies.boxes[moving] & self.bodies.boxes[standing]
        for row in np.flatnonzero(~both).tolist():
            pair = [self._key(int(body), keys) for body in (moving[row], standing[row])]
            groups.setdefault((pair[0], pair[1]), []).append(row)
        low = self.bodies.low
        for (p, q), members in groups.items():
            rows = np.array(members)
            apart = low[moving[rows]] - low[standing[rows]]
            for differ in (self._rough, self._exact):
                difference = differ(p, q)
                finished[rows] = difference.heights(apart).min(axis=1)
                for side, sign in enumerate(SIGNS):
                    direction = sign * np.eye(3)[axis]
                    path[rows, side], shift[rows, side] = deepest(difference, apart, direction)
                    further = apart + LAST * direction
                    graze[rows, side] = deepest(difference, further, direction)[0]
                left = ((path[rows] > TOLERANCE) | (graze[rows] > -CLEAR)).any(axis=1)
                rows, apart = rows[left], apart[left]
                if not len(rows):
                    break

    def _rough(self, p: bytes, q: bytes) -> Difference:
        """What is known of two shapes: all, if it was needed along another axis."""
        found = self._differences.get((p, q))
        return found or rough(self._polytopes[p], self._polytopes[q])

    def _exact(self, p: bytes, q: bytes) -> Difference:
        if (p, q) not in self._differences:
            self._differences[p, q] = exact(self._polytopes[p], self._polytopes[q])
        return self._differences[p, q]

    def _key(self, body: int, keys: dict[int, bytes]) -> bytes:
        if body not in keys:
            vertices, keys[body] = self.bodies.shape(body)
            if keys[body] not in self._polytopes:
                self._polytopes[keys[body]] = polytope(vertices)
        return keys[body]

    def _by_parts(
        self,
        meeting: Ints,
        moving: Ints,
        standing: Ints,
        finished: Array,
        path: Array,
        shift: Array,
        graze: Array,
    ) -> Contacts:
        """Of all bodies of two parts the deepest."""
        part = self.bodies.part
        kept = ((path > TOLERANCE) | (graze > -CLEAR)).any(axis=1)
        one, other, meeting = part[standing[kept]], part[moving[kept]], meeting[kept]
        finished, path, shift, graze = finished[kept], path[kept], shift[kept], graze[kept]
        order = np.lexsort((other, one, meeting))
        meeting, one, other = meeting[order], one[order], other[order]
        finished, path, shift, graze = finished[order], path[order], shift[order], graze[order]
        new = np.ones(len(order), bool)
        new[1:] = (np.diff(one) != 0) | (np.diff(other) != 0)
        starts = np.flatnonzero(new)
        if not len(starts):
            return Contacts(meeting, one, other, finished, path, shift, graze)
        deepest_paths = np.maximum.reduceat(path, starts)
        group = np.cumsum(new) - 1
        at = np.where(path >= deepest_paths[group], shift, np.inf)
        return Contacts(
            meeting[starts],
            one[starts],
            other[starts],
            np.maximum(np.maximum.reduceat(finished, starts), 0.0),
            deepest_paths,
            np.minimum.reduceat(at, starts),
            np.maximum.reduceat(graze, starts),
        )


def _box_paths(
    bodies: Bodies, moving: Ints, standing: Ints, axis: int, last: float = 0.0
) -> tuple[Array, Array, Array]:
    """The depths of bounding boxes (see `depth.py`) in closed form: in the end (n,), on the way
    from the lower and the upper side up to the `last` bit of it (n, 2), and how far away it
    is deepest (n, 2)."""
    low, high = bodies.low, bodies.high
    up, down = high[standing] - low[moving], high[moving] - low[standing]
    depth = np.minimum(up, down)
    across = np.delete(depth, axis, axis=1).min(axis=1)
    finished = np.minimum(across, depth[:, axis])
    path, shift = np.empty((len(moving), 2)), np.empty((len(moving), 2))
    half = (up[:, axis] + down[:, axis]) / 2
    for side, sign in enumerate(SIGNS):
        ahead = sign * (up[:, axis] - down[:, axis]) / 2 - last
        along = np.where(ahead > 0, half, half - np.abs(ahead))
        path[:, side] = np.minimum(across, along)
        least = np.maximum(ahead - (half - path[:, side]), 0.0)
        shift[:, side] = np.where(ahead > 0, least, 0.0)
    return finished, path, shift
