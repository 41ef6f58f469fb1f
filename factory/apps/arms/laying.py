"""Lays out a cell: the carrier's line, an arm beside its station, feeders round the arm, and the
legs of the arm between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import asin, cos, pi, sin
from pathlib import Path

import numpy as np

from factory.api import Array, Diagnostic, Factory, Layout, RunError
from factory.apps.arms.body import STEM, Stand, standing
from factory.apps.arms.cell import (
    APART,
    NEAR,
    PEDESTAL_HEIGHT,
    ROUND,
    CellChains,
    Grip,
    Well,
    down,
    shown_height,
    tip_on,
    well_of,
)
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.circuit import candidates, circuit
from factory.apps.arms.curves import Leg, LegTable
from factory.apps.arms.inverse import away, straight
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.legs import NoWay, leg
from factory.apps.arms.read import read_chain
from factory.apps.arms.scene import NEED, Obstacle, Scene
from factory.floor.geometry.solids import Product, Solid
from factory.floor.layout.certificate import Certificate, Exclusions, Precedence
from factory.floor.layout.dimensions import PAYLOAD
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.visits import Visit, visits_of
from factory.theory.nets.coordinated import Past

REACH = 0.2
"""The coordinate of an arm's axis where it places [m]."""

ABOVE = 0.022
"""How far above the product a payload, or an empty tool, is where a carrier may come and go [m]."""

OVER_WELL = 0.06
"""How far a tool goes straight up from its feeder at least [m]."""

STRAIGHT = 0.5
"""Share of a straight end that stays straight where the leg is rounded (`legs.leg`)."""

YAWS = 8
"""Number of angles at which a part may be held."""


@dataclass(frozen=True, eq=False)
class CellPlan:
    """A cell that is being laid out.

    Attributes:
        factory: the factory, whose second robot is the arm.
        rails: the layout of the same product on rails, whose carrier's line and hand it takes.
        chain: the arm, to the tip of its tool.
        pace: limits of the arm's coordinate.
        clearance: [m].
    """

    factory: Factory
    rails: Layout
    chain: SerialChain
    pace: WayLimits
    clearance: float

    @property
    def product(self) -> Product:
        """The solids."""
        return self.rails.product

    @cached_property
    def labels(self) -> list[str]:
        """The parts that the arm takes, in the order of its program."""
        return [self.factory.operations[tour[0]].label for tour in self.factory.tours[1]]

    @cached_property
    def line(self) -> Guidepath:
        """The carrier's guidepath, with its station in the middle."""
        path = self.rails.guidepaths[0]
        return replace(path, travel=round(self.before + self.after, 3))

    @cached_property
    def _half(self) -> float:
        """Half the length of the product along the line, and of its pedestal's room [m]."""
        return float((self.product.high - self.product.low)[0]) / 2

    @cached_property
    def before(self) -> float:
        """From the carrier's feeder to the station [m]."""
        return round(0.32 + 2 * self._half, 3)

    @cached_property
    def after(self) -> float:
        """From the station to the outfeed [m]."""
        return round(0.32 + 2 * self._half, 3)

    @cached_property
    def station(self) -> tuple[float, float]:
        """The product's middle at the station [m]."""
        return self.line.middle(self.line.reach + self.after)

    @cached_property
    def stand(self) -> Stand:
        """Where the arm stands."""
        x, y = self.station
        return Stand((x, y + NEAR * self._far, PEDESTAL_HEIGHT), -pi / 2)

    @cached_property
    def _far(self) -> float:
        """How far the arm's tool comes from its axis, pointing down [m]."""
        return self.chain.length * 0.72

    @cached_property
    def grips_at(self) -> dict[str, Array]:
        """Where the arm's tool is on each part, in the product's frame (3,) [m]."""
        return {label: tip_on(self.product.solids[label]) for label in self.labels}

    @cached_property
    def wells(self) -> dict[str, Well]:
        """The feeders of the arm: on a circle, to the right and left of the station in turn."""
        solids = [self.product.solids[label] for label in self.labels]
        show = shown_height(solids, self.clearance)
        x, y, _ = self.stand.place
        radius = ROUND * self._far
        lane = self._lane
        angles = [0.0, 0.0]
        wells = dict[str, Well]()
        for number, (label, solid) in enumerate(zip(self.labels, solids, strict=True)):
            wide = float(np.linalg.norm((solid.high - solid.low)[:2])) / 2 + APART / 2
            side = number % 2
            pitch = asin(min(1.0, wide / radius))
            first = pi / 2 - asin(
                max(-1.0, min(1.0, (NEAR * self._far - lane - wide) / radius))
            )
            angle = max(angles[side] + pitch, first)
            angles[side] = angle + pitch
            turned = self.stand.yaw + (angle if side else -angle)
            place = x + radius * cos(turned), y + radius * sin(turned)
            wells[label] = well_of(self.product, solid, place, show, self.clearance)
        if max(angles) > pi - 0.1:
            message = f"{len(self.labels)} feeders have no room round one arm"
            raise RunError(Diagnostic("Layout", message, None, "leave out --arm"))
        return wells

    @cached_property
    def _lane(self) -> float:
        """Half the width that the carrier with its product takes on its line [m]."""
        half = float((self.product.high - self.product.low)[1]) / 2
        return max(half, self.factory.carriage / 2) + self.clearance

    @cached_property
    def bare(self) -> Layout:
        """The layout without its arm's legs: with the length of these at 1 m."""
        return self.layout(1.0)

    def layout(self, length: float, chains: CellChains | None = None) -> Layout:
        """The layout with legs of a length [m]."""
        x, y = self.station
        arm = Guidepath((1.0, 0.0), (0.0, 1.0), (x, y), length, REACH, 0.0, 0.0, 0.0)
        paths, factory = (self.line, arm), self.factory
        stations = [
            self.before if o.carrier == 0 and o.inputs else 0.0 for o in factory.operations
        ]
        visits = visits_of(factory, paths, stations)
        for label, well in self.wells.items():
            number = factory.by_label[label].index
            visit = visits[number, 1]
            at = arm.middle(visit.at)
            shift = well.place[0] - at[0], well.place[1] - at[1]
            visits[number, 1] = Visit(visit.at, 0.0, 0.0, well.elevation, shift)
        made = replace(
            self.rails,
            factory=factory,
            guidepaths=paths,
            visits=visits,
            hands=(self.rails.hands[0], None),
            certificate=None,
            plain=None,
            chains=chains,
        )
        return replace(made, floor=self._floor)

    @cached_property
    def _floor(self) -> tuple[float, float, float, float]:
        """The floor that the cell takes [m]."""
        xlo, xhi, ylo, yhi = self.rails.floor
        sx, sy, _ = self.stand.place
        boxes = [well.feeder.housing for well in self.wells.values()]
        far = self.line.middle(self.line.length)[0] - self.line.reach - 0.1
        return (
            min(far, sx - 0.1, *(b[0] for b in boxes)) - self.clearance,
            max(xhi, sx + 0.1, *(b[1] for b in boxes)) + self.clearance,
            min(ylo, sy - 0.1, *(b[2] for b in boxes)) - self.clearance,
            max(yhi, sy + 0.1, *(b[3] for b in boxes)) + self.clearance,
        )

    def tips(self, label: str) -> tuple[Array, Array]:
        """Where the tip of the tool is as the arm takes a part, and as it places it, in the world
        (3,) [m]."""
        tip, product = self.grips_at[label], self.product
        foot = np.array([*product.middle[:2], product.low[2] - PAYLOAD])
        well = self.wells[label]
        shown = tip - foot + [*well.place, well.elevation]
        return shown, tip - foot + [*self.station, 0.0]

    def local(self, place: Array) -> Array:
        """A place of the world in the frame of the arm's base (3,) [m]."""
        c, s = cos(-self.stand.yaw), sin(-self.stand.yaw)
        x, y, z = place - self.stand.place
        return np.array([c * x - s * y, s * x + c * y, z])

    @cached_property
    def top(self) -> float:
        """Height of the product's top [m]."""
        return PAYLOAD + float(self.product.high[2] - self.product.low[2])

    def rises(self, label: str) -> float:
        """How far above its place the tool begins to come straight down with a part: it is still
        where a carrier may come and go at the end of what is rounded [m]."""
        solid, o = self.product.solids[label], self.factory.by_label[label]
        bottom = PAYLOAD + float(solid.low[2] - self.product.low[2])
        parent = self.factory.operations[self.factory.parents[o.index]]
        stroke = parent.approach.stroke if parent.approach else 0.0
        return max(stroke, self.top - bottom + ABOVE) / STRAIGHT

    def leaves(self, label: str) -> float:
        """How far the empty tool goes straight up from where it has placed a part [m]."""
        return (self.top + ABOVE - float(self.tips(label)[1][2])) / STRAIGHT

    @cached_property
    def over_well(self) -> float:
        """How far the tool goes straight up from a feeder [m]."""
        show = min(
            PAYLOAD + float(self.product.solids[label].low[2] - self.product.low[2]) + w.elevation
            for label, w in self.wells.items()
        )
        return max(OVER_WELL, self.top + 2 * ABOVE - show)

    def obstacles(self) -> Iterator[Obstacle]:
        """What stands in the arm's way, or may come there while it is on a transfer."""
        yield Obstacle("the floor", (-5.0, -5.0, -0.1), (5.0, 5.0, 0.0))
        low, high, middle = self.product.low, self.product.high, self.product.middle
        foot = np.array([*middle[:2], low[2] - PAYLOAD])
        ends = [self.line.middle(x) for x in (self.line.reach, self.line.length)]
        xs = sorted(e[0] for e in ends)
        half = (high - low)[:2] / 2
        y = ends[0][1]
        side = max(half[1], self.factory.carriage / 2)
        yield Obstacle(
            "the carrier",
            (xs[0] - half[0] - self.line.reach - 0.05, y - side, 0.0),
            (xs[1] + half[0] + 0.05, y + side, self.top),
        )
        for label, well in self.wells.items():
            xlo, xhi, ylo, yhi = well.feeder.housing
            yield Obstacle(f"the feeder of '{label}'", (xlo, ylo, 0.0), (xhi, yhi, well.feeder.high))
            solid = self.product.solids[label]
            at = -foot + [*well.place, well.elevation]
            yield Obstacle(f"'{label}'", tuple(solid.low + at), tuple(solid.high + at))
        first = self.factory.first(0)
        from factory.floor.layout.feeding import feeder_of

        feeder = feeder_of(self.bare, first.label)
        for name, (xlo, xhi, ylo, yhi), bottom in (
            ("post", feeder.post, 0.0),
            ("boom", feeder.boom, feeder.low),
            ("housing", feeder.housing, feeder.low),
        ):
            what = f"the {name} of '{first.label}'"
            yield Obstacle(what, (xlo, ylo, bottom), (xhi, yhi, feeder.high))
        for label in self.product.solids:
            solid = self.product.solids[label]
            at = -foot + [*self.station, 0.0]
            yield Obstacle(f"placed '{label}'", tuple(solid.low + at), tuple(solid.high + at))
        xlo, xhi, ylo, yhi = self.rails.outfeed
        yield Obstacle("the outfeed", (xlo, ylo, 0.0), (xhi, yhi, self.top + 0.05))

    def loads(self, label: str) -> list[tuple[Array, Array, Array]]:
        """The boxes of a part in the tool's frame, held with the tool's yaw at 0."""
        solid, turn = self.product.solids[label], down(0.0)
        middle, half = (solid.low + solid.high) / 2, (solid.high - solid.low) / 2
        place = turn.T @ (middle - self.grips_at[label]) + [0.0, 0.0, STEM]
        return [(place, half, np.array([0.0, 1.0, 0.0, 0.0]))]


class Planner:
    """Plans the legs of the arm of a cell."""

    def __init__(self, plan: CellPlan, file: Path) -> None:
        self.plan, self.chain = plan, plan.chain
        loads = {label: plan.loads(label) for label in plan.labels}
        self.scene = Scene(standing(file, plan.stand), "", loads, [*plan.obstacles()])
        self._place = {
            label: [
                (self.scene.m.geom_pos[g].copy(), self.scene.m.geom_quat[g].copy())
                for g in geoms
            ]
            for label, geoms in self.scene.loads.items()
        }

    def turn_load(self, label: str, yaw: float) -> None:
        """Hold a part with the tool at an angle."""
        import mujoco

        off = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, off)
        for geom, (pos, quat) in zip(self.scene.loads[label], self._place[label], strict=True):
            self.scene.m.geom_pos[geom] = rotation.reshape(3, 3) @ pos
            made = np.empty(4)
            mujoco.mju_mulQuat(made, off, quat)
            self.scene.m.geom_quat[geom] = made

    def configurations(self) -> list[tuple[float, Array, Array]]:
        """For each part the angle of the tool, and the configurations where it is taken and
        placed."""
        plan, options, yaws = self.plan, list[Array](), list[Array]()
        near = np.zeros(len(self.chain))
        angles = np.arange(YAWS) * 2 * pi / YAWS
        turns = np.array([down(float(a) - plan.stand.yaw) for a in angles])
        for label in plan.labels:
            shown, placed = (plan.local(tip) for tip in plan.tips(label))
            takes = np.tile(shown, (YAWS, 1)), turns
            puts = np.tile(placed, (YAWS, 1)), turns
            spared = {f"'{label}'", f"the feeder of '{label}'", "the carrier", *self._pile(label)}
            found = candidates(
                self.chain,
                takes,
                puts,
                lambda q, spared=spared: self.scene.margins(q, "", 0.002, spared),
                near,
                plan.over_well,
            )
            if not len(found.pairs):
                why = self.scene.say(found.blocked.pair) if found.blocked else "out of its reach"
                message = f"the arm cannot bring '{label}': {why}"
                raise RunError(Diagnostic("Unreachable", message, None, "leave out --arm"))
            options.append(found.pairs)
            yaws.append(angles[found.grips])
        chosen = circuit(options, self.chain.limits.speed)
        return [
            (float(yaws[k][n]), options[k][n, 0], options[k][n, 1]) for k, n in enumerate(chosen)
        ]

    def _pile(self, label: str) -> set[str]:
        """The obstacles that are not there as a part is placed: the parts that come later and it,
        all for none."""
        labels = self.plan.labels
        later = labels[labels.index(label) :] if label else [*self.plan.product.solids]
        return {f"placed '{one}'" for one in later}

    def _line(self, q: Array, length: float, label: str) -> Array:
        """Configurations along a straight line up from a visit (k, n)."""
        rows, good = straight(self.chain, q[None], away(self.chain, q[None]), length)
        if not good[0]:
            message = f"the arm cannot go straight up by {length:.3f} m from '{label}'"
            raise RunError(Diagnostic("Unreachable", message, None, "leave out --arm"))
        return rows[0]

    def legs(self) -> tuple[list[Grip], list[JointWay], list[JointWay]]:
        """The grips, and for each part the leg on which the arm goes to take it, and the one on
        which it brings it."""
        plan, visits = self.plan, self.configurations()
        grips = [
            Grip(plan.grips_at[label], yaw)
            for label, (yaw, _, _) in zip(plan.labels, visits, strict=True)
        ]
        goes, brings = list[JointWay](), list[JointWay]()
        for number, label in enumerate(plan.labels):
            yaw, taken, placed = visits[number]
            before = plan.labels[number - 1]
            left = visits[number - 1][2]
            out = self._line(left, plan.leaves(before), before)
            over = self._line(taken, plan.over_well, label)
            goes.append(self._leg(out, over[::-1], "", before, label))
            self.turn_load(label, yaw)
            into = self._line(placed, plan.rises(label), label)
            brings.append(self._leg(over, into[::-1], label, label, label))
        return grips, goes, brings

    def _leg(self, out: Array, into: Array, label: str, before: str, after: str) -> JointWay:
        every = self._pile("")
        spared = {f"'{label}'", *every} if label else every
        ends = {*spared, "the carrier", f"'{after}'", f"the feeder of '{after}'"}
        ends -= {*every} - self._pile(before)
        found = leg(
            self.chain,
            out,
            into,
            lambda q: self.scene.margins(q, label, NEED, spared),
            lambda q: self.scene.margins(q, label, 0.001, ends, held=False),
            self.plan.pace,
        )
        if isinstance(found, NoWay):
            message = (
                f"the arm finds no way from '{before}' to '{after}':"
                f" {self.scene.say(found.pair)} come {found.depth * 1e3:.1f} mm nearer than they may"
            )
            raise RunError(Diagnostic("NoWay", message, None, "leave out --arm"))
        return found


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm to lay a cell out for.

    Attributes:
        file: its MJCF.
        gains: of its drives: kp, kv, greatest torque [N m/rad, N m s/rad, N m].
    """

    file: Path
    gains: tuple[tuple[float, float, float], ...]


def laid_out(factory: Factory, rails: Layout, arm: Arm, pace: WayLimits) -> Layout:
    """The layout of a cell with its certificate. Raises RunError: Unreachable, NoWay, Layout."""
    chain = read_chain(arm.file)
    tip = chain.tool_place + chain.tool_turn @ [0.0, 0.0, STEM]
    chain = replace(chain, tool_place=tip)
    plan = CellPlan(factory, rails, chain, pace, rails.clearance)
    planner = Planner(plan, arm.file)
    grips, goes, brings = planner.legs()
    length = max(way.length for way in (*goes, *brings))
    damping = np.array(planner.scene.m.dof_damping)
    legs, rows = list[Leg](), dict[tuple[int, int], int]()
    standoffs, clear = dict[int, float](), dict[int, float]()
    leaving = 0.0
    for label, grip, go, bring in zip(plan.labels, grips, goes, brings, strict=True):
        solid, leaf = plan.product.solids[label], factory.by_label[label].index
        join = factory.parents[leaf]
        go, bring = go.stretched(length / go.length), bring.stretched(length / bring.length)
        center = grip.turn.T @ (solid.centre - grip.tip)
        rows[leaf, 1], rows[join, 1] = len(legs), len(legs) + 1
        legs.append(Leg(chain, go, REACH, False, np.zeros(3), damping))
        legs.append(Leg(chain, bring, REACH, True, center, damping))
        standoffs[join] = round(length - bring.hover + 0.001, 6)
        clear[leaf] = round(bring.off + 0.001, 6)
        leaving = max(leaving, go.off) if label == plan.labels[0] else leaving
    chains = CellChains(
        factory,
        plan.product,
        (1,),
        arm.file,
        {1: plan.stand},
        plan.wells,
        dict(zip(plan.labels, grips, strict=True)),
        LegTable(legs),
        rows,
        standoffs,
        clear,
        arm.gains,
    )
    layout = plan.layout(length, chains)
    return replace(layout, certificate=_certificate(plan, layout, round(leaving + 0.001, 6)))


def _certificate(plan: CellPlan, layout: Layout, leaving: float) -> Certificate:
    """What keeps the arm and the carrier apart: the carrier leaves with the product when the arm
    has gone up from it (Theorem 19)."""
    factory = plan.factory
    last, dropoff = factory.operations[factory.parents[plan_last(plan)]], factory.dropoff
    past = Past(last.end, 1, REACH + leaving)
    name = f"past:{factory.robots[1].name}:1:{last.label}"
    order = Precedence(
        f"order:{name}:{dropoff.label}", name, f"{dropoff.label}_s", 0
    )
    apart = Exclusions(passes=(past,), orders=(order,))
    rails = plan.rails.certificate
    assert rails is not None
    return replace(
        rails,
        robots=tuple(robot.name for robot in factory.robots),
        operations=tuple(operation.label for operation in factory.operations),
        regions=(),
        apart=apart,
    )


def plan_last(plan: CellPlan) -> int:
    """The operation (index) that takes the arm's last part."""
    return plan.factory.by_label[plan.labels[-1]].index
