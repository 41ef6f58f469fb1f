"""Where the solid bodies of machines are while places of a net are marked.

A machine is whatever has axes and moves: a robot, the sliders of a magazine, the outfeed's tray;
what stands is there in every marking. MachineBodies are swept as boxes over the intervals of their
machine's axes.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from itertools import product

import numpy as np

from factory.floor.layout.dimensions import PAYLOADS
from factory.floor.layout.guidepath import Guidepath
from factory.floor.mating.depth import Polytope, polytope, upright_box
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
        ends = np.sort(points, axis=0)
        swept = self.boxes + (ends if len(ends) == 2 else ends[[0, -1]])
        if any(second):
            swept[self.rise, :, 2] += sorted(second)
        return np.asarray(swept)

    def legs(self, first: Span, second: Span) -> Iterator[Leg]:
        """The legs on which bodies move as the axes go over two spans [m], each extended by the
        greatest error of the first axis, except for a slider, which stands."""
        off = ALONG * (1.0 - abs(self.way[2]))
        low, high = min(first) - off, max(first) + off
        if self.bent is None:
            yield np.array([[low], [high]]) * self.way, second
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
        swept = [*map(self.bodies.swept, self.legs)]
        return np.concatenate(swept) if swept[1:] else swept[0]

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

    def is_apart(self, other: Presence) -> bool:
        """Whether it has no place in common with another."""
        return {*self.places}.isdisjoint(other.places)

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
        points = np.concatenate([corners + end for end in ends])
        low, high = points.min(axis=0), points.max(axis=0)
        return upright_box(low, high) if _fill(points, low, high) else polytope(points)


def _fill(points: Array, low: Array, high: Array) -> bool:
    """Whether the hull of points (n, 3) is the box round them, from `low` to `high` (3,)."""
    above = points == high
    at_corner = (above | (points == low)).all(axis=1)
    return len({*(above[at_corner] @ (1, 2, 4)).tolist()}) == 8


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
