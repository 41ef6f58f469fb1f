"""How deep parts get into each other on their ways as they are drawn, where the convex bodies that
collide for one of them are more than it is.

By booleans of surfaces (`geometry/overlap.py`), not in steps: what a part sweeps on its whole way
out has something in common with what stands, or nothing, so no wall is too thin to be met. The
depth of a way is the least by which one of the two, eroded, would let the other pass; that of the
finished product is measured alike. Depths are sampled, volumes are exact: a way that sweeps more of
a part than the two share in the finished product *cuts*, whatever its depth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.decimation import ENOUGH, Coarse, decimated
from factory.floor.geometry.meshes import Mesh, hull_of
from factory.floor.geometry.overlap import (
    Common,
    bounded,
    common,
    drawn,
    is_seen_near,
    may_share,
    overlap_of,
    swept,
    united,
)
from factory.floor.geometry.solids import Product
from factory.floor.mating.bodies import ConvexBodies
from factory.floor.mating.depth import solid_hull
from factory.floor.mating.paths import CLEAR, LAST, SIGNS, TOLERANCE, Depths
from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import is_closed, volume_of
from factory.support.rotations import rotation

ALIKE = 1e-6
"""Convex bodies are all of a mesh if their volumes differ by no more than this share."""

SOME = 500
"""The hull of so many vertices of a mesh may show that it is not convex."""

QUICK, SURELY = 8, 10 * TOLERANCE
"""With so few samples a clash that is deeper than this [m] is told from a touch."""

DECIMATED = 1e-4
"""How far a decimated part may be from the part [m], where a coarse look may suffice."""


Watch = Callable[[], None]
"""What is called before each pair, and may raise."""

NONE: Watch = lambda: None  # noqa: E731
"""Nothing is called."""


class _Measurements:
    """Measurements of some parts of a product, by label: the sweep of each, the penetration depth
    of two, and decimated bodies; and whether meshes, by identity, are rough or wider."""

    def __init__(self, product: Product, parts: frozenset[str]) -> None:
        self.sweeps: dict[tuple[str, int, int], Any] = {}
        self.finished: dict[tuple[str, str], Common] = {}
        self.pairs: dict[tuple[str, str, bool, int], tuple[Any, ...]] = {}
        self.decimated: dict[int, Coarse] = {}
        self.coarse: dict[str, Coarse] = {}
        self.free: set[tuple[str, str, int, int]] = set()
        self.rough_sweeps: dict[tuple[str, int, int], Any] = {}
        self.kinds: dict[int, tuple[bool, bool]] = {}
        if product.twin is not None and parts == frozenset(product.twin[0].solids):
            self._take(product.twin[0].kept(_Measurements, parts), product.twin[1])

    def _take(self, other: _Measurements, turn: Array) -> None:
        """Take what was measured of the parts before a turn (3, 3) that brings axes onto axes."""
        place = np.column_stack([turn, np.zeros(3)])
        for label, coarse in other.coarse.items():
            self.coarse[label] = replace(coarse, body=coarse.body.transform(place))
        if np.array_equal(turn, np.eye(3)):
            self.pairs, self.sweeps, self.finished = other.pairs, other.sweeps, other.finished
            self.free = other.free
            return
        onto = np.abs(turn).argmax(axis=0).tolist()
        order = [slice(None, None, 1 if turn[onto[axis], axis] > 0 else -1) for axis in range(3)]
        for (one, standing, still, axis), row in other.pairs.items():
            self.pairs[one, standing, still, onto[axis]] = _ordered(row, order[axis])
        for one, standing, axis, sign in other.free:
            self.free.add((one, standing, onto[axis], sign * order[axis].step))
        for (one, standing), shared in other.finished.items():
            box = np.sort(shared.box @ turn.T, axis=0)
            turned = replace(shared, deepest=shared.deepest @ turn.T, box=box)
            self.finished[one, standing] = turned
            self.finished.setdefault((standing, one), turned)


def _ordered(row: tuple[Any, ...], order: slice) -> tuple[Any, ...]:
    """What is known of a way, with the sides from which a part comes in this order."""
    return (row[0], *(sides[order] for sides in row[1:]))


class DrawnWays:
    """The parts of a product by number, and how deep they get into each other as drawn. What
    is found of them is kept with the product. `watch` is called before each pair."""

    def __init__(self, bodies: ConvexBodies, watch: Watch = NONE) -> None:
        self._solids, self._watch = bodies.solids, watch
        self._labels = [solid.label for solid in bodies.solids]
        self._found = bodies.product.kept(_Measurements, frozenset(self._labels))

    @cached_property
    def rough(self) -> NDArray[np.bool_]:
        """Whether each part (n,) is known by its hull alone, since its mesh bounds no volume."""
        return np.asarray(self._meshes[0])

    @cached_property
    def wider(self) -> NDArray[np.bool_]:
        """Whether each part (n,) is smaller than the convex bodies that collide for it."""
        return np.asarray(self._meshes[1])

    @cached_property
    def _meshes(self) -> NDArray[np.bool_]:
        flags = np.zeros((2, len(self._solids)), bool)
        kinds = self._found.kinds
        for part, solid in enumerate(self._solids):
            if solid.mesh is not None:
                key = id(solid.mesh)
                if key not in kinds:
                    exact = is_exact(solid.mesh)
                    is_rough = not exact and self._body(part) is None
                    kinds[key] = is_rough, not exact and not is_rough
                flags[:, part] = kinds[key]
        return flags

    @cached_property
    def _beyond(self) -> float:
        """Length of a path that leads out of the product [m]."""
        low = np.min([solid.low for solid in self._solids], axis=0)
        high = np.max([solid.high for solid in self._solids], axis=0)
        return 1.01 * float((high - low).max()) + 1e-3

    def tested(self, one: Indices, other: Indices) -> NDArray[np.bool_]:
        """Which pairs of parts (n,) are tested as drawn: at least one is less than its bodies, and
        both bound a volume."""
        either = self.wider[one] | self.wider[other]
        return np.asarray(either & ~self.rough[one] & ~self.rough[other])

    def depths(
        self, moving: Indices, standing: Indices, still: NDArray[np.bool_], axis: int
    ) -> Depths:
        """The depths of pairs of parts on the ways of the first along an axis; of pairs that stand
        `still` those in the finished product alone."""
        pairs = zip(moving.tolist(), standing.tolist(), still.tolist(), strict=True)
        rows = [self._kept(*pair, axis) for pair in pairs]
        finished, *columns = (np.array([row[n] for row in rows], float) for n in range(5))
        path, shift, graze, cuts = (column.reshape(-1, 2) for column in columns)
        return Depths(finished, path, shift, graze, cuts > 0)

    def room(self, moving: Indices, standing: Indices, axis: int, most: float) -> Array:
        """The least room (n, 2) [m] on the ways of pairs of parts from either side, but for the
        last bit, up to `most`; less than 0 where the two overlap on it."""
        rooms = np.empty((len(moving), 2))
        for row, (one, other) in enumerate(zip(moving.tolist(), standing.tolist(), strict=True)):
            for column, sign in enumerate(SIGNS):
                met = self._path(one, other, axis, sign)
                depth = met[0] if met else 0.0
                gap = self._gap(one, other, axis, sign, most) if depth <= TOLERANCE else -depth
                rooms[row, column] = gap
        return rooms

    def near(self, one: Indices, other: Indices, gap: float) -> NDArray[np.bool_]:
        """Which pairs of parts (n,) are at most so far from each other in the finished product."""
        pairs = zip(one.tolist(), other.tolist(), strict=True)
        return np.array([self._is_near(a, b, gap) for a, b in pairs], bool)

    def _is_near(self, one: int, other: int, gap: float) -> bool:
        self._watch()
        coarse, margin = [self._coarse(part) for part in (one, other)], self._margin(one, other)
        if margin and coarse[0].body.min_gap(coarse[1].body, gap + 2 * margin) > gap + margin:
            return False
        bodies = self._body(one), self._body(other)
        if not may_share(*bodies) and (
            is_seen_near(*bodies, gap) or is_seen_near(*bodies[::-1], gap)
        ):
            return True
        return bool(bodies[0].min_gap(bodies[1], 2 * gap) <= gap)

    def _kept(self, moving: int, standing: int, still: bool, axis: int) -> tuple[Any, ...]:
        one, other, pairs = self._labels[moving], self._labels[standing], self._found.pairs
        key, swapped = (one, other, still, axis), (other, one, still, axis)
        if key not in pairs and swapped in pairs:  # the other part moves, to the other side
            pairs[key] = _ordered(pairs[swapped], slice(None, None, -1))
        elif key not in pairs:
            pairs[key] = self._pair(moving, standing, still, axis)
        return pairs[key]

    def _pair(self, moving: int, standing: int, still: bool, axis: int) -> tuple[Any, ...]:
        finished = self.finished(moving, standing).depth
        if still:
            return finished, [finished] * 2, [0.0] * 2, [-np.inf] * 2, [False] * 2
        path, shift, graze, cuts = [], [], [], []
        for sign in SIGNS:
            self._watch()
            clear = self._is_free(moving, standing, axis, sign)
            coarse = (0.0, 0.0) if clear else self._coarsely(moving, standing, axis, sign)
            met = coarse or self._path(moving, standing, axis, sign)
            depth, at = met or (0.0, 0.0)
            free = depth <= TOLERANCE
            path.append(max(depth, finished))
            shift.append(at)
            wanted = free and not coarse
            gap = self._gap(moving, standing, axis, sign, CLEAR) if wanted else CLEAR
            graze.append(-gap if free else depth)
            is_deeper = depth > finished + TOLERANCE
            may_cut = met is not None and met is not coarse and not is_deeper
            cuts.append(may_cut and self._cuts(moving, standing, axis, sign))
            if depth == 0.0 and gap >= CLEAR and not cuts[-1]:
                pair = self._labels[moving], self._labels[standing]
                self._found.free |= {(*pair, axis, sign), (*pair[::-1], axis, -sign)}
        return finished, path, shift, graze, cuts

    def _is_free(self, moving: int, standing: int, axis: int, sign: int) -> bool:
        """Whether it is known that the first part passes the second with room."""
        return (self._labels[moving], self._labels[standing], axis, sign) in self._found.free

    def _coarsely(
        self, moving: int, standing: int, axis: int, sign: int
    ) -> tuple[float, float] | None:
        """How deep the first part gets into the second on its way, and where [m], if that is clear
        from decimated bodies, and how far these are from the parts: it passes with room,
        or the two clash deeply and are apart in the end. None if it is not."""
        margin = self._margin(moving, standing)
        if not margin or self.finished(moving, standing).depth > TOLERANCE:
            return None
        sweep, body = self._rough_sweep(moving, axis, sign), self._coarse(standing).body
        cut = common(sweep, body, both=False, samples=QUICK)
        if cut.depth > SURELY + margin:
            return cut.depth, self._shift(cut, moving, axis, sign)
        ahead = sweep.translate(sign * LAST * np.eye(3)[axis])
        passes = not cut.volume and ahead.min_gap(body, CLEAR + 2 * margin) > CLEAR + margin
        return (0.0, 0.0) if passes else None

    def _margin(self, one: int, other: int) -> float:
        """How much a distance of two decimated parts may be off [m]; 0 if neither is decimated. It
        is twice what is measured, which is measured at some points only."""
        return 2 * (self._coarse(one).far + self._coarse(other).far)

    def _coarse(self, part: int) -> Coarse:
        solid, coarse = self._solids[part], self._found.coarse
        if solid.label not in coarse:
            body, meshes = self._body(part), self._found.decimated
            if solid.mesh is None or body.num_tri() <= ENOUGH:
                return coarse.setdefault(solid.label, Coarse(body))
            key = id(solid.mesh)
            if key not in meshes:
                meshes[key] = decimated(bounded(solid.mesh.vertices, solid.mesh.faces), DECIMATED)
            place = np.column_stack([rotation(solid.quaternion), solid.position])
            coarse[solid.label] = Coarse(meshes[key].body.transform(place), meshes[key].far)
        return coarse[solid.label]

    def finished(self, one: int, other: int) -> Common:
        """The overlap of two parts in the finished product."""
        key, overlaps = (self._labels[one], self._labels[other]), self._found.finished
        if key not in overlaps:
            overlaps[key] = overlap_of(self._solids[one], self._solids[other])
        return overlaps[key]

    def _cuts(self, moving: int, standing: int, axis: int, sign: int) -> bool:
        """Whether the smaller of two parts sweeps more of the larger on the way than the two share
        in the finished product, and a layer as thick as the tolerance."""
        if self._body(moving).volume() > self._body(standing).volume():
            moving, standing, sign = standing, moving, -sign
        sweep, body = self._swept(moving, axis, sign), self._body(standing)
        cut, share = sweep ^ body, self.finished(moving, standing).volume
        most = share + TOLERANCE * cut.surface_area()
        # A sweep has places twice that it passes twice; its bodies united have them once.
        is_more = bool(cut.volume() > most)
        return is_more and united(part ^ body for part in sweep.decompose()) > most

    def _path(self, moving: int, standing: int, axis: int, sign: int) -> tuple[float, float] | None:
        """How deep the first part gets into the second on its way, and where [m]; None if they do
        not meet. The depth of a clash that is deep may be found too small."""
        ways = self._swept(moving, axis, sign), self._body(standing)
        if not may_share(*ways):
            return None
        shared = ways[0] ^ ways[1]
        cut = common(*ways, both=False, samples=QUICK, shared=shared)
        if not cut.volume:
            return None
        finished = self.finished(moving, standing).depth
        depth = cut.depth
        if depth <= SURELY or finished > TOLERANCE:
            back = self._swept(standing, axis, -sign), self._body(moving)
            depth = common(*ways, both=False, shared=shared).depth
            depth = min(depth, common(*back, both=False).depth)
        return depth, self._shift(cut, moving, axis, sign)

    def _shift(self, cut: Common, moving: int, axis: int, sign: int) -> float:
        """How far the moving part has come where it meets the deepest point of a clash [m]."""
        back = cut.deepest - sign * self._beyond * np.eye(3)[axis]
        hits = self._body(moving).ray_cast(cut.deepest, back)
        ends = [float(np.linalg.norm(hit.position - cut.deepest)) for hit in hits[:2]]
        return float(np.mean(ends if len(hits) % 2 == 0 and ends else [0.0, *ends[:1]]))

    def _gap(self, moving: int, standing: int, axis: int, sign: int, most: float) -> float:
        """The least room on the way of a part, but for the last bit of it [m], up to `most`."""
        ahead = self._swept(moving, axis, sign).translate(sign * LAST * np.eye(3)[axis])
        body = self._body(standing)
        if not may_share(ahead, body) and is_seen_near(ahead.bodies[0], body):
            return 0.0  # flush faces have many triangles that are as near
        return float(ahead.min_gap(body, most))

    def _body(self, part: int) -> Any:
        return drawn(self._solids[part])

    def _swept(self, part: int, axis: int, sign: int) -> Any:
        return self._sweep(self._found.sweeps, self._body(part), (self._labels[part], axis, sign))

    def _rough_sweep(self, part: int, axis: int, sign: int) -> Any:
        body, far = self._coarse(part).body, self._coarse(part).far
        if far == 0:
            return self._swept(part, axis, sign)
        return self._sweep(self._found.rough_sweeps, body, (self._labels[part], axis, sign))

    def _sweep(
        self, sweeps: dict[tuple[str, int, int], Any], body: Any, key: tuple[str, int, int]
    ) -> Any:
        if key not in sweeps:
            _, axis, sign = key
            sweeps[key] = swept(body, sign * self._beyond * np.eye(3)[axis])
        return sweeps[key]


def is_exact(mesh: Mesh) -> bool:
    """Whether the convex bodies of a mesh are the volume that it bounds, no more."""
    if not is_closed(mesh.faces):
        return False
    volume = volume_of(mesh.vertices, mesh.faces)
    some = solid_hull(mesh.vertices[:: -(-len(mesh.vertices) // SOME)])
    if not mesh.pieces and some is not None and some.volume > (1 + ALIKE) * volume:
        return False  # nor is the hull of all, which is larger
    bodies = [hull_of(piece) for piece in mesh.pieces] or [mesh.hull]
    return abs(sum(body.volume for body in bodies) - volume) <= ALIKE * volume
