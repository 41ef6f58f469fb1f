"""Plans the legs of the arms of a cell: how each holds its parts, in which configurations it takes
and places them, and its ways between these."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from factory.api import Array, Diagnostic, Index, Layout, RunError, mujoco
from factory.apps.arms.arming import RAILS
from factory.apps.arms.arrangement import CARRIER, Arrangement, feeder_name, placed_name
from factory.apps.arms.body import standing
from factory.apps.arms.cell import ToolGrip, down
from factory.apps.arms.circuit import candidates, circuit
from factory.apps.arms.inverse import retreat, straight_line
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.legs import NoWay, leg
from factory.apps.arms.reach import diagnose_reach
from factory.apps.arms.scene import NEED, Scene

YAWS = 8
"""Number of angles at which a part may be held."""

AT_END = 0.001
"""Clearance of an arm's links on its straight ends [m]."""

VISITED = 0.002
"""Clearance that is asked of configurations in which parts are taken and placed [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmTour:
    """How an arm brings a part.

    Attributes:
        label: the part.
        grip: how it is held.
        goes: the way on which the arm comes to take it.
        brings: the way on which the arm brings it.
    """

    label: str
    grip: ToolGrip
    goes: JointWay
    brings: JointWay


class ArmPlanner:
    """Plans the legs of one arm.

    Args:
        cell: where things stand.
        arm: the arm (index).
        file: its MJCF.
        bare: the layout without legs.
        pace: limits of the coordinate along its ways.
    """

    def __init__(
        self, cell: Arrangement, arm: int, file: Path, bare: Layout, pace: WayLimits
    ) -> None:
        self.cell, self.arm, self.chain, self.pace = cell, arm, cell.chain, pace
        self.name, self.labels = cell.factory.robots[arm].name, cell.labels(arm)
        loads = {label: cell.loads(label) for label in self.labels}
        stand = cell.stands[arm]
        self.scene = Scene(standing(file, stand), "", loads, [*cell.obstacles(arm, bare)])
        m = self.scene.m
        self._held = {
            label: [(m.geom_pos[g].copy(), m.geom_quat[g].copy()) for g in geoms]
            for label, geoms in self.scene.loads.items()
        }

    def tours(self) -> list[ArmTour]:
        """The tours of the arm, in the order of its program. Raises RunError (Unreachable,
        NoWay)."""
        cell, visits, tours = self.cell, self._visits(), list[ArmTour]()
        for number, label in enumerate(self.labels):
            yaw, taken, placed = visits[number]
            before, (_, _, left) = self.labels[number - 1], visits[number - 1]
            out = self._line(left, cell.leaves(before), before)
            over = self._line(taken, cell.over_well, label)
            goes = self._leg(out, over[::-1], "", before, label)
            self._hold(label, yaw)
            into = self._line(placed, cell.rises(label), label)
            brings = self._leg(over, into[::-1], label, label, label)
            tours.append(ArmTour(label, ToolGrip(cell.tip[label], yaw), goes, brings))
        return tours

    def _hold(self, label: str, yaw: float) -> None:
        """Hold a part with the tool at an angle [rad]."""
        m, turn = self.scene.m, np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
        rotation, held = np.empty(9), np.empty(4)
        mujoco.mju_quat2Mat(rotation, turn)
        for geom, (place, quaternion) in zip(
            self.scene.loads[label], self._held[label], strict=True
        ):
            m.geom_pos[geom] = rotation.reshape(3, 3) @ place
            mujoco.mju_mulQuat(held, turn, quaternion)
            m.geom_quat[geom] = held

    def _visits(self) -> list[tuple[float, Array, Array]]:
        """For each part the angle of the tool, and the configurations in which it is taken and
        placed."""
        angles = np.arange(YAWS) * 2 * pi / YAWS
        options, yaws = list[Array](), list[Array]()
        for label in self.labels:
            pairs, grips = self._options(label, angles)
            options.append(pairs)
            yaws.append(angles[grips])
        chosen = circuit(options, self.chain.limits.speed)
        return [
            (float(yaws[k][n]), options[k][n, 0], options[k][n, 1]) for k, n in enumerate(chosen)
        ]

    def _options(self, label: str, angles: Array) -> tuple[Array, Index]:
        cell = self.cell
        turns = np.array([down(float(a) - cell.stands[self.arm].yaw) for a in angles])
        tip = cell.tip[label]
        shown, placed = (
            cell.local(self.arm, tip + off) for off in (cell.shown(label), cell.placed)
        )
        spared = {f"'{label}'", feeder_name(label), CARRIER, *self._later(label)}

        def clearance(q: Array) -> tuple[Array, Index]:
            return self.scene.margins(q, "", VISITED, spared)

        options = candidates(
            self.chain,
            (np.tile(shown, (len(angles), 1)), turns),
            (np.tile(placed, (len(angles), 1)), turns),
            clearance,
            np.zeros(len(self.chain)),
            cell.over_well,
        )
        if len(options.pairs):
            return options.pairs, options.grips
        raise RunError(self._unreachable(label, (shown, placed), turns[0], options.blocked))

    def _unreachable(
        self, label: str, places: tuple[Array, Array], turn: Array, blocked: NoWay | None
    ) -> Diagnostic:
        position = self.cell.factory.by_label[label].position
        for place in places:
            why = diagnose_reach(self.chain, place, turn)
            if why is not None:
                return Diagnostic("Unreachable", why.message(label, self.name), position, RAILS)
        by = f" and goes straight up by {self.cell.over_well * 1e3:.0f} mm at either end"
        if blocked:
            by = f": {self.scene.say(blocked.pair)} are in each other's way"
        message = f"{self.name} has no configuration that brings '{label}'{by}"
        return Diagnostic("Unreachable", message, position, RAILS)

    def _later(self, label: str) -> set[str]:
        """The parts in the product that are not there as one is placed, itself among them; all for
        none."""
        order = [self.cell.factory.first(0).label, *self._sequence]
        later = order[order.index(label) :] if label else order
        return {placed_name(one) for one in later}

    @property
    def _sequence(self) -> list[str]:
        """All parts that are placed, in that order."""
        factory = self.cell.factory
        return sorted(
            self.cell.arm_of, key=lambda one: factory.postorder[factory.by_label[one].index]
        )

    def _line(self, q: Array, length: float, label: str) -> Array:
        """Configurations along a straight line up from a visit (k, n)."""
        rows, good = straight_line(self.chain, q[None], retreat(self.chain, q[None]), length)
        if not good[0]:
            message = f"{self.name} cannot go straight up from '{label}' by {length * 1e3:.0f} mm"
            position = self.cell.factory.by_label[label].position
            raise RunError(Diagnostic("Unreachable", message, position, RAILS))
        return np.asarray(rows[0])

    def _leg(self, out: Array, into: Array, label: str, before: str, after: str) -> JointWay:
        every = self._later("")
        spared = {f"'{label}'", *every}
        ends = {f"'{label}'", CARRIER, f"'{after}'", feeder_name(after), *self._later(before)}
        way = leg(
            self.chain,
            out,
            into,
            lambda q: self.scene.margins(q, label, NEED, spared),
            lambda q: self.scene.margins(q, label, AT_END, ends, held=False),
            self.pace,
        )
        if isinstance(way, NoWay):
            message = (
                f"{self.name} finds no way from '{before}' to '{after}':"
                f" {self.scene.say(way.pair)} come {way.depth * 1e3:.1f} mm nearer to each"
                " other than they may"
            )
            position = self.cell.factory.by_label[after].position
            raise RunError(Diagnostic("NoWay", message, position, RAILS))
        return way
