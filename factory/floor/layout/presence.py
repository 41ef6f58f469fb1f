"""Where the solid bodies of machines are while places of a net are marked, and which come near.

A machine is whatever has axes and moves: a robot, the sliders of a magazine, the outfeed's tray;
what stands is there in every marking. MachineBodies are swept as boxes over the intervals of their
machine's axes. Two presences of different machines are *near* where bodies of both come closer than
drives and grips need, and both are not one and the same mode, whose field keeps its robots apart.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from itertools import product

import numpy as np
import shapely

from factory.floor.layout.crossings import near as near_boxes
from factory.floor.layout.dimensions import PAYLOADS
from factory.floor.layout.guidepath import Guidepath
from factory.floor.mating.depth import Polytope, exact, polytope, rough
from factory.support.arrays import Array, Index, Truth

ACROSS = 5e-5
"""Bodies of machines that work together come no nearer than this: a robot's pad is 0.2 mm off what
it holds, a feeder's 0.1 mm [m]."""

ALONG = 5e-5
"""A robot is no further than this from where its reference is, along its guidepath [m]: 0.06 mm is
the most that is measured (docs/fidelity.md)."""

ROUNDING = 1e-6
"""Lengths that differ by less are the same [m]."""

ANY = -1
"""The layer of a body that stands in all layers."""

UP = np.array([0.0, 0.0, 1.0])

Span = tuple[float, float]
"""From where to where an axis goes, in either order [m]."""

Leg = tuple[Array, Span]
"""Points (k, 3) whose hull holds all the ways of the first axis [m], and the span of the second."""


STILL: tuple[Span, Span] = (0.0, 0.0), (0.0, 0.0)
"""The spans of a machine that stays where its bodies are told."""


@dataclass(frozen=True, eq=False, slots=True)
class MachineBodies:
    """Convex bodies of a machine in the world, its axes at 0: their `names`, `boxes` (n, 2, 3) and
    `corners` (k, 3) as seen from `origins` (n, 3) [m], the `layers` in which they are (n,), and
    which of them `rise` with its second axis (n,). Its first axis moves all of them along the
    vector `way` (3,), or along a guidepath that is `bent`."""

    names: tuple[str, ...]
    boxes: Array
    corners: tuple[Array, ...]
    origins: Array
    layers: Index
    rise: Truth
    way: Array
    bent: Guidepath | None = None

    def swept(self, leg: Leg) -> Array:
        """The boxes (n, 2, 3) of all that they take on a leg."""
        points, second = leg
        swept = self.boxes + np.stack([points.min(axis=0), points.max(axis=0)])
        swept[self.rise, :, 2] += np.sort(second)
        return np.asarray(swept)

    def legs(self, first: Span, second: Span) -> Iterator[Leg]:
        """The legs on which bodies move as the axes go over two spans [m], each extended by the
        greatest error of the first axis, except for a slider, which stands."""
        off = ALONG * (1.0 - abs(self.way[2]))
        low, high = min(first) - off, max(first) + off
        if self.bent is None:
            yield np.outer([low, high], self.way), second
            return
        for points in self.bent.pieces(low, high):
            yield np.pad(points, ((0, 0), (0, 1))), second

    def at(self, first: float, second: float) -> MachineBodies:
        """The same where the axes are at two positions [m]."""
        place = self.way * first
        if self.bent is not None:
            place = np.append(self.bent.pieces(first, first + ROUNDING)[0][0], 0.0)
        return self.moved(place + UP * second)

    @property
    def as_boxes(self) -> MachineBodies:
        """The same, with each body filling its box."""
        ends = self.boxes - self.origins[:, None]
        return replace(self, corners=corners_of(ends))

    def moved(self, by: Array) -> MachineBodies:
        """The same, elsewhere."""
        return replace(self, boxes=self.boxes + by, origins=self.origins + by)

    def going(self, way: Array) -> MachineBodies:
        """The same for a machine whose first axis moves the bodies along another vector (3,)."""
        return replace(self, way=way, bent=None)

    def __add__(self, other: MachineBodies) -> MachineBodies:
        """The bodies of both, which move together."""
        return MachineBodies(
            self.names + other.names,
            np.concatenate([self.boxes, other.boxes]),
            self.corners + other.corners,
            np.concatenate([self.origins, other.origins]),
            np.concatenate([self.layers, other.layers]),
            np.concatenate([self.rise, other.rise]),
            self.way,
            self.bent,
        )


@dataclass(frozen=True, eq=False)
class Presence:
    """A `machine`, by name, while all of some `places` (indices) of a net are marked, none for what
    stands: its `bodies` and what it holds, as its axes go over pairs of spans, one after another.
    `robot` (index): itself, or the one that it serves; `partners`: numbers that it shares with the
    machines that it works together with; whether it `bears` on what it hands over; `label`: what it
    holds, or shows next, "" for nothing; `since`: the end of the operation, a transition, since
    which a robot has nothing to hold, -1 for others."""

    robot: int
    machine: str
    places: tuple[int, ...]
    bodies: MachineBodies = field(repr=False)
    sweeps: tuple[tuple[Span, Span], ...] = (STILL,)
    partners: frozenset[int] = field(default=frozenset(), repr=False)
    bears: bool = False
    label: str = ""
    since: int = -1

    @cached_property
    def legs(self) -> list[Leg]:
        """The legs (m) of all pairs of spans."""
        return [leg for spans in self.sweeps for leg in self.bodies.legs(*spans)]

    @cached_property
    def boxes(self) -> Array:
        """The box that each body sweeps on each leg (m n, 2, 3) [m]."""
        return np.concatenate([*map(self.bodies.swept, self.legs)])

    @cached_property
    def layers(self) -> Index:
        """The layer of each of these boxes (m n,)."""
        return np.tile(self.bodies.layers, len(self.legs))

    @cached_property
    def hull(self) -> Array:
        """The box (2, 3) of all of them [m]."""
        return np.array([self.boxes[:, 0].min(axis=0), self.boxes[:, 1].max(axis=0)])

    @cached_property
    def filled(self) -> Hashable:
        """A digest of the space that its bodies fill."""
        bodies = self.bodies
        arrays = (
            bodies.boxes,
            bodies.origins,
            bodies.layers,
            bodies.rise,
            bodies.way,
            *bodies.corners,
        )
        sizes = repr((self.sweeps, *map(len, bodies.corners))).encode()
        return sha256(sizes + b"".join(one.tobytes() for one in arrays)).digest(), bodies.bent

    def name(self, number: int) -> str:
        """The body of one of the boxes."""
        return self.bodies.names[number % len(self.bodies.names)]

    def solid(self, number: int) -> Polytope:
        """The convex body in one of the boxes."""
        if number not in self._solids:
            self._solids[number] = self._solid(number)
        return self._solids[number]

    @cached_property
    def _solids(self) -> dict[int, Polytope]:
        return {}

    def _solid(self, number: int) -> Polytope:
        leg, body = divmod(number, len(self.bodies.names))
        points, second = self.legs[leg]
        rise = UP * bool(self.bodies.rise[body])
        ends = [point + rise * z for point in points for z in {*second}]
        corners = self.bodies.corners[body] + self.bodies.origins[body]
        return polytope(np.concatenate([corners + end for end in ends]))


Lacking = tuple[float, int, int]
"""By how much nearer than they may two boxes come [m], and their numbers."""


@dataclass(frozen=True, slots=True)
class Near:
    """Two presences that come near, which `bodies` of theirs come nearest, and by how much nearer
    than they may (`lacking`) [m]."""

    one: Presence
    other: Presence
    bodies: tuple[str, str]
    lacking: float


def near(presences: Sequence[Presence], clearance: float) -> Iterator[Near]:
    """The pairs of presences of different machines without a common place that come near: nearer
    than ACROSS, or than the clearance [m] where bodies are in one layer and their machines do not
    work together. Near linear."""
    hulls = np.array([presence.hull for presence in presences]).reshape(-1, 2, 3)
    machine = np.unique([presence.machine for presence in presences], return_inverse=True)[1]
    low, high = hulls[:, 0] - clearance / 2, hulls[:, 1] + clearance / 2
    for first, second in near_boxes(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])):
        meets = (low[first] < high[second]).all(axis=1) & (low[second] < high[first]).all(axis=1)
        meets &= machine[first] != machine[second]
        for i, j in zip(first[meets].tolist(), second[meets].tolist(), strict=True):
            one, other = presences[i], presences[j]
            if not {*one.places}.isdisjoint(other.places):
                continue
            if (pair := nearest(one, other, clearance)) is not None:
                yield pair


def nearest(one: Presence, other: Presence, clearance: float) -> Near | None:
    """Two presences with the bodies whose boxes come nearest, relative to the distance they need,
    if any come too near."""
    pairs = _pairs(one, other, clearance)
    lacking, i, j = max(pairs, default=(0.0, 0, 0))
    return Near(one, other, (one.name(i), other.name(j)), lacking) if pairs else None


def nearer(near: Near, clearance: float) -> Near | None:
    """The same, judged by the bodies themselves, which may be apart where their boxes are not."""
    judged = _judged(near.one, near.other, clearance)
    return judged and _named(near, judged)


class Nearness:
    """Judges pairs of presences as `nearer`, each only once for all that are alike: in the turns of
    a period, and in the rounds of a search."""

    def __init__(self, clearance: float) -> None:
        self._clearance, self._known = clearance, dict[Hashable, Lacking | None]()

    def nearer(self, near_pair: Near) -> Near | None:
        """The pair as `nearer` judges it."""
        if (pair := alike(near_pair.one, near_pair.other)) not in self._known:
            self._known[pair] = _judged(near_pair.one, near_pair.other, self._clearance)
        judged = self._known[pair]
        return judged and _named(near_pair, judged)


def alike(one: Presence, other: Presence) -> Hashable:
    """A key of two presences: pairs with equal keys come near alike."""
    apart = one.partners.isdisjoint(other.partners)
    return one.filled, other.filled, apart, one.bears or other.bears


def _named(pair: Near, judged: Lacking) -> Near:
    lacking, i, j = judged
    return replace(pair, bodies=(pair.one.name(i), pair.other.name(j)), lacking=lacking)


def _judged(one: Presence, other: Presence, clearance: float) -> Lacking | None:
    """The bodies that come too near, and by how much; edges count only if faces do not decide."""
    for lacking, i, j in sorted(_pairs(one, other, clearance), reverse=True):
        need = lacking - float(_overlap(one.boxes[i], other.boxes[j]))
        solids = one.solid(i), other.solid(j)
        if need + float(rough(*solids).bounds.min()) <= ROUNDING:
            continue
        if (lacks := min(lacking, need + float(exact(*solids).bounds.min()))) > ROUNDING:
            return lacks, i, j
    return None


def _pairs(one: Presence, other: Presence, clearance: float) -> list[Lacking]:
    """The pairs of boxes of two presences that come too near, and by how much."""
    across = 0.0 if one.bears or other.bears else ACROSS
    apart = across if one.partners & other.partners else clearance - 2 * (ALONG + ROUNDING)
    here = _within(one.boxes, other.hull, apart)
    there = _within(other.boxes, one.hull, apart) if len(here) else here
    if not len(there):
        return []
    a, b = one.boxes[here][:, None], other.boxes[there][None]
    layer, beside = one.layers[here][:, None], other.layers[there][None]
    alike = (layer == beside) | (layer == ANY) | (beside == ANY)
    lacking = np.where(alike, apart, across) + _overlap(a, b)
    pairs = zip(*np.nonzero(lacking > ROUNDING), strict=True)
    return [(float(lacking[i, j]), int(here[i]), int(there[j])) for i, j in pairs]


def _overlap(one: Array, other: Array) -> Array:
    """Depth of overlap of boxes (..., 2, 3); negative: their distance (...) [m]."""
    low = np.maximum(one[..., 0, :], other[..., 0, :])
    return np.asarray((np.minimum(one[..., 1, :], other[..., 1, :]) - low).min(axis=-1))


def _within(boxes: Array, hull: Array, apart: float) -> Index:
    """Which boxes (n, 2, 3) come nearer than a distance to a box (2, 3)."""
    meets = (boxes[:, 0] < hull[1] + apart) & (boxes[:, 1] > hull[0] - apart)
    return np.flatnonzero(meets.all(axis=1))


def corners_of(boxes: Array) -> tuple[Array, ...]:
    """The corners (8, 3) of boxes (n, 2, 3)."""
    return tuple(np.array([*product(*box.T)]) for box in boxes)


def boxed(
    names: tuple[str, ...], boxes: Array, way: Array, corners: tuple[Array, ...] = ()
) -> MachineBodies:
    """Bodies of boxes among the payloads, or with other corners inside these."""
    count = len(boxes)
    shapes, layers = corners or corners_of(boxes), np.full(count, PAYLOADS)
    return MachineBodies(
        names, boxes, shapes, np.zeros((count, 3)), layers, np.zeros(count, bool), way
    )
