"""The table of an arm's joints along the legs of its cycle, which its controller follows.

A leg is gone from rest to rest at the speed and acceleration of all robots, without a stop. The
curve of the table is the one that is certified.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from factory.api import Layout, Operation, Pace, names
from factory.apps.arms.joint_way import JointWay
from factory.support.arrays import Array

if TYPE_CHECKING:  # formats are listed where the engine is not installed, too
    from factory.apps.arms.cell import CellChains

STEP = 0.008
"""Time between two rows [s]."""

DIGITS = 12
"""Decimals of joint values and coordinates."""


@dataclass(frozen=True, eq=False)
class JointLeg:
    """A leg of an arm's cycle.

    Attributes:
        layout: of the cell.
        robot: the arm (index).
        operation: in which the arm follows it.
    """

    layout: Layout
    robot: int
    operation: Operation

    @property
    def chains(self) -> CellChains:
        """The arms."""
        return cast("CellChains", self.layout.chains)

    @property
    def row(self) -> int:
        """Its row among the curves."""
        return self.chains.row(self.operation.index, self.robot)

    @property
    def way(self) -> JointWay:
        """Its curve, in the order of the motion."""
        return self.chains.curves.legs[self.row].way

    @property
    def brings(self) -> bool:
        """Whether the arm brings a part on it."""
        return self.chains.curves.legs[self.row].brings

    @property
    def ends(self) -> tuple[float, float]:
        """The coordinates of the arm's axis where it begins and ends [m]."""
        before, after = self.layout.ways[self.operation.index, self.robot]
        return before.at, after.at

    def at(self, x: Array) -> Array:
        """Configurations (m, n) at coordinates of the axis (m,) [m; rad]."""
        row = np.array([self.row])
        return self.chains.curves.at(row, x[:, None])[0][:, 0]

    def samples(self, pace: Pace) -> tuple[Array, Array, Array]:
        """Times (m,) [s] every STEP and at the end, coordinates (m,) [m] and configurations (m, n)
        [rad]."""
        begin, end = self.ends
        length = abs(end - begin)
        time = np.append(np.arange(0.0, pace.rest(length) - 1e-9, STEP), pace.rest(length))
        gone = np.array([pace.gone(length, t)[0] for t in time.tolist()])
        x = begin + np.copysign(gone, end - begin)
        return time, x, self.at(x)


def legs_of(layout: Layout, robot: int) -> list[JointLeg]:
    """The legs of an arm (index), in the order of its program."""
    operations = layout.factory.robots[robot].operations
    return [JointLeg(layout, robot, layout.factory.operations[number]) for number in operations]


def joint_table(layout: Layout, robot: int, pace: Pace) -> str:
    """The table as CSV: leg, t [s], x [m], and each joint [rad]. A leg is named by what its
    operation makes: a part that is fetched, or what a part is placed on.

    Args:
        layout: of a cell.
        robot: the arm (index).
        pace: speed and acceleration of robots.
    """
    return "\n".join(_lines(layout, robot, pace)) + "\n"


def _lines(layout: Layout, robot: int, pace: Pace) -> Iterator[str]:
    joints = [joint for joint, _ in names.moved_along(layout.factory.robots[robot])]
    yield ",".join(("leg", "t", "x", *joints))
    for leg in legs_of(layout, robot):
        for t, x, q in zip(*leg.samples(pace), strict=True):
            values = ",".join(f"{value:.{DIGITS}f}" for value in (x, *q))
            yield f"{leg.operation.label},{t:.6f},{values}"
