"""The surfaces of sub-assemblies, seen from below, above and behind.

Everything is derived from the convex bodies of the parts. Lines meet bodies exactly; obstacles of
hands are boxed, which is exact for boxes and conservative for others.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from itertools import product as pairs
from typing import TYPE_CHECKING

import numpy as np

from factory.floor.geometry.pieces import BOX_FACES, is_box
from factory.floor.geometry.solids import Product, Solid
from factory.floor.layout.hands.envelopes import FLAT, Envelope, Faces
from factory.floor.mating.depth import polytope_of, solid_hull
from factory.support.arrays import Array, Truth

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

Way = tuple[float, float]
"""A direction of the world in the plane."""

TOUCH = 1e-5
"""Boxes that overlap by no more only touch [m]."""

BLOCK = 16
"""So many boxes are compared with points at a time."""

FEW = 4
"""Of more boxes than this those that are near are looked for first."""


@dataclass(frozen=True, eq=False)
class Body:
    """A convex body: its box `low`, `high` (3,) and its `vertices` (n, 3) [m]; those of a `ball`
    are of a polytope round it, and not looked at."""

    low: Array
    high: Array
    vertices: Array = field(repr=False)
    ball: bool = False

    @classmethod
    def of(cls, solid: Solid) -> Iterator[Body]:
        """The bodies of a solid."""
        ball = solid.kind == "sphere"
        for piece in solid.pieces:
            low, high = (solid.low, solid.high) if ball else (piece.min(axis=0), piece.max(axis=0))
            yield cls(low, high, piece, ball)

    @cached_property
    def _hull(self) -> ConvexHull | None:
        """Its hull; None where it is too thin for one."""
        return solid_hull(self.vertices)

    @cached_property
    def faces(self) -> tuple[Array, Array]:
        """The outward normals (f, 3) of its faces and how far they reach along them (f,) [m]."""
        hull = polytope_of(self.vertices, self._hull)
        return hull.normals, hull.reach

    @cached_property
    def facing(self) -> tuple[tuple[Faces, Faces, Faces], ...]:
        """For each axis those of its faces that are parallel to it, face against it, and face along
        it."""
        normals, offsets = self.faces
        by_axis = []
        for axis, along in enumerate(normals.T):
            across = normals[:, [a for a in range(3) if a != axis]]
            sides = np.abs(along) < FLAT, along < -FLAT, along > FLAT
            size = np.where(sides[0], 1.0, np.abs(along))
            one, two, three = (Faces(size[s], across[s].T, offsets[s]) for s in sides)
            by_axis.append((one, two, three))
        return tuple(by_axis)

    @cached_property
    def _envelopes(self) -> tuple[tuple[Envelope, Envelope, Envelope], ...]:
        """Those of the faces over its box, a little widened."""
        by_axis = []
        for axis, faces in enumerate(self.facing):
            across = [a for a in range(3) if a != axis]
            low, high = self.low[across] - FLAT, self.high[across] + FLAT
            one, two, three = (Envelope(some, low, high) for some in faces)
            by_axis.append((one, two, three))
        return tuple(by_axis)

    @cached_property
    def edges(self) -> Array:
        """The ends (e, 2, 3) of its edges, and of lines across faces [m]; of what is too thin for
        faces those of its box."""
        corners, faces = self.vertices, BOX_FACES
        if not is_box(corners):
            if self._hull is None:
                corners = np.array([[*p] for p in pairs(*zip(self.low, self.high, strict=True))])
                return np.asarray(corners[list(combinations(range(8), 2))])
            faces = self._hull.simplices
        sorted_ends = np.sort(
            np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [0, 2]]])
        )
        return np.asarray(corners[np.unique(sorted_ends, axis=0)])

    @cached_property
    def edge_boxes(self) -> tuple[Array, Array]:
        """The least and the greatest coordinates (3, e) of its edges [m]."""
        return self.edges.min(axis=1).T.copy(), self.edges.max(axis=1).T.copy()

    @cached_property
    def boxed(self) -> bool:
        """Whether it is a box along the axes."""
        corners = (self.vertices == self.low) | (self.vertices == self.high)
        return len(np.unique(self.vertices, axis=0)) == 8 and bool(corners.all())

    def out(self, side: tuple[int, int]) -> float:
        """Extent on a side, an axis and a way (+1, -1) along it [m]."""
        axis, way = side
        return way * float((self.high if way > 0 else self.low)[axis])

    def dome(self, points: Array, axis: int, near: Array | float = 0.0) -> Array:
        """How far out of its middle a ball is along an axis, at the points (n,) of discs across
        that about some (n, 3) that are nearest to it, of radii `near` (n,) [m]; -1 for nowhere."""
        across = [a for a in range(3) if a != axis]
        middle, radius = (self.low + self.high) / 2, float((self.high - self.low)[axis]) / 2
        away = np.maximum(np.hypot(*(points - middle)[:, across].T) - near, 0.0)
        return np.where(away > radius, -1.0, np.sqrt(np.maximum(radius**2 - away**2, 0.0)))

    def crossed(self, points: Array, axis: int) -> tuple[Array, Array]:
        """The intervals in which lines along an axis through points (n, 3) are inside (n,); (inf,
        -inf) for lines that miss it."""
        if self.ball:
            half = self.dome(points, axis)
            middle = (self.low + self.high)[axis] / 2
            return np.where(half < 0, np.inf, middle - half), np.where(
                half < 0, -np.inf, middle + half
            )
        across = [a for a in range(3) if a != axis]
        at, low, high = points[:, across], self.low[across] - FLAT, self.high[across] + FLAT
        over = np.all((at >= low) & (at <= high), axis=1)
        if not over.all():
            enter, leave = np.full(len(at), np.inf), np.full(len(at), -np.inf)
            enter[over], leave[over] = self.crossed(points[over], axis)
            return enter, leave
        beside, back, out = self._envelopes[axis]
        first, last = -back.least(at), out.least(at)
        inside = (beside.least(at) >= -FLAT) & (first <= last)
        return np.where(inside, first, np.inf), np.where(inside, last, -np.inf)


class Surfaces:
    """The bodies of a product's parts, and what lines through them meet."""

    def __init__(self, product: Product) -> None:
        self.bodies = {label: tuple(Body.of(solid)) for label, solid in product.solids.items()}
        self._boxes = {
            label: np.array([(body.low, body.high) for body in bodies]).reshape(-1, 2, 3)
            for label, bodies in self.bodies.items()
        }

    def boxes(self, parts: Iterable[str]) -> Array:
        """The boxes (n, 2, 3) of the bodies of some parts."""
        return np.concatenate([self._boxes[part] for part in parts])

    def outermost(self, parts: Sequence[str], points: Array, side: tuple[int, int]) -> Array:
        """Extent of some parts on a side, an axis and a way (+1, -1) along it, where lines along
        the axis through points (n, 3) meet them (n,) [m]; -inf for lines that miss them."""
        (axis, way), reach = side, np.full(len(points), -np.inf)
        one, other = (a for a in range(3) if a != axis)
        x, y = points[:, one].copy(), points[:, other].copy()
        every = [body for part in parts for body in self.bodies[part]]
        boxes = np.array([(b.low, b.high) for b in every if b.boxed]).reshape(-1, 2, 3)
        ends = way * boxes[:, 1 if way > 0 else 0, axis]
        order, left = np.argsort(-ends), np.arange(len(points))
        for begin in range(0, len(order), BLOCK):  # outermost first: a line that meets one is done
            some = order[begin : begin + BLOCK, None]
            (low, high), u, v = np.moveaxis(boxes[some], 2, 0), x[left], y[left]
            over = (u >= low[..., one]) & (u <= high[..., one])
            over &= (v >= low[..., other]) & (v <= high[..., other])
            met = over.any(axis=0)
            reach[left[met]] = ends[some[over[:, met].argmax(axis=0), 0]]
            left = left[~met]
            if not len(left):
                break
        bodies = [(body.out(side), body) for body in every if not body.boxed]
        for out, body in sorted(bodies, key=lambda pair: -pair[0]):
            low, high = body.low, body.high
            beside = (x >= low[one]) & (x <= high[one]) & (y >= low[other]) & (y <= high[other])
            # what ends further in than what is known is not looked at
            near = np.flatnonzero(beside & (reach < out + FLAT))
            enter, leave = body.crossed(points[near], axis)
            reach[near] = np.maximum(reach[near], leave if way > 0 else -enter)
        return reach


def swept(low: Array, high: Array, *ways: Way) -> tuple[Array, Array]:
    """Boxes from `low` to `high` (n, 3) [m] extended by their sweep any distance along each of some
    world directions in the plane, and along them together."""
    low, high = low.copy(), high.copy()
    for x, y in ways:
        for axis, way in ((0, x), (1, y)):
            if way < -0.5:
                low[:, axis] = -np.inf
            elif way > 0.5:
                high[:, axis] = np.inf
    return low, high


def hit(low: Array, high: Array, boxes: Array, spare: float = TOUCH) -> Truth:
    """Which boxes (n,) from `low` to `high` (n, 3) overlap any of `boxes` (m, 2, 3), by more than
    `spare` [m]."""
    if len(boxes) > FEW:
        boxes = boxes[near(low, high, boxes)]
    return np.asarray(_overlap(low, high, boxes, spare).any(axis=1))


def retreat(low: Array, high: Array, boxes: Array, ways: tuple[Way, Way]) -> Array:
    """Distance that boxes from `low` to `high` (n, 3) have to go along the first of two directions
    until each of `boxes` (m, 2, 3) is not in their way along the second (n, m) [m]; 0 if it is
    not."""
    wide, ((x, y), _) = swept(low, high, *ways), ways
    distances, kept = np.zeros((len(low), len(boxes))), near(*wide, boxes)
    axis, side = (0, x) if x else (1, y)
    if side < 0:
        past = high[:, None, axis] - boxes[kept, 0, axis]
    else:
        past = boxes[kept, 1, axis] - low[:, None, axis]
    distances[:, kept] = np.where(_overlap(*wide, boxes[kept], TOUCH), np.maximum(past, 0.0), 0.0)
    return distances


def near(low: Array, high: Array, boxes: Array) -> Truth:
    """Which of `boxes` (m,) meet the box round boxes from `low` to `high` (n, 3)."""
    if not len(low):
        return np.zeros(len(boxes), bool)
    kept = (boxes[:, 1] > low.min(axis=0)) & (boxes[:, 0] < high.max(axis=0))
    return np.asarray(kept.all(axis=1))


def _overlap(low: Array, high: Array, boxes: Array, spare: float) -> Truth:
    """Which boxes from `low` to `high` (n, 3) overlap which of `boxes` (m, 2, 3) by more than
    `spare` [m] (n, m)."""
    begin, end = boxes[:, 0].T + spare, boxes[:, 1].T - spare
    overlapping = low[:, :1] < end[0]
    overlapping &= high[:, :1] > begin[0]
    for axis in (1, 2):
        overlapping &= low[:, axis, None] < end[axis]
        overlapping &= high[:, axis, None] > begin[axis]
    return np.asarray(overlapping)
