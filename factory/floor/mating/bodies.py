"""The convex bodies of a product's parts as arrays, and which of them are boxes along the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.solids import Product, Solid
from factory.floor.mating.depth import Difference, Polytope, exact, polytope
from factory.support.arrays import Array

ROUNDING = 1e-9
"""Vertices are the same within this [m]."""


@dataclass(frozen=True, slots=True)
class ConvexBodies:
    """All convex bodies: `vertices` (n, 3) of each, `low`, `high` (bodies, 3) its bounding box,
    `part` the number of the part it belongs to, `boxes` whether it is its bounding box [m]; the
    `solids` of the parts, and the `product` that they are of."""

    vertices: tuple[Array, ...] = field(repr=False)
    part: NDArray[np.int64]
    low: Array
    high: Array
    boxes: NDArray[np.bool_]
    solids: tuple[Solid, ...] = field(repr=False)
    product: Product = field(repr=False)


class BodyShapes:
    """The shapes of a product's bodies: the `keys` of those of each part, the same for bodies of
    one shape that are turned the same way; of each its vertices (n, 3) from the low corner of its
    box [m]; and the Minkowski differences of two."""

    def __init__(self, product: Product) -> None:
        self.keys: dict[str, list[bytes]] = {}
        self.vertices: dict[bytes, Array] = {}
        self._polytopes: dict[bytes, Polytope] = {}
        self._differences: dict[tuple[bytes, bytes], Difference] = {}
        for label, solid in product.solids.items():
            for vertices in solid.pieces or (solid.corners,):
                placed = vertices - vertices.min(axis=0)
                key = np.round(placed / ROUNDING).astype(np.int64).tobytes()
                self.keys.setdefault(label, []).append(key)
                self.vertices.setdefault(key, placed)

    def difference(self, pair: tuple[bytes, bytes]) -> Difference:
        """That of two shapes, by their keys."""
        if pair not in self._differences:
            self._differences[pair] = exact(*map(self._polytope, pair))
        return self._differences[pair]

    def _polytope(self, key: bytes) -> Polytope:
        if key not in self._polytopes:
            self._polytopes[key] = polytope(self.vertices[key])
        return self._polytopes[key]


def bodies(product: Product, parts: Sequence[str]) -> ConvexBodies:
    """The bodies of the parts, in their order, as the engine collides them."""
    vertices_of: list[Array] = []
    part: list[int] = []
    for number, label in enumerate(parts):
        solid = product.solids[label]
        pieces = solid.pieces or (solid.corners,)
        vertices_of.extend(pieces)
        part.extend([number] * len(pieces))
    counts = np.array([len(vertices) for vertices in vertices_of], np.int64)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    points = np.concatenate(vertices_of)
    low, high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    boxes = _boxes(points, starts, counts, low, high)
    solids = tuple(product.solids[label] for label in parts)
    return ConvexBodies(
        tuple(vertices_of), np.array(part, np.int64), low, high, boxes, solids, product
    )


def _boxes(
    points: Array, starts: NDArray[np.int64], counts: NDArray[np.int64], low: Array, high: Array
) -> NDArray[np.bool_]:
    """Whether each body has eight vertices, one in each corner of its bounding box."""
    boxes = counts == 8
    chosen = np.flatnonzero(boxes)
    corners = points[starts[chosen][:, None] + np.arange(8)]
    at_low = np.abs(corners - low[chosen][:, None]) < ROUNDING
    at_high = np.abs(corners - high[chosen][:, None]) < ROUNDING
    which = np.sort(at_high @ np.array([1, 2, 4]), axis=1)
    boxes[chosen] = (at_low ^ at_high).all(axis=(1, 2)) & (which == np.arange(8)).all(axis=1)
    return np.asarray(boxes)
