"""Modes: the control law F_p of one operation with its domain and goal, in arc length (paper,
sections 3.1, 4.3 and 6), and the limits of the robots it moves.

A robot's position is the arc length [m] of its carriage on its own guidepath [A, B].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from factory.support.arrays import Array, Index

REACH = 1.5
"""An obstacle of Δ acts on robots up to this many times the touching distance apart."""

REST = 0.01
"""Robots hand over only when slower than this [m/s]."""

STILL = 0.99 * REST
"""What is asked of a robot then [m/s]: its payload, on a weld, may go a little faster."""

ROUNDING = 1e-9
"""Lengths [m] closer than this are the same."""

SOFTNESS = 100.0
"""Distance to the goal [eps] beyond which gamma grows linearly, no longer as a square."""


def lock(values: ArrayLike, kind: type[np.number[Any]] = np.float64) -> NDArray[Any]:
    """A read-only copy of `values`, numbers of a kind."""
    array = np.array(values, kind)
    array.setflags(write=False)
    return array


def _floats() -> Array:
    return np.empty(0)


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """The limits of k robots.

    Attributes:
        speed: v [m/s] (k,).
        acceleration: a [m/s²] (k,).

    Raises ValueError where a limit is missing, not finite or not positive.
    """

    speed: Array
    acceleration: Array

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, lock(np.atleast_1d(getattr(self, name))))
            values = getattr(self, name)
            if not (np.isfinite(values) & (values > 0)).all():
                raise ValueError(f"{name} limits {values} are not all positive and finite")
        if self.speed.shape != self.acceleration.shape:
            raise ValueError(f"{self.speed.size} speeds for {self.acceleration.size} accelerations")

    def of(self, robots: Sequence[int]) -> Limits:
        """Those of some of the robots, in that order."""
        chosen = list(robots)
        return Limits(self.speed[chosen], self.acceleration[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """Controlled dynamics F_p with domain D_p = W - Δ and goal G_p (Definition 3.2), for k robots
    on intervals. G_p is the open ball of radius eps about the goals in the maximum norm.

    Attributes:
        goals: goal of each robot [m] (k,).
        lower: A, the lower end of the interval of each robot [m] (k,).
        upper: B, the upper end [m] (k,).
        eps: radius of the goal ball [m].
        pairs: robots i, j whose guidepaths meet (m, 2).
        meet: the coordinates at which they meet, on i's and on j's [m] (m, 2).
        touch: distance in the tree that ~ makes of the guidepaths at which they touch [m] (m,).
        gate: the robot that must be in its goal ball before this one comes nearer to its own goal
            than `standoff` on the side of B (k,); -1 for none.
        standoff: that distance [m] (k,).
        dwell: time in the ball after which the goal is reached [s]: a clock of rate 1 inside, 0
            elsewhere.
        reach: derived: distance up to which a pair repels [m] (m,).
        order: derived: the robots, each after its gate.

    The configuration is in Δ where |x_i - meet_i| + |x_j - meet_j| <= touch. W is L-shaped: x_gate
    not at its goal implies x >= goal + standoff. Pairs, gates and what goes with them may be left
    out.

    Raises ValueError where the values describe no mode, or its goal lies in Δ.
    """

    REST: ClassVar[float] = REST
    STILL: ClassVar[float] = STILL
    ROUNDING: ClassVar[float] = ROUNDING

    goals: Array
    lower: Array
    upper: Array
    eps: float
    pairs: Index = field(default_factory=lambda: np.empty((0, 2), np.intp))
    meet: Array = field(default_factory=_floats)
    touch: Array = field(default_factory=_floats)
    gate: Index = field(default_factory=lambda: np.empty(0, np.intp))
    standoff: Array = field(default_factory=_floats)
    dwell: float = 0.0
    reach: Array = field(init=False, repr=False)
    order: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = np.size(self.goals)
        ungated = np.size(self.gate) == 0
        shaped = {
            "goals": (self.goals, (count,)),
            "lower": (self.lower, (count,)),
            "upper": (self.upper, (count,)),
            "meet": (self.meet, (-1, 2)),
            "touch": (self.touch, (-1,)),
            "standoff": (np.zeros(count) if ungated else self.standoff, (count,)),
        }
        for name, (values, shape) in shaped.items():
            object.__setattr__(self, name, lock(_shaped(name, values, shape)))
        gate = np.full(count, -1) if ungated else self.gate
        object.__setattr__(self, "gate", lock(_shaped("gate", gate, (count,)), np.intp))
        object.__setattr__(self, "pairs", lock(_shaped("pairs", self.pairs, (-1, 2)), np.intp))
        _check_robots(self)
        object.__setattr__(self, "order", _ordered(self.gate))
        _check_pairs(self)
        object.__setattr__(self, "reach", lock(_reach(self)))

    @classmethod
    def still(cls, count: int) -> Mode:
        """`wait` and `hold`: F = 0, the domain and the goal are everything."""
        endless = np.full(count, np.inf)
        return cls(np.zeros(count), -endless, endless, np.inf)

    @property
    def is_still(self) -> bool:
        """Whether F = 0 and every configuration is a goal."""
        return bool(np.isinf(self.eps))

    @property
    def size(self) -> int:
        """k, the number of robots."""
        return int(self.goals.size)

    @property
    def softness(self) -> float:
        """s, the distance to a goal [m] where gamma turns from a square to a length."""
        return 1.0 if self.is_still else SOFTNESS * self.eps

    @property
    def span(self) -> float:
        """A length [m] that the distance to the goal never exceeds in W: the unit of gamma."""
        if self.is_still:
            return 1.0
        return float(np.sum(self.upper - self.lower) + np.sum(self.standoff)) + self.eps

    @property
    def trapped(self) -> tuple[tuple[int, int], ...]:
        """Pairs that may hold each other up for ever from some start in W - Δ.

        Where there are none the goal is the only critical point of phi in W - Δ (see `clearance`);
        a factory may still use a mode with some, from starts that are `clear_from`.
        """
        doubtful = clearance(self) <= self.touch
        return tuple((int(i), int(j)) for i, j in self.pairs[doubtful])

    def clear_from(self, start: Array) -> bool:
        """Whether every robot goes straight from `start` to its goal: wherever between the two
        each of them is, no pair comes within its reach, whatever the speeds."""
        low = np.minimum(start, self.goals)[self.pairs]
        high = np.maximum(start, self.goals)[self.pairs]
        nearest = np.clip(self.meet, low, high)
        return bool((np.abs(nearest - self.meet).sum(axis=1) >= self.reach).all())


def steady(mode: Mode) -> tuple[Array, Array]:
    """For each place in `mode.pairs`: 1.0 where that robot is steady, else 0.0; and its side.

    A robot is steady when Δ pushes it one way only: all its meeting points lie at, or beyond, the A
    end of its interval (side +1) or all at its B end (side -1). Where both are so, it is a point.
    """
    above = np.ones(mode.size, dtype=bool)
    below = np.ones(mode.size, dtype=bool)
    np.logical_and.at(above, mode.pairs, mode.meet <= mode.lower[mode.pairs])
    np.logical_and.at(below, mode.pairs, mode.meet >= mode.upper[mode.pairs])
    side = np.where(above, 1.0, -1.0)[mode.pairs]
    return (above | below)[mode.pairs].astype(np.float64), side


def clearance(mode: Mode) -> Array:
    """How far (m,) [m] each pair is apart at the least once its steady robots have reached, or
    passed, their goals.

    Theorem: if every clearance is at least the pair's reach, phi has no critical point in W - Δ but
    the goal. For at one, each steady robot that Δ pushes is balanced by gamma, so it is beyond its
    goal on the side it is pushed to, and every other steady robot is at its goal; so each pair is
    at least its clearance apart, no obstacle acts, and all robots are at their goals. The stops A
    and B change nothing: a steady robot pushed against one is beyond its goal as well.
    """
    certain, side = steady(mode)
    return np.asarray((certain * side * (mode.goals[mode.pairs] - mode.meet)).sum(axis=1))


def _reach(mode: Mode) -> Array:
    """REACH * touch, or less, so that the obstacle does not act on robots at their goals."""
    apart = np.abs(mode.goals[mode.pairs] - mode.meet).sum(axis=1)
    proved = clearance(mode)
    return np.minimum(REACH * mode.touch, np.where(proved > mode.touch, proved, apart))


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        return np.reshape(np.asarray(values, np.float64), shape)
    except ValueError as error:
        raise ValueError(f"{name} of shape {np.shape(values)}, expected {shape}") from error


def _check_robots(mode: Mode) -> None:
    """Goals inside the intervals, a ball of some size, gates and pairs among the robots."""
    if not mode.size or not mode.eps > 0 or not mode.dwell >= 0:
        raise ValueError(f"{mode.size} robots, eps {mode.eps}, dwell {mode.dwell}")
    last = mode.goals + mode.standoff
    within = (mode.lower - ROUNDING <= mode.goals) & (last <= mode.upper + ROUNDING)
    outside = ~(within & (mode.standoff >= 0))
    if outside.any():
        i = int(np.argmax(outside))
        raise ValueError(
            f"robot {i + 1}: goal {mode.goals[i]:g} with standoff {mode.standoff[i]:g} is not"
            f" inside [{mode.lower[i]:g}, {mode.upper[i]:g}]"
        )
    for name, robots, least in (("gate", mode.gate, -1), ("pairs", mode.pairs, 0)):
        if ((robots < least) | (robots >= mode.size)).any():
            raise ValueError(f"{name} {robots.tolist()}: there are {mode.size} robots")
    if not len(mode.pairs) == len(mode.meet) == len(mode.touch):
        raise ValueError(f"{len(mode.pairs)} pairs, {len(mode.meet)} meet, {len(mode.touch)} touch")


def _ordered(gate: Index) -> tuple[int, ...]:
    """The robots, each after its gate. Raises ValueError where gates wait for each other."""
    ready: list[int] = []
    waiting = list(range(gate.size))
    while waiting:
        free = [i for i in waiting if gate[i] < 0 or int(gate[i]) in ready]
        if not free:
            robots = [i + 1 for i in waiting]
            raise ValueError(f"robots {robots} wait for each other: gate {gate.tolist()}")
        ready += free
        waiting = [i for i in waiting if i not in free]
    return tuple(ready)


def _check_pairs(mode: Mode) -> None:
    """The goal ball lies outside Δ; Δ does not push a gated robot past its standoff."""
    apart = np.abs(mode.goals[mode.pairs] - mode.meet).sum(axis=1)
    for (i, j), gap in zip(mode.pairs.tolist(), (apart - mode.touch).tolist(), strict=True):
        if i == j or gap <= 2 * mode.eps:
            raise ValueError(
                f"robots {i + 1} and {j + 1} at their goals touch: {gap:g} m apart, the goal ball"
                f" needs more than {2 * mode.eps:g}"
            )
    unsafe = (mode.gate[mode.pairs] >= 0) & (mode.meet > mode.lower[mode.pairs])
    if unsafe.any():
        i = int(mode.pairs[unsafe][0])
        raise ValueError(f"robot {i + 1} waits for a gate, so others may meet it at its A end only")
