"""Plans the legs of the arms of a cell: how each holds its parts, in which configurations it takes
and places them, and its ways between these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import pi

import numpy as np

from factory.api import Array, Diagnostic, Index, Layout, RunError, mujoco
from factory.apps.arms.arming import RAILS
from factory.apps.arms.arrangement import CARRIER, Arrangement, Rise, feeder_name, placed_name
from factory.apps.arms.body import STEM, standing
from factory.apps.arms.cell import ToolGrip, down
from factory.apps.arms.certifying import uncertified
from factory.apps.arms.chain import ConvexBody
from factory.apps.arms.circuit import candidates, circuit
from factory.apps.arms.inverse import retreat, straight_line
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.legs import NoWay, leg
from factory.apps.arms.model import ArmModel
from factory.apps.arms.reach import diagnose_reach
from factory.apps.arms.scene import NEED, Scene
from factory.apps.arms.sharing import SweptArm

YAWS = 8
"""Number of angles at which a part may be held."""

AT_END = 0.001
"""Clearance of an arm's links on its straight ends, at samples [m]."""

CERTAIN, CERTAIN_AT_END = 0.004, 2e-4
"""Clearance that is certified on transfers, and on straight ends [m]."""

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


@dataclass(frozen=True, slots=True, eq=False)
class StraightEnd:
    """A straight end of a way.

    Attributes:
        rows: configurations along it, from the visit (k, n) [rad, m].
        share: of it that is not rounded, from the visit.
    """

    rows: Array
    share: float


class ArmPlanner:
    """Plans the legs of one arm.

    Args:
        cell: where things stand.
        arm: the arm (index).
        model: its kind.
        bare: the layout without legs.
        pace: limits of the coordinate along its ways.
    """

    def __init__(
        self, cell: Arrangement, arm: int, model: ArmModel, bare: Layout, pace: WayLimits
    ) -> None:
        self.cell, self.arm, self.chain, self.pace = cell, arm, cell.chain, pace
        self.name, self.labels = cell.factory.robots[arm].name, cell.labels(arm)
        loads = {label: cell.loads(label) for label in self.labels}
        stand = cell.stands[arm]
        self.scene = Scene(model, standing(model, stand), loads, [*cell.obstacles(arm, bare)])
        m = self.scene.m
        self._held = {
            label: [(m.geom_pos[g].copy(), m.geom_quat[g].copy()) for g in geoms]
            for label, geoms in self.scene.loads.items()
        }

    @property
    def damping(self) -> Array:
        """That of the joints (n,) [N m s/rad, N s/m]."""
        return np.array(self.scene.m.dof_damping)

    def tours(self) -> list[ArmTour]:
        """The tours of the arm, in the order of its program. Raises RunError (Unreachable,
        NoWay)."""
        cell, visits, tours = self.cell, self._visits(), list[ArmTour]()
        for number, label in enumerate(self.labels):
            yaw, taken, placed = visits[number]
            before, (_, _, left) = self.labels[number - 1], visits[number - 1]
            out = self._line(left, cell.leaves(before), before)
            over = self._line(taken, cell.over_well, label)
            goes = self._leg(out, over, "", before, label)
            self._hold(label, yaw)
            into = self._line(placed, cell.rises(label), label)
            brings = self._leg(over, into, label, label, label)
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
            cell.over_well.length,
        )
        if len(options.pairs):
            return options.pairs, options.grips
        raise RunError(self._unreachable(label, (shown, placed), turns[0], options.blocked))

    def _unreachable(
        self, label: str, places: tuple[Array, Array], turn: Array, blocked: NoWay | None
    ) -> Diagnostic:
        position = self.cell.factory.by_label[label].position
        for up in (0.0, self.cell.over_well.length):
            for place in places:
                why = diagnose_reach(self.chain, place + np.array([0.0, 0.0, up]), turn)
                if why is not None:
                    message = why.message(label, self.name, up)
                    return Diagnostic("Unreachable", message, position, RAILS)
        message = f"{self.name} has no configuration that brings '{label}'"
        if blocked:
            message += f": {self.scene.say(blocked.pair)} are in each other's way"
        else:
            message += f" and goes straight up by {up * 1e3:.0f} mm at both ends"
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

    def _line(self, q: Array, rise: Rise, label: str) -> StraightEnd:
        """The straight line up from a visit."""
        length = rise.length
        rows, good = straight_line(self.chain, q[None], retreat(self.chain, q[None]), length)
        if not good[0]:
            message = f"{self.name} cannot go straight up from '{label}' by {length * 1e3:.0f} mm"
            position = self.cell.factory.by_label[label].position
            raise RunError(Diagnostic("Unreachable", message, position, RAILS))
        return StraightEnd(np.asarray(rows[0]), rise.straight / length)

    def _leg(
        self, out: StraightEnd, into: StraightEnd, label: str, before: str, after: str
    ) -> JointWay:
        """The way from a part to a part, with another held; certified. Raises RunError (NoWay)."""
        scene, every = self.scene, self._later("")
        well = {f"'{after}'", feeder_name(after), *every}
        pile = {CARRIER, f"'{label}'", *self._later(before)}
        first, last = (well, pile) if label else (pile, well)
        way = leg(
            self.chain,
            out.rows,
            into.rows[::-1],
            lambda q: scene.margins(q, label, NEED, {f"'{label}'", *every}),
            lambda q: scene.margins(q, label, AT_END, {*first, *last}, held=False),
            self.pace,
            stiff=(out.share, into.share),
        )
        blocked = way if isinstance(way, NoWay) else None
        if isinstance(way, JointWay):
            certified = (
                ((0.0, way.off), first, CERTAIN_AT_END, bool(label)),
                ((way.off, way.hover), {f"'{label}'", *every}, CERTAIN, True),
                ((way.hover, way.length), last, CERTAIN_AT_END, False),
            )
            bodies = [*self.chain.bodies, *self._carried(label)]
            faults = (
                uncertified(
                    self.chain,
                    way,
                    stretch,
                    bodies,
                    partial(scene.margins, label=label, need=need, spared=spared, held=held),
                )
                for stretch, spared, need, held in certified
            )
            blocked = next(filter(None, faults), None)
            if blocked is None:
                return way
        assert blocked is not None
        message = (
            f"{self.name} finds no way from '{before}' to '{after}':"
            f" {scene.say(blocked.pair)} come {blocked.depth * 1e3:.1f} mm nearer to each other"
            " than they may"
        )
        position = self.cell.factory.by_label[after].position
        raise RunError(Diagnostic("NoWay", message, position, RAILS))

    def swept(self, way: JointWay, label: str = "") -> SweptArm:
        """What the arm sweeps on a way, with a part that it holds."""
        return SweptArm.of(self.scene, self.chain, way, [*self._carried(label)], label)

    def _carried(self, label: str) -> Iterator[ConvexBody]:
        """What moves with the last frame of the chain besides its links: the tool, and a part, of
        which it is not asked how it is held."""
        chain, pad = self.chain, self.cell.pad
        stem = [chain.tool_place - chain.tool_turn @ [0.0, 0.0, STEM], chain.tool_place]
        yield ConvexBody("tool", len(chain), np.array(stem), pad)
        if label:
            solid = self.cell.product.solids[label]
            middle = (solid.low + solid.high) / 2 - self.cell.tip[label]
            aside, below = float(np.hypot(*middle[:2])), -float(middle[2])
            half = float(np.linalg.norm(solid.high - solid.low)) / 2
            at = chain.tool_place + chain.tool_turn @ [0.0, 0.0, below]
            yield ConvexBody(label, len(chain), at[None], half + aside)
