"""What bends the straight way to the goal: gates (the L-shaped W) and Δ (robots touching).

Both are kept for many modes at once; indices are those of the bundle's robots and modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from factory.support.arrays import Array, Index
from factory.theory.control.mode import Mode

OPEN = 0.8
"""A gate is fully open where its robot is this near to its goal [eps]."""


def ranges(first: Index, count: Index) -> Index:
    """first[0], first[0] + 1, ... (count[0] of them), first[1], ...: all in one array."""
    before = np.cumsum(count) - count
    return np.asarray(np.arange(count.sum()) + np.repeat(first - before, count))


def rows_of(owner: Index, chosen: Index) -> tuple[Index, Index]:
    """The rows whose owner is among the `chosen`: for each the place of its owner there, and its
    number. The rows are sorted by owner."""
    first = np.searchsorted(owner, chosen)
    count = np.searchsorted(owner, chosen, side="right") - first
    return np.repeat(np.arange(len(chosen)), count), ranges(first, count)


@dataclass(frozen=True, slots=True, eq=False)
class Gates:
    """tau, how far from its goal each gated robot stays: a C² step of the gate robot's distance to
    its own goal, 0 up to OPEN * eps and `standoff` from eps on.

    All (g,): the gated `robot`, its `gate`, `inner` = OPEN * eps [m] and the `width` of the step
    beyond it, `standoff` [m], `mode`; `lag` [m]: the measured position of the gate robot,
    from that of its reference.
    """

    robot: Index
    gate: Index
    inner: Array
    width: Array
    standoff: Array
    mode: Index
    lag: Array | float = 0.0

    @classmethod
    def of(cls, modes: Sequence[Mode], starts: Index) -> Gates:
        """The gates of `modes` whose first robots have the numbers `starts`."""
        owner = np.repeat(np.arange(len(modes)), [mode.size for mode in modes])
        gate = np.concatenate([np.empty(0, np.intp), *(mode.gate for mode in modes)])
        standoff = np.concatenate([np.empty(0), *(mode.standoff for mode in modes)])
        robot = np.flatnonzero(gate >= 0)
        mode_of = owner[robot]
        eps = np.array([mode.eps for mode in modes])
        inner, width = OPEN * eps[mode_of], (1 - OPEN) * eps[mode_of]
        return cls(robot, gate[robot] + starts[mode_of], inner, width, standoff[robot], mode_of)

    def select(self, chosen: Index, shift: Index) -> Gates:
        """The gates of some modes, by number and in that order, whose robots now have numbers
        higher by `shift`."""
        mode, at = rows_of(self.mode, chosen)
        moved = shift[mode]
        robot, gate = self.robot[at] + moved, self.gate[at] + moved
        return Gates(robot, gate, self.inner[at], self.width[at], self.standoff[at], mode)

    def lagging(self, lag: Array) -> Gates:
        """The same gates, for robots (n,) whose measured positions are so far from those of their
        references [m]."""
        return replace(self, lag=lag[self.gate])

    def opens(self, before: Array, after: Array) -> bool:
        """Whether any gate begins to open between two `offset`s [m] of the robots from their
        goals."""
        return bool(((self._phase(before) == 1.0) & (self._phase(after) < 1.0)).any())

    def closed(self, offset: Array) -> Array:
        """tau (g,) [m] where the robots are `offset` [m] from their goals."""
        z = self._phase(offset)
        return self.standoff * (z * z * z * (10.0 + z * (6.0 * z - 15.0)))

    def slope(self, offset: Array) -> Array:
        """dtau / dx_gate (g,)."""
        z = self._phase(offset)
        steepness = self.standoff / self.width * (30.0 * (z * (1.0 - z)) ** 2)
        return np.asarray(steepness * np.sign(offset[self.gate] + self.lag))

    def _phase(self, offset: Array) -> Array:
        z = np.abs(offset.take(self.gate) + self.lag)
        z -= self.inner
        z /= self.width
        np.maximum(z, 0.0, out=z)
        return np.minimum(z, 1.0, out=z)


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Δ as a product of obstacles b = 1 - (1 - z)³, z = (distance - touch) / (reach - touch): 0
    where two robots touch, with a slope there, and exactly 1, C², from `reach` on.

    `robots` and `meet` are (2, m); `touch`, `reach` [m] and `mode` (m,).
    """

    robots: Index
    meet: Array
    touch: Array
    reach: Array
    mode: Index

    @classmethod
    def of(cls, modes: Sequence[Mode], starts: Index) -> Pairs:
        """The pairs of `modes` whose first robots have the numbers `starts`."""
        shifted = (mode.pairs + start for mode, start in zip(modes, starts, strict=True))
        robots = np.concatenate([np.empty((0, 2), np.intp), *shifted])
        meet = np.concatenate([np.empty((0, 2)), *(mode.meet for mode in modes)])
        return cls(
            np.ascontiguousarray(robots.T),
            np.ascontiguousarray(meet.T),
            np.concatenate([np.empty(0), *(mode.touch for mode in modes)]),
            np.concatenate([np.empty(0), *(mode.reach for mode in modes)]),
            np.repeat(np.arange(len(modes)), [len(mode.pairs) for mode in modes]),
        )

    def select(self, chosen: Index, shift: Index) -> Pairs:
        """The pairs of some modes, by number and in that order, whose robots now have numbers
        higher by `shift`."""
        mode, at = rows_of(self.mode, chosen)
        robots = self.robots[:, at] + shift[mode]
        return Pairs(robots, self.meet[:, at], self.touch[at], self.reach[at], mode)

    def apart(self, x: Array) -> Array:
        """The distance (m,) [m] of each pair in the tree of guidepaths."""
        offset = x.take(self.robots)
        offset -= self.meet
        np.abs(offset, out=offset)
        return np.asarray(offset[0] + offset[1])

    def product(self, x: Array, modes: int) -> tuple[Array, Array]:
        """beta (modes,) and its derivatives (n,) [1/m]. Where a robot stands on a meeting point the
        distance has a crease; its derivative by that robot is taken as 0 there."""
        width = self.reach - self.touch
        left = 1.0 - np.clip((self.apart(x) - self.touch) / width, 0.0, 1.0)
        factor = 1.0 - left**3
        beta = np.ones(modes)
        np.multiply.at(beta, self.mode, factor)
        others = beta[self.mode] / np.maximum(factor, np.finfo(float).tiny)
        slope = others * (3.0 * left**2 / width) * np.sign(x[self.robots] - self.meet)
        push = np.zeros(x.size)
        np.add.at(push, self.robots, slope)
        return beta, push

    def room(self, x: Array) -> Array:
        """For each robot (n,) [m]: the gap to the nearest obstacle acting on it, inf for none."""
        apart = self.apart(x)
        gap = np.where(apart < self.reach, np.maximum(apart - self.touch, 0.0), np.inf)
        room = np.full(x.size, np.inf)
        np.minimum.at(room, self.robots, np.broadcast_to(gap, self.robots.shape))
        return room
