"""Courses: what the references of axes do for some ticks, planned ahead.

A reference depends on nothing that is measured, so a course is planned once and then followed, in
one call of the engine or tick by tick: the run is the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from factory.control.governor import follow
from factory.control.mode import REST, ROUNDING, Array, Index
from factory.control.navigation import Bundle
from factory.nets.coordinated import Past
from factory.simulation.mujoco.drives import Drives

AHEAD = 0.0005
"""No robot is further ahead of its reference than this [m]."""

FASTER = 0.8
"""No robot is slower than this share of its reference, half a timestep ago: the engine's speeds lag
its positions by so much."""

Move = tuple[Array, Array, Array, bool]
"""A tick of n axes: the positions [m] and speeds [m/s] it leads to, its accelerations [m/s²], and
whether some axis may be at its goal then."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What the references of n axes do: positions `x` [m] and speeds `v` [m/s] (ticks + 1, n) at
    the ends of its ticks; the `setpoints` (n, samples, 3) of their drives; whether it ends `near` a
    goal. It comes near one at its end only."""

    x: Array
    v: Array
    setpoints: Array
    near: bool

    @property
    def ticks(self) -> int:
        """How many ticks it takes."""
        return len(self.x) - 1


def planned(
    drives: Drives,
    axes: Index,
    begin: tuple[Array, Array],
    ticks: tuple[int, int],
    go: Callable[[Array, Array], Move],
) -> Course:
    """The course of axes from positions [m] and speeds [m/s], where `go` says what a tick does: for
    `ticks[0]` ticks of `ticks[1]` timesteps each, or until something is near its goal."""
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
    """A tick [s] of the modes of a bundle, of timesteps [s]: the field F_p under the limits of its
    robots."""

    def go(x: Array, v: Array) -> Move:
        x1, v1, a = follow(bundle, x, v, tick)
        v1[np.abs(v1) < ROUNDING] = 0.0
        slow = FASTER * np.abs(v1 - timestep / 2 * a) < REST
        return x1, v1, a, bool(bundle.near_goal(x1, AHEAD, slow))

    return go


class Follower:
    """Some axes of a factory and the course they follow; `x` [m] and `v` [m/s] (axes,) are the
    references of all axes, of which it keeps its own."""

    def __init__(self, x: Array, v: Array, drives: Drives, substeps: int) -> None:
        self.x, self.v, self._drives, self._substeps = x, v, drives, substeps
        self.axes: Index = np.empty(0, np.intp)
        self.course: Course | None = None
        self._at = 0

    @property
    def left(self) -> int:
        """Ticks of the course that are still to come."""
        return 0 if self.course is None else self.course.ticks - self._at

    @property
    def over(self) -> bool:
        """Whether a course is over."""
        return self.course is not None and not self.left

    @property
    def near(self) -> bool:
        """Whether the course is over, near a goal."""
        return self.course is not None and self.over and self.course.near

    def until(self, past: Past) -> int:
        """How many ticks of the course are to come until a reference may be past a point; all that
        are left where it never is."""
        if self.course is None or past.axis not in self.axes:
            return self.left
        slot = int(np.flatnonzero(self.axes == past.axis)[0])
        left = (past.at - self.course.x[self._at :, slot]) * past.direction
        there = left <= AHEAD
        return int(there.argmax()) if there.any() else self.left

    def begin(self, axes: Index, course: Course) -> None:
        """Let axes follow a course from now on."""
        self.axes, self.course, self._at = axes, course, 0
        self._drives.follow(axes, course.setpoints)

    def show(self, ticks: int) -> None:
        """Some ticks of the course are about to pass: the references are where they lead to."""
        course = self.course
        assert course is not None
        self._at += ticks
        self.x[self.axes], self.v[self.axes] = course.x[self._at], course.v[self._at]
        self._drives.show(self.axes, course.setpoints[:, self._at * self._substeps])

    def stop(self, axes: Index) -> None:
        """Let axes stand where their references are, and leave the course."""
        self.v[axes] = 0.0
        self._drives.stand(axes, self.x[axes])
        self.course = None
