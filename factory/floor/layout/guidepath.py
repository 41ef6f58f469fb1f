"""Guidepaths: lines on the floor, and how robots are stretched to their payloads.

Every part is carried in its place in the finished product, relative to the product's middle. Where
that middle is in the world is the robot's *station*: at a mate the middles of all robots coincide,
so the parts are assembled when they meet. A guidepath is the line of that point: straight, or with
bends, along which the robot goes without turning.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from factory.floor.layout.way import Bend, BentWay, way_of
from factory.support.arrays import Array
from factory.support.boxes import Box, Extent, Point2, hull, project


@dataclass(frozen=True, slots=True)
class Guidepath:
    """The guidepath of a robot, and how the robot reaches from its carriage to its payload. The arc
    length x of the carriage runs from A = 0; it delivers at x = reach, and receives at B = reach +
    travel.

    Attributes:
        heading: u, a unit vector towards A (2,).
        side: t, a unit vector to the left or right of it (2,).
        a: the product's middle where the robot delivers [m] (2,).
        travel: distance from where it receives to where it delivers [m]; an angle for a robot that
            is fixed [rad].
        reach: 2r, distance of the carriage behind the product's middle [m].
        offset: distance of the carriage's line to the side t [m].
        arm: distance of the end of the arm behind the middle [m].
        nest: distance of the payload's own middle ahead of the middle, which a finger bridges [m].
        aside: distance of that to the side t of the carriage's line, in a lane beside another's
            [m].
        bends: where the guidepath goes on beside its line, to the side t; then x is the coordinate
            of `factory.floor.layout.way`.
        rounding: radius of the corners of bends [m].
        turn: angle by which a robot that is fixed turns what it holds about the vertical, from
            where it receives to where it delivers [rad]; None for all others.
    """

    heading: Point2
    side: Point2
    a: Point2
    travel: float
    reach: float
    offset: float
    arm: float
    nest: float
    aside: float = 0.0
    bends: tuple[Bend, ...] = ()
    rounding: float = 0.0
    turn: float | None = None

    @property
    def travels(self) -> bool:
        """Whether the robot goes along it; else it stands at its station, and turns."""
        return self.turn is None

    @property
    def way(self) -> BentWay | None:
        """Its bends and their rounding; None where it is straight."""
        return (self.bends, self.rounding) if self.bends else None

    @property
    def length(self) -> float:
        """B - A [m]."""
        return self.reach + self.travel

    def fastest(self, speed: float, acceleration: float) -> float:
        """The greatest speed [m/s] of a robot with these limits, for which all corners are round
        enough."""
        return min(speed, sqrt(2 * acceleration * self.rounding)) if self.bends else speed

    @property
    def corners(self) -> list[float]:
        """The arc lengths of its corners, were they not round."""
        return [at for at in self.all_corners if at < self.length]

    @property
    def all_corners(self) -> list[float]:
        """The same with those of its line beyond its end."""
        return [at for bend in self.bends for at in (bend.at, bend.end)]

    @property
    def sideways(self) -> float:
        """+1 where it leads from B to the side t, -1 to the other side, 0 straight ahead."""
        odd = len(self.corners) % 2
        return -float(np.sign(self.bends[-1].across)) if odd else 0.0

    @property
    def r(self) -> float:
        """The robot's width r [m], of which the templates' goals are multiples."""
        return self.reach / 2

    @property
    def left(self) -> float:
        """+1 where the side t is to the left of the heading u, -1 where it is to the right."""
        return self.heading[0] * self.side[1] - self.heading[1] * self.side[0]

    def middle(self, x: float) -> Point2:
        """Where the product's middle is when the carriage is at arc length x."""
        if self.bends:
            back, across = self._bent(x)
            return self._placed(back - self.reach, across)
        back = x - self.reach if self.travels else 0.0
        return self.a[0] - self.heading[0] * back, self.a[1] - self.heading[1] * back

    def carriage(self, x: float) -> Point2:
        """f: where the carriage's centre is at arc length x."""
        if self.bends:
            back, across = self._bent(x)
            return self._placed(back, across + self.offset)
        x = x if self.travels else self.reach
        return (
            self.a[0] - self.heading[0] * x + self.side[0] * self.offset,
            self.a[1] - self.heading[1] * x + self.side[1] * self.offset,
        )

    def corner(self, at: float) -> Point2:
        """Where the carriage's line would have the corner at an arc length, were it not round."""
        place, _, second = way_of(self.bends, self.rounding).at(np.array([0]), np.array([at]))
        back, across = (place - second * self.rounding**2 / 2)[0].tolist()
        return self._placed(back, across + self.offset)

    def world(self, extent: Extent, middle: Point2) -> Box:
        """A box given in the robot's frame (u, t), as it lies in the world about `middle`."""
        ulo, uhi, tlo, thi = extent
        u, t = self.heading, self.side
        x = sorted((u[0] * ulo + t[0] * tlo, u[0] * uhi + t[0] * thi))
        y = sorted((u[1] * ulo + t[1] * tlo, u[1] * uhi + t[1] * thi))
        return middle[0] + x[0], middle[0] + x[1], middle[1] + y[0], middle[1] + y[1]

    def frame(self, box: Box) -> Extent:
        """A box about the product's middle, in the world's directions, in the robot's frame."""
        return project(box, self.heading, self.side)

    def sweeps(self, box: Box, start: float, end: float) -> list[Box]:
        """What a box about the product's middle sweeps while the carriage goes from one arc length
        to another, a box for each piece of the way."""
        if self.bends:
            (x, y), pieces = self.middle(0.0), self.pieces(min(start, end), max(start, end))
            at = np.array([x, y])
            ends = [(p.min(axis=0) + at, p.max(axis=0) + at) for p in pieces]
        else:
            (x0, y0), (x1, y1) = self.middle(start), self.middle(end)
            ends = [((min(x0, x1), min(y0, y1)), (max(x0, x1), max(y0, y1)))]
        return [
            (float(x0 + box[0]), float(x1 + box[1]), float(y0 + box[2]), float(y1 + box[3]))
            for (x0, y0), (x1, y1) in ends
        ]

    def swept(self, foot: Extent, start: float, end: float) -> list[Box]:
        """What a box in the robot's frame about its carriage sweeps on such a way."""
        if not self.bends:
            return [hull([self.world(foot, self.carriage(x)) for x in (start, end)])]
        at, middle = self.carriage(0.0), self.middle(0.0)
        about = self.world(foot, (at[0] - middle[0], at[1] - middle[1]))
        return self.sweeps(about, start, end)

    def pieces(self, low: float, high: float) -> list[Array]:
        """The guidepath between two arc lengths piece by piece, relative to where it is at 0: each
        lies in the hull of its points (k, 2) [m]."""
        frame = np.array([np.negative(self.heading), self.side])
        return [points @ frame for points in self.framed(low, high)]

    def framed(self, low: float, high: float) -> list[Array]:
        """The same points as distances back from A and to the side t [m]."""
        if not self.bends:
            return [np.array([[low, 0.0], [high, 0.0]])]
        return [*way_of(self.bends, self.rounding).pieces(0, low, high)]

    def _bent(self, x: float) -> Point2:
        """How far back and to the side a robot is from where it is at 0."""
        place, _, _ = way_of(self.bends, self.rounding).at(np.array([0]), np.array([x]))
        back, across = place[0].tolist()
        return back, across

    def _placed(self, back: float, across: float) -> Point2:
        """What is so far back from A, and to the side."""
        (u, v), (s, t) = self.heading, self.side
        return self.a[0] - u * back + s * across, self.a[1] - v * back + t * across


@dataclass(frozen=True, slots=True)
class Feeder:
    """A magazine, from which a part comes down to where it is presented, or, with a negative
    stroke, rises to there. About the product's
    middle, in the frame (u, t) of the robot: the post is at `back`, `across` from the middle, and
    `inside` is the box that the housing's walls are round. In the world: the boxes of `post`,
    `boom` and `housing`; from what height to what height the housing reaches, `low` and `high`,
    and the `stroke` by which the part is higher in it than where it is presented [m]."""

    back: float
    across: float
    inside: Extent
    post: Box
    boom: Box
    housing: Box
    low: float
    high: float
    stroke: float

    @property
    def way(self) -> float:
        """How far a part goes [m]."""
        return abs(self.stroke)

    @property
    def rises(self) -> bool:
        """Whether parts come from below."""
        return self.stroke < 0.0
