"""The pairs of parts that come to overlap when the inputs of operations come along an axis.

Candidates are the bodies whose boxes overlap across the axis. Boxes bound the depth, and for boxes
they give it; for the others it is computed from the facets of the Minkowski difference. Bodies of
two shapes are computed together, wherever they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.overlap import MODULES
from factory.floor.geometry.solids import Product
from factory.floor.mating.bodies import ROUNDING, BodyShapes, ConvexBodies, bodies
from factory.floor.mating.boxes import box_depths
from factory.floor.mating.drawn import NONE, DrawnWays, Watch
from factory.floor.mating.meetings import Meetings, meetings
from factory.floor.mating.overlaps import BodyPairs, Overlaps
from factory.floor.mating.paths import CLEAR, MANY, WAYS, Depths, depths_of, sought
from factory.support.arrays import Array, Indices
from factory.support.cache import digest, load_arrays, program, store_arrays
from factory.theory.compiler.expanding import Node

FOLDER = "overlaps"
"""Where overlaps are kept, in the user's cache."""

KEYS = ("meeting", "moving", "standing", "finished", "path", "shift", "graze", "cuts")
DRAWN, ROUGH = tuple(f"drawn_{key}" for key in KEYS), "rough"
"""The arrays of an entry: of bodies, of parts as they are drawn, and of all parts."""

Flags = NDArray[np.bool_]

CHUNK = 4096
"""Bodies whose candidates are sought at a time."""


Pairs = tuple[Indices, Indices, Indices, Depths]
"""Pairs of bodies, or of parts: their meetings, what moves and what stands, and their depths."""


class Finder:
    """Finds the overlaps of the parts of one product on the ways on which operations join them.
    Shapes are kept with the product, what is found in the user's cache.

    Attributes:
        UPRIGHT: the axis along which an input is lowered: x, y and z are 0, 1 and 2.
        AMPLE: more room than this is not measured [m].
    """

    UPRIGHT: ClassVar[int] = 2
    AMPLE: ClassVar[float] = 5e-3

    def __init__(
        self, product: Product, where: Meetings, as_drawn: bool = False, watch: Watch = NONE
    ) -> None:
        """`as_drawn`: of parts that are tested as they are drawn, only that: their bodies are not
        compared but by their boxes. `watch` is called before each of these pairs."""
        self.product, self.meetings, self.as_drawn, self._watch = product, where, as_drawn, watch

    @classmethod
    def of(cls, product: Product, nodes: Mapping[str, Node]) -> Finder:
        """That of the operations of a product, in postorder (`meetings`)."""
        return cls(product, meetings(nodes))

    @classmethod
    def at_once(cls, product: Product, watch: Watch = NONE) -> Finder:
        """That of the parts of a product, as they are drawn, as if all of them met at once."""
        return cls(product, Meetings.at_once(tuple(product.solids)), True, watch)

    @cached_property
    def bodies(self) -> ConvexBodies:
        """The convex bodies of the parts."""
        return bodies(self.product, self.meetings.parts)

    @cached_property
    def drawn(self) -> DrawnWays:
        """The ways of parts that are tested as they are drawn."""
        return DrawnWays(self.bodies, self._watch)

    @cached_property
    def _shapes(self) -> BodyShapes:
        return self.product.kept(BodyShapes)

    def lowering(self, wanted: NDArray[np.bool_]) -> Overlaps:
        """The overlaps of the wanted meetings when an input is lowered."""
        return self.along(self.UPRIGHT, wanted)

    def along(self, axis: int, wanted: NDArray[np.bool_]) -> Overlaps:
        """The overlaps of the wanted meetings when their inputs come along an axis: x, y or z."""
        if self.bodies.boxes.all() and not self._meshes:  # found at once
            return self._by_parts(*self._search(axis, wanted))
        name = digest(self._product, axis, wanted)
        kept = load_arrays(FOLDER, name)
        if kept is None:
            bodies, parts, rough = self._search(axis, wanted)
            arrays = [a for rows in (bodies, parts) for a in (*rows[:3], *rows[3].columns)]
            kept = dict(zip((*KEYS, *DRAWN, ROUGH), (*arrays, rough), strict=True))
            store_arrays(FOLDER, name, kept)
        return self._by_parts(_pairs(kept, KEYS), _pairs(kept, DRAWN), kept[ROUGH])

    @cached_property
    def _meshes(self) -> list[Array | Indices]:
        """The surfaces of parts, and where they are."""
        meshed = [(s, s.mesh) for s in self.bodies.solids if s.mesh is not None]
        each = {id(mesh): mesh for _, mesh in meshed}.values()
        places = [array for solid, _ in meshed for array in (solid.position, solid.quaternion)]
        return [*places, *(array for mesh in each for array in (mesh.vertices, mesh.faces))]

    @cached_property
    def _product(self) -> str:
        """A digest of all that overlaps depend on."""
        where = self.meetings.borders, self.meetings.levels, self.meetings.splits
        folders = Path(__file__).parent, *MODULES
        code = program(folders, "numpy", "scipy", "shapely", "manifold3d")
        asked = code, self.as_drawn, self.bodies.part
        return digest(*asked, *where, *self.bodies.vertices, *self._meshes)

    def _search(self, axis: int, wanted: NDArray[np.bool_]) -> tuple[Pairs, Pairs, Flags]:
        """The bodies, moving and standing, that overlap or graze, and the meetings at which they
        do; the parts that were tested as they are drawn; and which are known by hulls alone."""
        parts = [self._near(axis, wanted, *pairs) for pairs in self._chunks(axis)]
        rows = np.concatenate([np.zeros((3, 0), np.int64), *parts], axis=1)
        rows = rows[:, self._meets(rows, axis)]
        moving, standing, meeting = rows
        depths = box_depths(self.bodies, moving, standing, axis)
        self._refine(moving, standing, axis, depths)
        part = self.bodies.part
        idle = part[moving] < self.meetings.splits[meeting]
        depths.path[idle], depths.shift[idle] = depths.finished[idle, None], 0.0
        depths.graze[idle] = -np.inf
        kept = np.array(depths.faulty.any(axis=1))
        first = self._firsts(rows)
        kept[first] = True
        by_parts = part[moving[first]], part[standing[first]]
        exact = self.drawn.depths(*by_parts, idle[first], axis)
        by_bodies = meeting[kept], moving[kept], standing[kept], depths.at(np.flatnonzero(kept))
        return by_bodies, (meeting[first], *by_parts, exact), self.drawn.rough

    def _firsts(self, rows: Indices) -> Indices:
        """Of rows moving, standing, meeting (3, n) the first of each pair of parts that is tested
        as it is drawn."""
        moving, standing = self.bodies.part[rows[:2]]
        tested = np.flatnonzero(self.drawn.tested(moving, standing))
        key = self._key_of(rows[2, tested], moving[tested], standing[tested])
        return np.asarray(tested[np.unique(key, return_index=True)[1]])

    def _meets(self, rows: Indices, axis: int) -> Flags:
        """Which rows (n,) may overlap or graze, by how far their bodies reach along WAYS; the
        first of each pair of parts that is tested as it is drawn stays."""
        meets = np.ones(rows.shape[1], bool)
        if self.as_drawn or self.bodies.boxes.all():
            return meets
        other = np.flatnonzero(~self.bodies.boxes[rows[:2]].all(axis=0))
        moving, standing = rows[:2, other]
        heights = self._reach[moving] + self._reach[standing, ::-1]
        meets[other] = depths_of(heights + ROUNDING, WAYS[:, axis])[0].faulty.any(axis=1)
        meets[self._firsts(rows)] = True
        return meets

    @cached_property
    def _reach(self) -> Array:
        """How far each body (n, k) reaches along WAYS, each of which has its opposite in the
        reverse order [m]."""
        counts = [len(vertices) for vertices in self.bodies.vertices]
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        points = np.concatenate(self.bodies.vertices) @ WAYS.T
        return np.asarray(np.maximum.reduceat(points, starts))

    def _key_of(self, meeting: Indices, moving: Indices, standing: Indices) -> Indices:
        """A number (n,) of each pair of parts at a meeting, ascending as they are sorted."""
        count = len(self.bodies.solids)
        return (meeting * count + standing) * count + moving

    def _chunks(self, axis: int, apart: float = CLEAR) -> Iterator[tuple[Indices, Indices]]:
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

    def near(self, gap: float) -> tuple[Indices, Indices]:
        """Pairs of parts that are at most so far [m] from each other in the finished product, the
        later one first. Bodies that meet with corners may be a little further apart."""
        one, other, depths = self.passing(self.UPRIGHT, gap, still=True)
        close = depths.finished >= -gap
        bodies = self.bodies.part[np.stack([one, other])[:, close]]
        one, other = np.unique(bodies, axis=1)
        tested = np.flatnonzero(self.drawn.tested(one, other))
        near = np.ones(len(one), bool)
        near[tested] = self.drawn.near(one[tested], other[tested], gap)
        return one[near], other[near]

    def passing(
        self, axis: int, gap: float, still: bool = False
    ) -> tuple[Indices, Indices, Depths]:
        """Pairs of bodies (moving, standing) of two parts, the later one moving, whose boxes are at
        most so far [m] from each other in some place of the way along an axis, `still` in the
        finished product, with their depths."""
        pairs = [self._beside(axis, gap, still, *pair) for pair in self._chunks(axis, gap)]
        one, other = np.concatenate([np.zeros((2, 0), np.int64), *pairs], axis=1)
        depths = box_depths(self.bodies, one, other, axis)
        self._refine(one, other, axis, depths)
        return one, other, depths

    def rooms(self, axis: int, most: float = AMPLE) -> tuple[Indices, Indices, Array]:
        """Pairs of parts (moving, standing), the later one moving, that come near on the way along
        an axis, and the least room (n, 2) [m] on it from either side, but for the last bit; less
        than 0 where they overlap, infinite where there is `most` of it."""
        one, other, depths = self.passing(axis, most)
        moving, standing = self.bodies.part[one], self.bodies.part[other]
        apart = moving != standing
        moving, standing, least = moving[apart], standing[apart], depths.room[apart]
        key = moving * len(self.bodies.solids) + standing
        _, first, pair = np.unique(key, return_index=True, return_inverse=True)
        room = np.full((len(first), 2), np.inf)
        np.minimum.at(room, pair, least)
        moving, standing = moving[first], standing[first]
        tested = np.flatnonzero(self.drawn.tested(moving, standing) & (room < most).any(axis=1))
        room[tested] = self.drawn.room(moving[tested], standing[tested], axis, most)
        room[room >= most] = np.inf
        return moving, standing, room

    def _beside(
        self, axis: int, gap: float, still: bool, moving: Indices, standing: Indices
    ) -> Indices:
        depths = box_depths(self.bodies, moving, standing, axis)
        near = depths.finished if still else depths.path.max(axis=1)
        return np.asarray(np.stack([moving, standing])[:, near >= -gap])

    def _near(
        self, axis: int, wanted: NDArray[np.bool_], moving: Indices, standing: Indices
    ) -> Indices:
        """Those that meet at a wanted meeting and whose boxes come to overlap there: rows moving,
        standing, meeting (3, n)."""
        meeting = self.meetings.of(self.bodies.part[standing], self.bodies.part[moving])
        pairs = np.stack([moving, standing, meeting])[:, wanted[meeting]]
        depths = box_depths(self.bodies, pairs[0], pairs[1], axis)
        return np.asarray(pairs[:, depths.faulty.any(axis=1)])

    def _refine(self, moving: Indices, standing: Indices, axis: int, depths: Depths) -> None:
        """Replaces the depths of boxes by those of the bodies where these are no boxes."""
        groups: dict[tuple[bytes, bytes], list[int]] = {}
        keys = [key for solid in self.bodies.solids for key in self._shapes.keys[solid.label]]
        settled = self.bodies.boxes[moving] & self.bodies.boxes[standing]
        if self.as_drawn:
            settled |= self.drawn.tested(self.bodies.part[moving], self.bodies.part[standing])
        for row in np.flatnonzero(~settled).tolist():
            groups.setdefault((keys[moving[row]], keys[standing[row]]), []).append(row)
        low = self.bodies.low
        for pair, members in groups.items():
            rows = np.array(members)
            apart = low[moving[rows]] - low[standing[rows]]
            one, other = (self._shapes.vertices[key] for key in pair)
            if len(one) * len(other) > MANY:
                depths.put(rows, sought(one, other, apart, axis))
            else:
                difference = self._shapes.difference(pair)
                heights, slopes = difference.heights(apart), difference.normals[:, axis]
                depths.put(rows, depths_of(heights, slopes)[0])

    def _by_parts(self, by_bodies: Pairs, exact: Pairs, rough: Flags) -> Overlaps:
        """Of all bodies of two parts the deepest, and how deep they are as drawn."""
        meeting, moving, standing, depths = by_bodies
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
            none = np.zeros(0, bool)
            return Overlaps(meeting, one, other, depths, depths, none, bodies, ends)
        path = np.maximum.reduceat(depths.path, starts)
        at = np.where(depths.path >= path[np.cumsum(new) - 1], depths.shift, np.inf)
        colliding = Depths(
            np.maximum(np.maximum.reduceat(depths.finished, starts), 0.0),
            path,
            np.minimum.reduceat(at, starts),
            np.maximum.reduceat(depths.graze, starts),
            np.logical_or.reduceat(depths.cuts, starts),
        )
        meeting, one, other = meeting[starts], one[starts], other[starts]
        as_drawn = colliding.at(np.arange(len(starts)))
        rows = np.searchsorted(self._key_of(meeting, other, one), self._key_of(*exact[:3]))
        as_drawn.put(rows, exact[3])
        hulls = rough[one] | rough[other]
        return Overlaps(meeting, one, other, as_drawn, colliding, hulls, bodies, ends)


def _pairs(kept: Mapping[str, NDArray[Any]], keys: Sequence[str]) -> Pairs:
    meeting, moving, standing, *rest = (kept[key] for key in keys)
    return meeting, moving, standing, Depths(*rest)
