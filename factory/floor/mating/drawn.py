"""How deep parts get into each other on their ways as they are drawn, where the convex bodies that
collide for one of them are more than it is.

By booleans of surfaces (`geometry/overlap.py`), not in steps: what a part sweeps on its whole way
out has something in common with what stands, or nothing, so no wall is too thin to be met. The
depth of a way is the least by which one of the two, eroded, would let the other pass; that of the
finished product is measured alike. Depths are sampled, volumes are exact: a way that sweeps more of
a part than the two share in the finished product *cuts*, whatever its depth.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.meshes import Mesh, hull_of, is_closed, volume_of
from factory.floor.geometry.overlap import SAMPLES, Common, common, drawn, swept, united
from factory.floor.mating.bodies import ConvexBodies
from factory.floor.mating.paths import CLEAR, LAST, SIGNS, TOLERANCE, Depths
from factory.support.arrays import Array, Indices

ALIKE = 1e-6
"""Convex bodies are all of a mesh if their volumes differ by no more than this share."""

QUICK, SURELY = 8, 10 * TOLERANCE
"""With so few samples a clash that is deeper than this [m] is told from a touch."""


class _Measurements:
    """Measurements of some parts of a product, by label: the sweep of each, and the penetration
    depth of two; and whether meshes, by identity, are rough or wider."""

    def __init__(self, *_: object) -> None:
        self.sweeps: dict[tuple[str, int, int], Any] = {}
        self.finished: dict[tuple[str, str], Common] = {}
        self.pairs: dict[tuple[str, str, bool, int], tuple[Any, ...]] = {}
        self.kinds: dict[int, tuple[bool, bool]] = {}


class DrawnWays:
    """The parts of a product by number, and how deep they get into each other as drawn. What
    is found of them is kept with the product."""

    def __init__(self, bodies: ConvexBodies) -> None:
        self._solids = bodies.solids
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
                depth = self._path(one, other, axis, sign)[0]
                gap = self._gap(one, other, axis, sign, most) if depth <= TOLERANCE else -depth
                rooms[row, column] = gap
        return rooms

    def near(self, one: Indices, other: Indices, gap: float) -> NDArray[np.bool_]:
        """Which pairs of parts (n,) are at most so far from each other in the finished product."""
        pairs = zip(one.tolist(), other.tolist(), strict=True)
        return np.array(
            [self._body(a).min_gap(self._body(b), 2 * gap) <= gap for a, b in pairs], bool
        )

    def _kept(self, moving: int, standing: int, still: bool, axis: int) -> tuple[Any, ...]:
        key = self._labels[moving], self._labels[standing], still, axis
        if key not in self._found.pairs:
            self._found.pairs[key] = self._pair(moving, standing, still, axis)
        return self._found.pairs[key]

    def _pair(self, moving: int, standing: int, still: bool, axis: int) -> tuple[Any, ...]:
        finished = self.finished(moving, standing).depth
        if still:
            return finished, [finished] * 2, [0.0] * 2, [-np.inf] * 2, [False] * 2
        path, shift, graze, cuts = [], [], [], []
        for sign in SIGNS:
            depth, at = self._path(moving, standing, axis, sign)
            free = depth <= TOLERANCE
            path.append(max(depth, finished))
            shift.append(at)
            graze.append(-self._gap(moving, standing, axis, sign, CLEAR) if free else depth)
            is_deeper = depth > finished + TOLERANCE
            cuts.append(not is_deeper and self._cuts(moving, standing, axis, sign))
        return finished, path, shift, graze, cuts

    def finished(self, one: int, other: int) -> Common:
        """The overlap of two parts in the finished product."""
        key, overlaps = (self._labels[one], self._labels[other]), self._found.finished
        if key not in overlaps:
            overlaps[key] = common(self._body(one), self._body(other))
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

    def _path(self, moving: int, standing: int, axis: int, sign: int) -> tuple[float, float]:
        """How deep the first part gets into the second on its way, and where [m]. The depth of a
        clash that is deep may be found too small."""
        cut = self._cut(moving, standing, axis, sign, QUICK)
        if cut is None:
            return 0.0, 0.0
        finished = self.finished(moving, standing).depth
        if cut.depth <= SURELY or finished > TOLERANCE:
            both = [
                self._cut(moving, standing, axis, sign, SAMPLES),
                self._cut(standing, moving, axis, -sign, SAMPLES),
            ]
            depth = min(cut.depth if cut else 0.0 for cut in both)
        else:
            depth = cut.depth
        return depth, self._shift(cut, moving, axis, sign)

    def _cut(self, moving: int, standing: int, axis: int, sign: int, samples: int) -> Common | None:
        """The volume that a part on its way cuts out of another; None if it is empty."""
        swept, body = self._swept(moving, axis, sign), self._body(standing)
        cut = common(swept, body, both=False, samples=samples)
        return cut if cut.volume else None

    def _shift(self, cut: Common, moving: int, axis: int, sign: int) -> float:
        """How far the moving part has come where it meets the deepest point of a clash [m]."""
        back = cut.deepest - sign * self._beyond * np.eye(3)[axis]
        hits = self._body(moving).ray_cast(cut.deepest, back)
        ends = [float(np.linalg.norm(hit.position - cut.deepest)) for hit in hits[:2]]
        return float(np.mean(ends if len(hits) % 2 == 0 and ends else [0.0, *ends[:1]]))

    def _gap(self, moving: int, standing: int, axis: int, sign: int, most: float) -> float:
        """The least room on the way of a part, but for the last bit of it [m], up to `most`."""
        ahead = self._swept(moving, axis, sign).translate(sign * LAST * np.eye(3)[axis])
        return float(ahead.min_gap(self._body(standing), most))

    def _body(self, part: int) -> Any:
        return drawn(self._solids[part])

    def _swept(self, part: int, axis: int, sign: int) -> Any:
        key, sweeps = (self._labels[part], axis, sign), self._found.sweeps
        if key not in sweeps:
            out = sign * self._beyond * np.eye(3)[axis]
            sweeps[key] = swept(self._body(part), out)
        return sweeps[key]


def is_exact(mesh: Mesh) -> bool:
    """Whether the convex bodies of a mesh are the volume that it bounds, no more."""
    if not is_closed(mesh.faces):
        return False
    volume = volume_of(mesh.vertices, mesh.faces)
    bodies = [hull_of(piece) for piece in mesh.pieces] or [mesh.hull]
    return abs(sum(body.volume for body in bodies) - volume) <= ALIKE * volume
