"""Plans the legs of the arms of a cell: how each holds its parts, in which configurations it takes
and places them, and its ways between these."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import pi

import numpy as np

from factory.api import Diagnostic, Layout, Operation, RunError
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.body import STEM, standing
from factory.apps.arms.cell import ToolGrip, facing
from factory.apps.arms.certifying import uncertified
from factory.apps.arms.chain import ConvexBody
from factory.apps.arms.circuit import candidates, circuit, free_candidates
from factory.apps.arms.crew import RAILS
from factory.apps.arms.holds import facing_up
from factory.apps.arms.inverse import tool_lines
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.legs import NoWay, leg
from factory.apps.arms.model import ArmModel
from factory.apps.arms.obstacles import obstacles
from factory.apps.arms.reach import diagnose_reach
from factory.apps.arms.rises import Rise, StraightEnd
from factory.apps.arms.scene import NEED, Scene
from factory.apps.arms.sharing import SweptArm
from factory.apps.arms.spared import Spared
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.support.rotations import about_vertical

YAWS = 8
"""Number of angles at which a part may be held."""

AT_END = 0.001
"""Clearance of an arm's links on its straight ends, at samples [m]."""

CERTAIN, CERTAIN_AT_END, CERTAIN_AT_HAND = 0.004, 2e-4, 1e-4
"""Clearance that is certified on transfers, on straight ends, and of what an arm places from the
hand of a carrier, whose pads are 0.2 mm from faces that may go on over what is placed [m]."""

SAME = 0.03
"""Places that are nearer are one, as far as the tool's angle is concerned [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmTour:
    """How an arm brings a part.

    Attributes:
        label: the part.
        grip: how it is held.
        goes: the way on which the arm comes to take it.
        brings: the way on which the arm brings it.
        begins: coordinate of the arm's axis where it begins to come [m].
        stop: coordinate where it places it [m].
    """

    label: str
    grip: ToolGrip
    goes: JointWay
    brings: JointWay
    begins: float = 0.0
    stop: float = 0.0


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
        self.scene = Scene(model, standing(model, stand), loads, [*obstacles(cell, arm, bare)])
        self.spared = Spared(cell, bare)
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
        lines = self._lines(visits)
        for number, (label, (yaw, _, _)) in enumerate(zip(self.labels, visits, strict=True)):
            before, (enters, exits, into, _) = self.labels[number - 1], lines[number]
            out = self._end(before, *lines[number - 1][3])
            goes = self._leg(out, self._end(label, *enters), "", before, label)
            self._hold(label, yaw)
            ends = self._end(label, *exits), self._end(label, *into)
            brings = self._leg(*ends, label, label, label)
            normal = cell.burdens[label].hold.normal
            grip = ToolGrip(cell.tip[label], yaw, cell.covered(label), normal=normal)
            tours.append(ArmTour(label, grip, goes, brings))
        return tours

    def _have(self, operations: Mapping[int | None, Operation]) -> None:
        """Have carriers, by index, stand where they do in operations, if that is not one place."""
        for carrier, line in self.cell.lines.items():
            if not line.steps:
                continue
            x, y = line.stand(operations.get(carrier))
            self.scene.move(self.spared.on(line), (x - line.station[0], y - line.station[1], 0.0))

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
        options, yaws = list[Array](), list[Array]()
        for number, label in enumerate(self.labels):
            angles = (np.arange(YAWS) + self._turned(number) / 2) * 2 * pi / YAWS
            pairs, grips = self._options(label, angles)
            options.append(pairs)
            yaws.append(angles[grips])
        chosen = circuit(options, self.chain.limits.speed)
        return [
            (float(yaws[k][n]), options[k][n, 0], options[k][n, 1]) for k, n in enumerate(chosen)
        ]

    def _turned(self, number: int) -> bool:
        """Whether a tour begins where the one before ends: the tool has another angle then, or the
        arm would turn round on the spot, and nobody would know where on its way it is."""
        cell, label, before = self.cell, self.labels[number], self.labels[number - 1]
        if cell.burdens[label].source != cell.burdens[before].onto:
            return False
        off = cell.tip[label] - cell.tip[before]
        return bool(np.linalg.norm(off[:2]) < SAME)

    def _options(self, label: str, angles: Array) -> tuple[Array, Index]:
        cell = self.cell
        burden = cell.burdens[label]
        faces = np.array([facing(burden.hold.normal, float(a)) for a in angles])
        turns = self._turn @ faces
        taken = self._turn @ about_vertical(burden.fed) @ faces
        shown = cell.local(self.arm, cell.tip_shown(label) + cell.shown(label))
        placed = cell.local(self.arm, cell.tip[label] + cell.placed(burden.onto, burden.join))
        self._have(burden.stops)
        at, under, moving = self.spared.at(label), self.spared.under(label), self.spared.moving
        spared = (at & under) | ((at | under) - moving)  # parts count that do at either end

        def clearance(q: Array) -> tuple[Array, Index]:
            return self.scene.margins(q, "", CERTAIN_AT_END, spared)

        sought = candidates if cell.is_upright(label) else free_candidates
        options = sought(
            self.chain,
            (np.tile(shown, (len(angles), 1)), taken),
            (np.tile(placed, (len(angles), 1)), turns),
            clearance,
            np.zeros(len(self.chain)),
            self._ends(label),
        )
        if len(options.pairs):
            return options.pairs, options.grips
        raise RunError(self._unreachable(label, (shown, placed), turns[0], options.blocked))

    @cached_property
    def _turn(self) -> Array:
        """From the directions of the world to those of the arm's base (3, 3)."""
        return about_vertical(-self.cell.stands[self.arm].yaw)

    def _rises(self, label: str) -> tuple[Rise, Rise, Rise, Rise]:
        """How the tool comes to where it takes something and goes from there, and the same where it
        places it."""
        cell = self.cell
        return cell.enters(label), cell.exits(label), cell.rises(label), cell.leaves(label)

    def _ends(self, label: str) -> tuple[list[Array], list[Array]]:
        """The lines of the tool where it takes something, and where it places it."""
        enters, exits, rises, leaves = (rise.places @ self._turn.T for rise in self._rises(label))
        if self.cell.is_straight(label):  # one of them stands for all
            return [enters], [enters]
        return [enters, exits], [rises, leaves]

    def _unreachable(
        self, label: str, places: tuple[Array, Array], turn: Array, blocked: NoWay | None
    ) -> Diagnostic:
        position = self.cell.factory.by_label[label].position
        rise = self.cell.enters(label).length
        for up in (0.0, rise):
            for place in places:
                why = diagnose_reach(self.chain, place + np.array([0.0, 0.0, up]), turn)
                if why is not None:
                    message = why.message(label, self.name, up)
                    return Diagnostic("Unreachable", message, position, RAILS)
        message = f"{self.name} has no configuration that brings '{label}'"
        if blocked:
            message += f": {self.scene.say(blocked.pair)} are in each other's way"
        else:
            goes = "up" if self.cell.is_straight(label) else "out and up"
            message += f" and goes straight {goes} by {rise * 1e3:.0f} mm at both ends"
        return Diagnostic("Unreachable", message, position, RAILS)

    def _lines(
        self, visits: Sequence[tuple[float, Array, Array]]
    ) -> list[list[tuple[Rise, Array, bool]]]:
        """For each part its straight ends, as in `_rises`, with the configurations (k, n) on them
        from the visit, and whether the arm follows them."""
        rises = [rise for label in self.labels for rise in self._rises(label)]
        starts = [q[None] for _, taken, placed in visits for q in (taken, taken, placed, placed)]
        made = tool_lines(self.chain, starts, [rise.places @ self._turn.T for rise in rises])
        lines = [(rise, row[0], bool(good)) for rise, (row, good) in zip(rises, made, strict=True)]
        return [lines[n : n + 4] for n in range(0, len(lines), 4)]

    def _end(self, label: str, rise: Rise, rows: Array, good: bool) -> StraightEnd:
        """The straight line from a visit. Raises RunError (Unreachable) if the arm does not follow
        it."""
        if good:
            return StraightEnd(rows, rise.straight / rise.length)
        message = f"{self.name} cannot go straight up from '{label}' by {rise.length * 1e3:.0f} mm"
        position = self.cell.factory.by_label[label].position
        raise RunError(Diagnostic("Unreachable", message, position, RAILS))

    def _leg(
        self, out: StraightEnd, into: StraightEnd, label: str, before: str, after: str
    ) -> JointWay:
        """The way from a part to a part, with another held; certified. Raises RunError (NoWay)."""
        scene, every = self.scene, self.spared.moving
        left, taken_next = self.cell.burdens[before], self.cell.burdens[after]
        self._have({left.onto: left.join, taken_next.source: taken_next.takes})
        taken, pile = self.spared.at(after, bool(label)), self.spared.under(before)
        first, last = (taken, pile) if label else (pile, taken)
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
            certified: tuple[tuple[tuple[float, float], set[str], float, bool], ...] = (
                ((0.0, way.off), first, CERTAIN_AT_END, bool(label)),
                ((way.off, way.hover), {f"'{label}'", *every}, CERTAIN, True),
                ((way.hover, way.length), last, CERTAIN_AT_END, False),
            )
            bodies = [*self.chain.bodies, *self._carried(label)]
            if label:
                line, end = self.cell.lines[self.cell.burdens[label].onto], (way.hover, way.length)
                others = {*scene.obstacles} - self.spared.hand(line)
                certified += ((end, others, CERTAIN_AT_HAND, True),)
                if not self.cell.burdens[label].comes[2]:
                    there = {f"'{label}'", line.name, *every}
                    certified += ((end, there, CERTAIN, True),)
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
            burden = self.cell.burdens[label]
            middle = (burden.low + burden.high) / 2 - self.cell.tip[label]
            middle = facing_up(burden.hold.normal) @ middle
            aside, below = float(np.hypot(*middle[:2])), -float(middle[2])
            half = float(np.linalg.norm(burden.high - burden.low)) / 2
            at = chain.tool_place + chain.tool_turn @ [0.0, 0.0, below]
            yield ConvexBody(label, len(chain), at[None], half + aside)
