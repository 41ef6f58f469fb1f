"""How deep a convex body that slides gets into one that stands.

Body P is shifted by λ along a direction e and overlaps Q. Its depth is how far it must at least be
pushed, anywhere, to be outside: D(λ) = min over the facets n of the Minkowski difference of
h(n) + λ n·e, where h(n) = max n·P - min n·Q. The facets do not depend on λ, so one set of normals
serves every place and every direction; D is concave, and its greatest value over λ >= 0 is the
depth of the path. Negative depths mean apart.

The normals are those of P, those of Q reversed, and the products of edges whose arcs on the sphere
of directions cross (the facets that edges of both make). More normals than there are facets do no
harm: each is a bound, and the facets' are among them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

SMALL = 1e-12

MANY = 1 << 16
"""The most pairs of normals and vertices that are looked at each."""

CORNERS = np.array([*product((0.0, 1.0), repeat=3)])
"""The corners (8, 3) of a unit box."""

BOX_NORMALS = np.concatenate([np.eye(3), -np.eye(3)])
"""The outward normals (6, 3) of a box."""

BOX_EDGES = np.array(
    [
        (along, one, other)
        for along, *beside in (np.eye(3), np.roll(np.eye(3), -1, 0), np.roll(np.eye(3), -2, 0))
        for one, other in product(*((normal, -normal) for normal in beside))
    ]
)
"""The edges (12, 3, 3) of a unit box, as those of a Polytope."""


@dataclass(frozen=True)
class Polytope:
    """A convex body by its vertices (n, 3) with the outward normals of its faces (f, 3)."""

    vertices: Array
    normals: Array = field(repr=False)
    edges: Array = field(repr=False)
    """(e, 3, 3): of each edge its direction and the normals of the faces on both sides."""

    @property
    def is_upright_box(self) -> bool:
        """Whether it was made by `upright_box`."""
        return self.normals is BOX_NORMALS

    @cached_property
    def reach(self) -> Array:
        """How far the body reaches along its own normals (f,) [m]."""
        return np.asarray(_support(self.normals, self.vertices))


def solid_hull(vertices: Array) -> ConvexHull | None:
    """The hull of vertices; None for flat ones, which have none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(vertices)
    except QhullError:
        return None


def polytope(vertices: Array) -> Polytope:
    """The hull of vertices; of flat ones, which have no hull, the axes' directions."""
    return polytope_of(vertices, solid_hull(vertices))


def polytope_of(vertices: Array, hull: ConvexHull | None) -> Polytope:
    """The same, where their hull is known."""
    if hull is None:
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        return Polytope(vertices, normals, np.zeros((0, 3, 3)))
    rounded = np.round(hull.equations[:, :3] * 1e7).astype(np.int64)
    ids: dict[tuple[int, ...], int] = {}
    number = np.array([ids.setdefault(tuple(face), len(ids)) for face in rounded.tolist()])
    normals = np.array(list(ids), float)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    face, corner = np.nonzero(number[:, None] < number[hull.neighbors])
    ends = np.array([[1, 2], [0, 2], [0, 1]])[corner]
    tips = vertices[hull.simplices[face[:, None], ends]]
    across = hull.neighbors[face, corner]
    edges = np.stack(
        [tips[:, 1] - tips[:, 0], normals[number[face]], normals[number[across]]], axis=1
    )
    return Polytope(vertices[hull.vertices], normals, edges)


def upright_box(low: Array, high: Array) -> Polytope:
    """The box along the axes with corners `low` and `high` (3,), without a search for its hull."""
    corners = np.where(CORNERS, high, low)
    return Polytope(corners, BOX_NORMALS, BOX_EDGES * [high - low, np.ones(3), np.ones(3)])


def _support(normals: Array, vertices: Array) -> Array:
    """How far vertices (n, 3) reach along normals (k, 3) (k,). Many normals are divided in halves.
    Of those about a direction only the vertices are looked at that may reach furthest along any: a
    vertex is behind another that is further along that direction than their distance times how far
    normals are from it."""
    if len(normals) * len(vertices) <= MANY or len(normals) == 1:
        return np.asarray(_heights(normals, vertices).max(axis=1))
    low, high = normals.min(axis=0), normals.max(axis=0)
    middle = (low + high) / 2
    height = vertices @ middle
    furthest = height.argmax()
    away = vertices - vertices[furthest]
    off = np.sqrt((normals - middle) ** 2 @ np.ones(3)).max()
    ahead = height - height[furthest] + off * np.sqrt(away**2 @ np.ones(3)) >= -SMALL
    reach, near = np.empty(len(normals)), vertices[ahead]
    order = np.argsort(normals[:, (high - low).argmax()], kind="stable")
    for half in np.array_split(order, 2):
        reach[half] = _support(normals[half], near)
    return reach


def _heights(normals: Array, vertices: Array) -> Array:
    """How far each vertex (n, 3) is along each normal (k, 3) (k, n), rounded as among many: the
    products of a single row or column are added up in another order."""
    if 1 not in (len(normals), len(vertices)):
        return np.asarray(normals @ vertices.T)
    twice = np.concatenate([normals, normals]) @ np.concatenate([vertices, vertices]).T
    return np.asarray(twice[: len(normals), : len(vertices)])


@dataclass(frozen=True, slots=True)
class Difference:
    """Half-spaces n·x <= h (k, 3), (k,) whose intersection is the set of shifts of Q, from the
    place where both have their origin at the same point, at which it meets P."""

    normals: Array
    bounds: Array

    def heights(self, apart: Array) -> Array:
        """h(n) (m, k) where P lies `apart` (m, 3) from Q."""
        return np.asarray(self.bounds + apart @ self.normals.T)

    def and_those_of(self, other: Difference) -> Difference:
        """These half-spaces and others."""
        normals = np.concatenate([self.normals, other.normals])
        return Difference(normals, np.concatenate([self.bounds, other.bounds]))


def rough(p: Polytope, q: Polytope) -> Difference:
    """The half-spaces of the faces of both: never too small."""
    mine = Difference(p.normals, p.reach + _support(-p.normals, q.vertices))
    return mine.and_those_of(Difference(-q.normals, _support(-q.normals, p.vertices) + q.reach))


def exact(p: Polytope, q: Polytope) -> Difference:
    """All half-spaces: those of the faces and those that an edge of each spans."""
    return rough(p, q).and_those_of(spanned(p, q))


def spanned(p: Polytope, q: Polytope) -> Difference:
    """The half-spaces that an edge of each spans, but for those of upright boxes, which are those
    of their faces."""
    if p.is_upright_box and q.is_upright_box:
        return Difference(np.zeros((0, 3)), np.zeros(0))
    normals = _spanned(p.edges, q.edges)
    return Difference(normals, _support(normals, p.vertices) + _support(-normals, q.vertices))


def _spanned(p: Array, q: Array) -> Array:
    """Unit normals (k, 3) of the facets spanned by an edge of P and one of Q: those whose arcs
    cross, the arc of Q's edge being turned about (Gregorius, The Separating Axis Test, 2013)."""
    if len(p) * len(q) == 0:
        return np.zeros((0, 3))
    a, b, c, d = p[:, 1], p[:, 2], -q[:, 1], -q[:, 2]
    ba, dc = _cross(b, a), _cross(d, c)
    cba, dba = ba @ c.T, ba @ d.T
    adc, bdc = a @ dc.T, b @ dc.T
    crossing = (cba * dba <= SMALL) & (adc * bdc <= SMALL) & (cba * bdc >= -SMALL)
    one, other = np.nonzero(crossing)
    normals = _cross(p[one, 0], q[other, 0])
    length = np.linalg.norm(normals, axis=1)
    scale = np.linalg.norm(p[one, 0], axis=1) * np.linalg.norm(q[other, 0], axis=1)
    parallel = length <= 1e-7 * scale
    normals = normals[~parallel] / length[~parallel, None]
    outward = np.einsum("ij,ij->i", normals, (a + b)[one[~parallel]] + (c + d)[other[~parallel]])
    doubtful = np.abs(outward) < 1e-6
    normals = np.concatenate([normals * np.where(outward < 0, -1, 1)[:, None], -normals[doubtful]])
    return np.asarray(normals[distinct(normals)])


def _cross(a: Array, b: Array) -> Array:
    """The products of vectors (n, 3): numpy's own takes longer to begin than to compute few."""
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def distinct(normals: Array) -> NDArray[np.int64]:
    """Which normals to keep of those that are the same up to rounding, told by their place along a
    line in no special direction."""
    key = np.round(normals @ (np.sqrt([2.0, 3.0, 5.0]) * 1e9)).astype(np.int64)
    return np.asarray(np.unique(key, return_index=True)[1])


def summits(heights: Array, slopes: Array) -> tuple[Array, Array]:
    """For each row (m, k) the greatest value over λ >= 0 of the lowest of its lines h + λ s, and λ:
    the greatest depth of a body on its way, and how far it has come [m].

    The summit lies between a rising and a falling line; where they cross, a lower line replaces
    that of its own kind, until there is none.
    """
    slopes = np.where(np.abs(slopes) < SMALL, 0.0, slopes)
    rows = np.arange(len(heights))
    rising = heights.argmin(axis=1)
    steepest = slopes == slopes.min(axis=1, keepdims=True)
    falling = np.where(steepest, heights, np.inf).argmin(axis=1)
    depth, shift = heights[rows, rising], np.zeros(len(heights))
    left: NDArray[np.int64] = np.flatnonzero(slopes[rows, rising] > 0)
    while len(left):
        up, down = rising[left], falling[left]
        drop = heights[left, down] - heights[left, up]
        at = np.maximum(drop / (slopes[left, up] - slopes[left, down]), 0.0)
        value = heights[left] + at[:, None] * slopes[left]
        lowest = value.argmin(axis=1)
        deepest = value[np.arange(len(left)), lowest]
        depth[left], shift[left] = deepest, at
        gain = heights[left, up] + at * slopes[left, up] - deepest
        climbs = slopes[left, lowest] > 0
        new = (gain > 1e-13) & (lowest != up) & (lowest != down)
        rising[left[climbs & new]] = lowest[climbs & new]
        falling[left[~climbs & new]] = lowest[~climbs & new]
        left = left[new]
    return depth, shift
