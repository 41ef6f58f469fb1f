"""Courses: the references of axes for a number of ticks, planned ahead.

Within a course a reference depends on no measurement, so it is planned once and then followed, in
one call of the engine or tick by tick, with the same result. A course ends where a gate would open,
and in the next the gate stays closed if its robot is off its reference (`Motion`): what waits at a
gate waits for the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import inf

import numpy as np

from factory.engine.simulation.mujoco.drives import Drives
from factory.support.arrays import Array, Index
from factory.theory.control.governor import follow
from factory.theory.control.mode import REST, ROUNDING
from factory.theory.control.navigation import Bundle
from factory.theory.nets.coordinated import Past

AHEAD = 0.0005
"""No robot is further off its reference than this [m], if nothing disturbs it."""

FASTER = 0.8
"""No robot is slower than this share of its reference, half a timestep ago: the engine's speeds lag
its positions by so much."""

Move = tuple[Array, Array, Array, bool]
"""A tick of n axes: the positions [m] and speeds [m/s] it leads to, its accelerations [m/s²], and
whether some axis may be at its goal then."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The references of n axes for some ticks ahead.

    Attributes:
        x: positions at the ends of ticks (ticks + 1, n) [m].
        v: speeds there (ticks + 1, n) [m/s].
        setpoints: of their drives (n, samples, 3).
        near: whether it ends near a goal; before its end it never is.
    """

    x: Array
    v: Array
    setpoints: Array
    near: bool

    @property
    def ticks(self) -> int:
        """Its number of ticks."""
        return len(self.x) - 1


def planned(
    drives: Drives,
    axes: Index,
    begin: tuple[Array, Array],
    ticks: tuple[int, int],
    go: Callable[[Array, Array], Move],
) -> Course:
    """The course of axes from positions [m] and speeds [m/s], where `go` advances a tick: for
    `ticks[0]` ticks of `ticks[1]` timesteps, or until something is near its goal."""
    most, steps = ticks
    xs, vs, accelerations, near = [begin[0]], [begin[1]], list[Array](), False
    while len(accelerations) < most and not near:
        x, v, a, near = go(xs[-1], vs[-1])
        xs.append(x)
        vs.append(v)
        accelerations.append(a)
    x, v, a = np.array(xs), np.array(vs), np.array(accelerations)
    setpoints = drives.sampled(axes, x, v, a, steps)
    return Course(x, v, setpoints, near)


def along(bundle: Bundle, tick: float, timestep: float) -> Callable[[Array, Array], Move]:
    """The function that advances the modes of a bundle by a tick [s] of timesteps [s]: the field
    F_p under the limits of its robots."""

    def go(x: Array, v: Array) -> Move:
        x1, v1, a = follow(bundle, x, v, tick)
        v1[np.abs(v1) < ROUNDING] = 0.0
        slow = FASTER * np.abs(v1 - timestep / 2 * a) < REST
        opens = bundle.gates.opens(x - bundle.goal, x1 - bundle.goal)
        return x1, v1, a, opens or bundle.near_goal(x1, AHEAD, slow)

    return go


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Points that axes come past.

    Attributes:
        axes: which axes (n,).
        at: where, on the way of each (n,) [m].
        direction: +1 where an axis comes to larger positions, -1 to smaller ones (n,).
    """

    axes: Index
    at: Array
    direction: Array

    @classmethod
    def of(cls, passes: Collection[Past]) -> Points:
        """Those of some passes."""
        axes, at, direction = zip(*((p.axis, p.at, p.direction) for p in passes), strict=True)
        return cls(np.array(axes, np.intp), np.array(at), np.array(direction))

    def chosen(self, numbers: Index) -> Points:
        """Some of them."""
        return Points(self.axes[numbers], self.at[numbers], self.direction[numbers])


class Follower:
    """The axes that follow a course; `x` [m] and `v` [m/s] (axes,): the references of all axes."""

    def __init__(self, x: Array, v: Array, drives: Drives, substeps: int) -> None:
        self.x, self.v, self._drives, self._substeps = x, v, drives, substeps
        self.axes: Index = np.empty(0, np.intp)
        self._slot = np.full(len(x), -1)
        self.course: Course | None = None
        self._at = 0

    @property
    def left(self) -> int:
        """Remaining ticks of the course."""
        return 0 if self.course is None else self.course.ticks - self._at

    @property
    def over(self) -> bool:
        """Whether the course is over."""
        return self.course is not None and not self.left

    @property
    def near(self) -> bool:
        """Whether the course is over, near a goal."""
        return self.course is not None and self.over and self.course.near

    def until(self, points: Points) -> float:
        """Remaining ticks until an axis may have come past its point; inf if none does in the
        course."""
        if self.course is None:
            return inf
        slots = self._slot[points.axes]
        left = (points.at - self.course.x[self._at :, slots]) * points.direction
        there = ((left <= AHEAD) & (slots >= 0)).any(axis=1)
        return float(there.argmax()) if there.any() else inf

    def begin(self, axes: Index, course: Course) -> None:
        """Start a course of axes."""
        self.axes, self.course, self._at = axes, course, 0
        self._slot[:] = -1
        self._slot[axes] = np.arange(len(axes))
        self._drives.follow(axes, course.setpoints)

    def show(self, ticks: int) -> None:
        """Advance the references by some ticks of the course."""
        course = self.course
        assert course is not None
        self._at += ticks
        self.x[self.axes], self.v[self.axes] = course.x[self._at], course.v[self._at]
        self._drives.show(self.axes, course.setpoints[:, self._at * self._substeps])

    def stop(self, axes: Index) -> None:
        """Let axes stand at their references and leave the course."""
        self.v[axes] = 0.0
        self._drives.stand(axes, self.x[axes])
        self.course = None
