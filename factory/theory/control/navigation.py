"""Navigation functions (Rimon and Koditschek 1992) and the fields derived from them, for all active
modes at once.

With u = x - goal - tau the offset of a robot from where it may go now (tau > 0 while its gate is
closed), and h(u) = sqrt(u² + s²) - s, a square near 0 and a length beyond s,

    gamma = sum (h(u) + tau) / span        over the robots of the mode
    beta  = product of b                   over its pairs, the obstacles that make up Δ
    phi   = gamma / (gamma^kappa + beta)^(1/kappa)

gamma is a squared distance to the goal, sum z², in the coordinates z = ±sqrt(h(u) + tau'), tau' the
sum over the robots that wait for this one. x -> z is the diffeomorphism that straightens the
L-shaped W, and navigation functions are invariant under those; but z of a robot that waits itself
jumps at u = 0 while its gate is closed. gamma is smooth there, with no critical point but the goal:
along a robot that waits for none its derivative is 0 at u = 0 alone, where what waits for it is
free, and so on down the chain (docs/theory/modes.md). phi is 0 at the goal and 1 on Δ. On
the stops A and B it need not be 1: it falls away from them wherever no obstacle acts, and a robot
pushed against a stop stands there.

The field is F = -K grad phi with K diagonal and positive. With D = d/dx of one robot,

    F = -sign(w) min(v, landing speed of |w|)
    w = sqrt(u² + s²) span (beta D gamma - gamma/kappa D beta) D h / (span D gamma)

The last factor is 1 but for a robot that others wait for, just as their gate opens; so w = u where
no obstacle acts. Where one does, a robot takes at most a quarter of the gap in a tick, so that
Euler steps stay in W - Δ as the flow does, if in a tick no two robots close in by reach - touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.support.arrays import Array, Index, Truth
from factory.theory.control.mode import Limits, Mode, lock
from factory.theory.control.obstacles import Gates, Pairs, ranges
from factory.theory.control.profile import landing_speed

KAPPA = 4.0
"""Any positive value does where `Mode.trapped` is empty; the greater, the nearer to them do
obstacles act."""


@dataclass(frozen=True, slots=True, eq=False)
class _Terms:
    """What phi is made of at one x.

    Per robot: `root` sqrt(u² + s²) [m], `pull` D h, `opening` the rest of span D gamma (from the
    robots that wait for this one), and `push` D beta [1/m]. Per mode: `way` span gamma [m], `beta`.
    """

    root: Array
    pull: Array
    opening: Array
    way: Array
    beta: Array
    push: Array


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """All active modes, concatenated: a configuration x (n,) has the robots of the first mode
    first, in the mode's order. No call loops over robots or modes; arrays are made once, by `of`.

    Attributes:
        modes: the modes.
        starts: the number of each mode's first robot (modes,).
        sizes: the number of its robots (modes,).
        owner: the mode of each robot (n,).
        goal: goals (n,) [m].
        lower, upper: the bounds of the domains (n,) [m].
        eps: radius of the goal ball of the robot's mode (n,) [m].
        softness: s of the robot's mode (n,) [m].
        speed: speed limits (n,) [m/s].
        acceleration: acceleration limits (n,) [m/s²].
        span: length of each mode's way (modes,) [m].
        dwell: time that each mode stays in its goal (modes,) [s].
        gates: robots that others wait for (the L-shaped W).
        pairs: robots that must not touch each other (Δ).
        moving: 0 for robots of modes that only stand, 1 for others (n,); None where none
            stands.
        clocked: modes that rest in their goal balls until their clocks have run out, so that
            their ends are known (modes,); None for none.
        dwells: whether a clock has to run out in some mode.
    """

    modes: tuple[Mode, ...]
    starts: Index
    sizes: Index
    owner: Index
    goal: Array
    lower: Array
    upper: Array
    eps: Array
    softness: Array
    speed: Array
    acceleration: Array
    span: Array
    dwell: Array
    gates: Gates
    pairs: Pairs
    moving: Array | None
    clocked: Truth | None = None
    dwells: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "dwells", bool((self.dwell > 0.0).any()))

    @classmethod
    def of(cls, modes: Sequence[Mode], limits: Sequence[Limits]) -> Bundle:
        """The bundle of `modes`, each with the limits of its robots.

        Raises ValueError where a mode has other than one speed and acceleration a robot.
        """
        for number, (mode, limit) in enumerate(zip(modes, limits, strict=True)):
            if mode.size != limit.speed.size:
                raise ValueError(f"mode {number}: {limit.speed.size} limits, {mode.size} robots")
        sizes = np.array([mode.size for mode in modes], np.intp)
        starts = np.cumsum(sizes) - sizes
        still = np.array([mode.is_still for mode in modes], bool)
        return cls(
            tuple(modes),
            starts,
            sizes,
            np.repeat(np.arange(len(modes)), sizes),
            _joined([mode.goals for mode in modes]),
            _joined([mode.lower for mode in modes]),
            _joined([mode.upper for mode in modes]),
            np.repeat(_joined([[mode.eps for mode in modes]]), sizes),
            np.repeat(_joined([[mode.softness for mode in modes]]), sizes),
            _joined([limit.speed for limit in limits]),
            _joined([limit.acceleration for limit in limits]),
            _joined([[mode.span for mode in modes]]),
            _joined([[mode.dwell for mode in modes]]),
            Gates.of(modes, starts),
            Pairs.of(modes, starts),
            np.repeat(np.where(still, 0.0, 1.0), sizes) if still.any() else None,
        )

    def select(self, numbers: Sequence[int]) -> Bundle:
        """The bundle of some of the modes, by number and in that order."""
        chosen = np.array(numbers, np.intp)
        sizes = self.sizes[chosen]
        starts = np.cumsum(sizes) - sizes
        robots = ranges(self.starts[chosen], sizes)
        shift = starts - self.starts[chosen]
        return Bundle(
            tuple(self.modes[n] for n in numbers),
            starts,
            sizes,
            np.repeat(np.arange(len(chosen)), sizes),
            self.goal[robots],
            self.lower[robots],
            self.upper[robots],
            self.eps[robots],
            self.softness[robots],
            self.speed[robots],
            self.acceleration[robots],
            self.span[chosen],
            self.dwell[chosen],
            self.gates.select(chosen, shift),
            self.pairs.select(chosen, shift),
            None if self.moving is None else self.moving[robots],
        )

    def field(self, x: Array, dt: float) -> Array:
        """F (n,) [m/s] for a world of ticks dt [s]; dt shapes only the landing in the goal.

        Where no obstacle acts each robot makes for goal + tau at its speed limit, or the greatest
        speed from which it lands there exactly, braking by at most a·dt a tick.
        """
        if self.pairs.touch.size and (self.pairs.apart(x) < self.pairs.reach).any():
            return self._field_near_obstacles(x, dt)
        offset = self._offset(x)
        speed = landing_speed(np.abs(offset), self.acceleration, dt)
        np.minimum(speed, self.speed, out=speed)
        return np.copysign(speed, np.negative(offset, out=offset), out=speed)

    def at_goal(self, x: Array) -> Truth:
        """Whether each mode's robots are all in its goal ball (modes,); the clock apart."""
        return np.logical_and.reduceat(np.abs(x - self.goal) < self.eps, self.starts)

    def in_domain(self, x: Array) -> Truth:
        """Whether each mode is in W - Δ (modes,): no two robots touching, every robot on its
        guidepath and no nearer to its goal than its gate allows, both to within eps."""
        inside = (x >= self.lower - self.eps) & (x <= self.upper + self.eps)
        if (gated := self.gates.robot).size:
            inside[gated] &= self._offset(x)[gated] >= -self.eps[gated]
        touching = self.pairs.mode[self.pairs.apart(x) <= self.pairs.touch]
        within = np.logical_and.reduceat(inside, self.starts)
        within[touching] = False
        return within

    def near_goal(self, x: Array, within: float, slow: Truth | None = None) -> bool:
        """Whether any mode's robots are all that near to its goal ball [m]; and all of those that
        are `slow` (n,), but where time in the ball counts. Modes that are clocked are left out."""
        near = np.abs(x - self.goal) < self.eps + within
        if slow is not None:
            near &= slow | (self.dwell > 0.0)[self.owner]
        modes = np.logical_and.reduceat(near, self.starts)
        return bool((modes if self.clocked is None else modes & ~self.clocked).any())

    def finished(self, there: Truth, clock: Array) -> Truth:
        """Whether each mode's (x, clock) is in its goal G_p (modes,): x is `there`, in the goal
        ball, and its clock, which has rate 1 there and else 0, has run out; to a nanosecond."""
        return np.asarray(there & (clock >= self.dwell - 1e-9))

    def _offset(self, x: Array) -> Array:
        """u (n,): the offset of each robot from where it may go now."""
        offset = x - self.goal
        if self.gates.robot.size:
            offset[self.gates.robot] -= self.gates.closed(offset)
        if self.moving is not None:
            offset *= self.moving
        return offset

    def _terms(self, x: Array) -> _Terms:
        gates, modes = self.gates, len(self.modes)
        offset = self._offset(x)
        root = np.hypot(offset, self.softness)
        pull = offset / root
        straight = x - self.goal
        opening = np.zeros(x.size)
        np.add.at(opening, gates.gate, gates.slope(straight) * (1.0 - pull[gates.robot]))
        way = np.add.reduceat(offset * offset / (root + self.softness), self.starts)
        np.add.at(way, gates.mode, gates.closed(straight))
        beta, push = self.pairs.product(x, modes)
        return _Terms(root, pull, opening, way, beta, push)

    def _field_near_obstacles(self, x: Array, dt: float) -> Array:
        terms = self._terms(x)
        waited_for = terms.opening != 0.0
        share = np.ones_like(x)
        np.divide(terms.pull, terms.pull + terms.opening, out=share, where=waited_for)
        push = terms.push * share * (terms.way / KAPPA)[self.owner]
        virtual = terms.root * (terms.pull * terms.beta[self.owner] - push)
        speed = np.minimum(landing_speed(np.abs(virtual), self.acceleration, dt), self.speed)
        speed = np.minimum(speed, self.pairs.room(x) / (4 * dt))
        back, ahead = np.minimum(self.lower - x, 0.0), np.maximum(self.upper - x, 0.0)
        return np.clip(np.copysign(speed, -virtual), back / dt, ahead / dt)


def _joined(parts: Sequence[Array] | Sequence[Sequence[float]]) -> Array:
    return np.asarray(lock(np.concatenate([np.empty(0), *parts])), np.float64)
