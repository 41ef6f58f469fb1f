"""Where clamps hold: places between whose sides jaws can close, and the columns that they are among
the parts.

To what is beside it a clamp is three hands below, or above: the pad, and on each side a jaw with
all its way from open to closed, as a column that ends where it does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from factory.floor.layout.hands.clamp import Clamp
from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.reach import AIR
from factory.floor.layout.hands.surfaces import Way
from factory.floor.layout.hands.tips import TERMS, shares
from factory.support.arrays import Array, Truth
from factory.theory.problem.robot_bodies import Jaw

OPEN = 1e-3
"""Least distance of open jaws from what comes between them [m]."""

STEP = 1e-6
"""Jaws close by whole multiples of this [m]."""

GRID, FINER = 7, 4
"""The widest place beside a jaw is looked for on so many lines each way, and so often on finer ones
round the widest so far."""


class Clamping:
    """The clamps of a factory's robots."""

    def __init__(self, holding: Holding) -> None:
        self.holding = holding

    def jaws(self, robot: int) -> tuple[Jaw, ...]:
        """The jaws of a robot."""
        return self.holding.factory.robots[robot].body.jaws

    def length(self, robot: int) -> float:
        """How far the jaws of a robot reach along its heading from the pad [m]; 0 without jaws."""
        jaws = self.jaws(robot)
        return Clamp(jaws, ()).length if jaws else 0.0

    def clamp(
        self, tours: Sequence[int], kind: HandKind, points: Sequence[Point3], u: Way
    ) -> Clamp | None:
        """The clamp of a robot that heads along u, whose pad is at a point of what it holds on each
        of its tours; None without jaws."""
        jaws = self.jaws(tours[0])
        if not jaws:
            return None
        each = (
            self._closed(tour, kind, np.array([at]), u)[0]
            for tour, at in zip(tours, points, strict=True)
        )
        rows = (tuple(closed[0].round(6).tolist()) for closed in each)
        return Clamp(jaws, tuple(rows), kind.up)

    def places(self, robot: int, kind: HandKind, places: Places, u: Way) -> Places:
        """Those of some places between whose sides the jaws of a robot can close, with the share of
        their strength that is used; all of them without jaws."""
        jaws = self.jaws(robot)
        if not (jaws and len(places)):
            return places
        closed, fits = self._closed(robot, kind, places.at, u)
        places, closed = places.chosen(fits), closed[fits]
        clamps = (Clamp(jaws, (tuple(row),), kind.up) for row in closed.tolist())
        terms = np.array([clamp.gauge(u) for clamp in clamps]).reshape(len(closed), TERMS, 6)
        label = held(self.holding.factory, robot)
        load = np.concatenate(np.broadcast_arrays(*self.holding.loads(label).about(places.at)))
        used = shares((terms @ load.swapaxes(0, 1)).swapaxes(1, 2)).max(axis=-1, initial=0.0)
        return replace(places, share=used, pinned=used, covered=np.ones(len(places)))

    def columns(self, robot: int, kind: HandKind, places: Places, u: Way) -> Iterator[Places]:
        """The jaws of a robot at each place, as columns of a kind of hand."""
        if not (self.jaws(robot) and len(places)):
            return
        closed, _ = self._closed(robot, kind, places.at, u)
        ahead, across = np.array([*u, 0.0]), np.array([-u[1], u[0], 0.0])
        for number, jaw in enumerate(self.jaws(robot)):
            face = jaw.opening - closed[:, number]
            half = np.maximum(jaw.back - face, jaw.high[0] - jaw.low[0]) / 2
            at = places.at + (jaw.low[0] + jaw.high[0]) / 2 * ahead
            at = at + (jaw.side * (face + half))[:, None] * across
            at[:, 2] += kind.up * (jaw.high[2] + AIR)
            yield replace(places, at=at, radius=half)

    def _closed(self, robot: int, kind: HandKind, at: Array, u: Way) -> tuple[Array, Truth]:
        """How far the jaws close over pads at places (n, 3) of what a robot takes (n, jaws) [m];
        and whether all can (n,): it is not too wide there, nor too narrow."""
        jaws = self.jaws(robot)
        out = np.stack([self._widest(robot, kind, at, jaw, u) for jaw in jaws], axis=1)
        opening, strokes = (np.array([getattr(j, n) for j in jaws]) for n in ("opening", "stroke"))
        closed = np.floor((opening - out - AIR) / STEP) * STEP
        fits = np.isfinite(closed) & (closed >= OPEN) & (closed <= strokes)
        return closed, np.asarray(fits.all(axis=1))

    def _widest(self, robot: int, kind: HandKind, at: Array, jaw: Jaw, u: Way) -> Array:
        """How far beside pads at places (n, 3) what a robot takes reaches where a jaw closes (n,)
        [m]; -inf where it does not reach there. The surface of a convex body is dome-shaped seen
        from outside, so lines round the widest of a grid come ever closer to the widest place."""
        label = held(self.holding.factory, robot)
        parts = self.holding.factory.contents[label]
        along, sense = (0, u[0]) if u[0] else (1, u[1])
        side = 1 - along, round(jaw.side * (u[0] if u[0] else -u[1]))
        begin, end = sorted((sense * jaw.low[0], sense * jaw.high[0]))
        way = kind.up
        back = np.full(len(at), self.holding.box(label)[(1 - way) // 2, 2])
        heights = np.sort(np.stack([back, at[:, 2] + way * jaw.high[2]]), axis=0)
        low = np.stack([at[:, along] + begin, heights[0]], axis=1)
        high = np.stack([at[:, along] + end, heights[1]], axis=1)
        least, most, widest = low, high, np.full(len(at), -np.inf)
        steps = np.linspace(0.0, 1.0, GRID)
        for _ in range(1 + FINER):
            grid = np.zeros((len(at), GRID, GRID, 3))
            grid[..., along] = (low[:, :1] + (high - low)[:, :1] * steps)[:, :, None]
            grid[..., 2] = (low[:, 1:] + (high - low)[:, 1:] * steps)[:, None, :]
            lines = grid.reshape(len(at), -1, 3)
            out = self.holding.surfaces.outermost(parts, lines.reshape(-1, 3), side)
            out = out.reshape(lines.shape[:2])
            best = np.arange(len(at)), out.argmax(axis=1)
            widest = np.maximum(widest, out[best])
            middle, reach = lines[best][:, [along, 2]], (high - low) / (GRID - 1)
            low, high = np.maximum(middle - reach, least), np.minimum(middle + reach, most)
        return np.asarray(widest - side[1] * at[:, side[0]])
