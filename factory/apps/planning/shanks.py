"""Screws by their shapes: a screw is a part with an axis, and a shank in a hole of another part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.api import DrawnSolids
from factory.apps.planning.names import Says, says
from factory.apps.planning.parts import PlacedPart
from factory.support.arrays import Array

HEAD, SHANK, SHORT, ROUND = 0.85, 0.75, 0.5, 0.16
"""Proportions of a bolt. Its head is farther from the axis than HEAD times the largest radius; its
shank is no farther than SHANK times that radius, longer than the head, and longer than half its
width. A round part has sides that differ by no more than ROUND."""

CORNERS = 1.2
"""A round bar, a hexagon at most, has corners no farther from its axis than this multiple of its
sides' distance."""

HOLE = 0.65, 1.5
"""A hole around a shank is at least and at most so many times as wide."""

HEIGHTS = (0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
"""Where along a shank it is tested for holes around it, as shares of what is beside a part."""

AROUND, MOST = 8, 6
"""The number of directions in which walls are sought, and in how many there must be one."""

RING = 3.4
"""A ring on a screw reaches no farther than this multiple of the shank's radius from its axis, and
is no higher than that."""


@dataclass(frozen=True)
class Shank:
    """The shank of a screw: `axis`, 0 to 2, `ends` (2, 3) of its centre line and `radius` [m];
    `headed`: whether there is a head beside it, which is wider."""

    axis: int
    ends: Array = field(repr=False)
    radius: float
    headed: bool

    @property
    def way(self) -> tuple[int, int]:
        """The axis, and the side of it, to which a screw with a head leaves."""
        return self.axis, 1 if self.ends[0, self.axis] > self.ends[1, self.axis] else -1

    @property
    def points(self) -> Array:
        """Points (n, 3) on its centre line."""
        first, last = self.ends
        return np.array([first + share * (last - first) for share in HEIGHTS])

    def is_inside(self, part: PlacedPart) -> bool:
        """Whether its middle is inside the box of a part."""
        middle = self.ends.mean(axis=0)
        return bool((part.solid.low < middle).all() and (middle < part.solid.high).all())

    def is_in(self, part: PlacedPart) -> bool:
        """Whether a part surrounds it: with a hole, or, where the thread is drawn into the part,
        with none. A part that bounds no volume does if its box contains the middle."""
        low, high = part.solid.low - self.radius, part.solid.high + self.radius
        if (self.ends.max(axis=0) < low).any() or (self.ends.min(axis=0) > high).any():
            return False
        body = DrawnSolids.body(part.solid)
        if body is None:
            return self.is_inside(part)
        (first, last), along = np.sort(self.ends[:, self.axis]), self.axis
        first = max(first, float(part.solid.low[along]))
        last = min(last, float(part.solid.high[along]))
        points = np.array([self.ends[0]] * len(HEIGHTS))
        points[:, along] = first + np.array(HEIGHTS) * (last - first)
        return bool(first < last) and any(self._walls(body, p) >= MOST for p in points)

    def _walls(self, body: object, point: Array) -> int:
        """In how many directions across the axis a body has a wall, or is solid, beside a point."""
        least, most = (share * self.radius for share in HOLE)
        u, v = (n for n in range(3) if n != self.axis)
        walls = 0
        for angle in 2 * np.pi * (np.arange(AROUND) + 0.3) / AROUND:
            way = np.zeros(3)
            way[u], way[v] = np.cos(angle), np.sin(angle)
            near = body.ray_cast(point, point + most * way)  # type: ignore[attr-defined]
            if near:
                far = [float(np.linalg.norm(np.asarray(h.position) - point)) for h in near]
                walls += any(distance >= least for distance in far)
            else:
                walls += is_solid(body, point)
        return walls

    def is_ringed_by(self, part: PlacedPart) -> bool:
        """Whether a part is a ring on it, such as a nut or a washer."""
        low, high, along = part.solid.low, part.solid.high, self.axis
        apart = np.delete((low + high) / 2 - self.ends[0], along)
        wide = np.delete(high - low, along).max() / 2
        reach = RING * self.radius
        slim = wide < reach and high[along] - low[along] < reach
        return bool(slim and np.linalg.norm(apart) < 0.3 * self.radius) and self.is_in(part)


def is_solid(body: object, point: Array) -> bool:
    """Whether a point is inside a body."""
    out = np.array([3.1e3, 2.3e3, 1.7e3])
    return len(body.ray_cast(point, point + out)) % 2 == 1  # type: ignore[attr-defined]


def shank_of(part: PlacedPart, bare: bool = False) -> Shank | None:
    """The shank of a part that has a head, along an axis; `bare`: or of a round bar without one.
    None if the part is neither."""
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    bars = (_bar(part, axis, low, high) for axis in range(3)) if bare else ()
    bolts = (_bolt(part.vertices, axis, low, high) for axis in range(3))
    return next((shank for shank in (*bolts, *bars) if shank is not None), None)


def _bolt(vertices: Array, axis: int, low: Array, high: Array) -> Shank | None:
    """The shank of a bolt along an axis."""
    across = np.delete(vertices - (low + high) / 2, axis, axis=1)
    wide = np.ptp(across, axis=0)
    radius, along = np.linalg.norm(across, axis=1), vertices[:, axis] - low[axis]
    head, length = radius > HEAD * radius.max(), high[axis] - low[axis]
    if np.ptp(wide) > ROUND * wide.max() or np.ptp(along[head]) > SHORT * length:
        return None
    ends = along[head].min(), length - along[head].max()
    tip = along > along[head].max() + 1e-6 if ends[0] < ends[1] else along < ends[0] - 1e-6
    outer = min(ends) < SHORT * length / 4 and bool(tip.any())
    slim = outer and radius[tip].max() <= SHANK * radius.max() and _is_round(across[tip])
    if not (slim and radius.max() < max(ends)):  # a brick has a stud that is shorter
        return None
    line = np.array([(low + high) / 2] * 2)
    beside = along[head].max() if ends[0] < ends[1] else along[head].min()
    tips = along[tip]
    line[:, axis] = low[axis] + np.array([beside, max(tips, key=lambda a: abs(a - beside))])
    return Shank(axis, line, float(radius[tip].max()), True)


def _bar(part: PlacedPart, axis: int, low: Array, high: Array) -> Shank | None:
    """A round bar along an axis as a shank."""
    across = np.delete(part.vertices - (low + high) / 2, axis, axis=1)
    radius = float(np.linalg.norm(across, axis=1).max())
    if not _is_round(across) or high[axis] - low[axis] < radius:
        return None
    line = np.array([(low + high) / 2] * 2)
    line[:, axis] = low[axis], high[axis]
    return Shank(axis, line, radius, False)


def _is_round(across: Array) -> bool:
    """Whether points (n, 2) about an axis are those of a circle, or of a hexagon."""
    wide, radius = np.ptp(across, axis=0), np.linalg.norm(across, axis=1).max()
    return bool(np.ptp(wide) <= ROUND * wide.max() and 2 * radius <= CORNERS * wide.max())


def screws_among(parts: Sequence[PlacedPart], named: Sequence[str] = ()) -> tuple[str, ...]:
    """The labels of parts that are screws: those that are `named`; those whose name says so; those
    that may be screws by their name, or have a head that is wider than their shank, if the shank
    is in a hole of another part."""
    return tuple(_among(parts, named))


def _among(parts: Sequence[PlacedPart], named: Sequence[str]) -> Iterator[str]:
    for part in parts:
        meaning = called(part)
        if part.label in named or meaning == Says.SCREW:
            yield part.label
        elif meaning != Says.OTHER:
            shank = shank_of(part, bare=meaning == Says.PERHAPS)
            others = [other for other in parts if other is not part]
            larger = [other for other in others if other.solid.mass > part.solid.mass]
            if shank and larger and _is_massive(part, shank) and any(map(shank.is_in, others)):
                yield part.label


def called(part: PlacedPart) -> Says:
    """What the label of a part says of it or, if that says nothing, the name of its mesh."""
    meaning = says(part.label)
    mesh = str(part.node.parameter("mesh", "")).rpartition("/")[2].rpartition(".")[0]
    return says(mesh) if meaning == Says.NOTHING else meaning


def _is_massive(part: PlacedPart, shank: Shank) -> bool:
    """Whether a part has material on the axis of its shank: a plate with a hole has none."""
    body = DrawnSolids.body(part.solid)
    return body is None or any(is_solid(body, point) for point in shank.points)
