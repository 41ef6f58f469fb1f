"""Where things stand in a cell: the carrier's line and its station, arms on either side of it, and
the feeders of each arm on a circle round its base."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import asin, cos, pi, sin

import numpy as np

from factory.api import (
    Array,
    Diagnostic,
    Factory,
    Guidepath,
    Layout,
    Operation,
    Product,
    RunError,
    Solid,
)
from factory.apps.arms.arming import RAILS
from factory.apps.arms.body import PAD_RADIUS, PEDESTAL, STEM, Stand
from factory.apps.arms.cell import GAP, Well, down, shown_height, well_of
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.reach import Ring, ring_of
from factory.apps.arms.scene import StandingBox
from factory.apps.arms.tools import Tool, tools_of, works_at
from factory.floor.geometry.suction import GAP as SUCTION_GAP
from factory.floor.geometry.suction import PadPlace, pad_place
from factory.floor.layout.dimensions import PAYLOAD
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.guidepath import Box

CLOSER = 0.02
"""How much farther from an arm than the station its feeders are [m]."""

APART = 0.02
"""Between what stands beside each other [m]."""

LANE = 0.32
"""From the station to either end of the carrier's line, without the product's length [m]."""

FULL = pi - 0.1
"""Angle from the station up to which there are feeders on either side of an arm [rad]."""

SHARES = 0.45, 0.35, 0.25
"""Radii of pads as shares of a part's least extent in plan that are tried."""

ABOVE = 0.018
"""How far above the product a payload, or an empty tool, is where a carrier may come and go [m]."""

OVER_WELL = 0.06
"""Length of a straight end at a feeder at least [m]."""

CURVE = 0.06
"""Length of the most of a straight end that may be rounded, beyond what stays straight [m]."""


@dataclass(frozen=True, slots=True)
class Rise:
    """A straight end of a way, above the visit.

    Attributes:
        straight: how far it stays straight; what is beyond may be rounded [m].
        length: of it all [m].
    """

    straight: float
    length: float

    @classmethod
    def of(cls, straight: float) -> Rise:
        """One that stays straight so far [m]."""
        return cls(straight, straight + min(straight, CURVE))


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The places in a cell.

    Attributes:
        factory: of the carrier, tools that work on what it carries, and arms.
        rails: the layout of the same product on rails, whose carrier's line and hand it takes.
        chain: the arms, to the tip of their tools.
        aside: least angle between the station and a feeder, as its arm sees them [rad].
        far: how far an arm stands from the station, as a share of the width of its ring.
    """

    factory: Factory
    rails: Layout
    chain: SerialChain
    aside: float = 0.0
    far: float = 0.41

    @property
    def product(self) -> Product:
        """The solids."""
        return self.rails.product

    @cached_property
    def arms(self) -> tuple[int, ...]:
        """The arms (index)."""
        return tuple(robot.index for robot in self.factory.robots if robot.body.first.moves)

    @property
    def others(self) -> range:
        """All robots but the carrier (index)."""
        return range(1, len(self.factory.robots))

    @cached_property
    def tools(self) -> dict[int, Tool]:
        """The tools by index."""
        room = [well.feeder.housing for well in self.wells.values()]
        room += map(_round, self.stands.values())
        solids = (self.product.solids[label] for label in self.arm_of)
        widest = max(float(np.linalg.norm((one.high - one.low)[:2])) for one in solids)
        near = float(self.half[0]) + widest / 2 + APART
        return tools_of(self.factory, self.rails, self.station[0], near, room)

    def labels(self, arm: int) -> list[str]:
        """The parts that an arm takes, in the order of its program."""
        operations = self.factory.operations
        return [operations[tour[0]].label for tour in self.factory.tours[arm]]

    @cached_property
    def arm_of(self) -> dict[str, int]:
        """The arm (index) that takes each part."""
        return {label: arm for arm in self.arms for label in self.labels(arm)}

    @cached_property
    def half(self) -> Array:
        """Half the length and half the width of the product (2,) [m]."""
        return np.asarray((self.product.high - self.product.low)[:2] / 2)

    @cached_property
    def lane(self) -> float:
        """From the station to the outfeed [m]."""
        return round(LANE + 2 * float(self.half[0]), 3)

    @cached_property
    def line(self) -> Guidepath:
        """The carrier's guidepath."""
        behind = [self.station[0] - tool.box[0] for tool in self.tools.values()]
        behind = [self.lane, *(far + 2 * float(self.half[0]) for far in behind)]
        return replace(self.rails.guidepaths[0], travel=round(self.lane + max(behind), 3))

    @cached_property
    def station(self) -> tuple[float, float]:
        """The product's middle at the station [m]."""
        path = self.rails.guidepaths[0]
        return path.middle(path.reach + self.lane)

    def stop(self, operation: Operation) -> float:
        """How far from its feeder the carrier stands in an operation [m]."""
        at = works_at(self.tools, operation)
        at = self.station[0] if at is None else at
        return round(at - self.line.middle(self.line.length)[0], 6)

    @cached_property
    def show(self) -> float:
        """Height at which the bottoms of parts are shown [m]."""
        solids = [self.product.solids[label] for label in self.arm_of]
        return shown_height(solids, self.rails.clearance)

    @cached_property
    def ring(self) -> Ring:
        """Where the arms stand, and between which distances from their axes they take and place.
        Raises RunError (Unreachable) where their tools do not come up and down far enough."""
        tips, low = list[float](), float(self.product.low[2])
        for label, tip in self.tip.items():
            shown = self.show + float(tip[2] - self.product.solids[label].low[2])
            placed = PAYLOAD + float(tip[2]) - low
            tips += [shown, placed, shown + self.over_well.length]
            tips += [placed + self.rises(label).length, placed + self.leaves(label).length]
        aside = (tip[:2] - self.product.middle[:2] for tip in self.tip.values())
        spread = max(float(np.linalg.norm(off)) for off in aside)
        ring = ring_of(self.chain, min(tips), max(tips), spread)
        if ring is None:
            message = (
                f"the arm does not come from {1e3 * min(tips):.0f} to {1e3 * max(tips):.0f} mm up"
                " with its tool down, as these parts need"
            )
            raise RunError(
                Diagnostic("Unreachable", message, None, f"flatter parts, another arm; {RAILS}")
            )
        return ring

    @property
    def near(self) -> float:
        """Distance of the station from an arm's axis [m]."""
        return self.ring.at(self.far)

    @cached_property
    def stands(self) -> dict[int, Stand]:
        """Where the arms stand, to the left and right of the line in turn."""
        if len(self.arms) > len(SIDES):
            message = f"{len(self.arms)} arms have no room at one station"
            raise RunError(Diagnostic("Layout", message, None, f"at most {len(SIDES)}"))
        (x, y), off = self.station, self.near
        return {
            arm: Stand((x, y + side * off, self.ring.base), -side * pi / 2, self.pad)
            for arm, side in zip(self.arms, SIDES, strict=False)
        }

    @cached_property
    def wells(self) -> dict[str, Well]:
        """The feeders of all arms."""
        room = self.product, self.show, self.rails.clearance
        return {
            label: well_of(self.product.solids[label], at, *room)
            for arm in self.arms
            for label, at in self._places(arm)
        }

    def _places(self, arm: int) -> Iterator[tuple[str, tuple[float, float]]]:
        """Where the parts of an arm are shown: on a circle round it, the first ones next to the
        carrier's line; to the right and left of the station in turn, but with another arm opposite
        to the right as long as there is room: so the ways of both cross at the station alone."""
        stand, radius = self.stands[arm], self.near + CLOSER
        beside = max(float(self.half[1]), self.factory.carriage / 2) + self.rails.clearance
        angles = [0.0, 0.0]
        for number, label in enumerate(self.labels(arm)):
            solid = self.product.solids[label]
            wide = float(np.linalg.norm((solid.high - solid.low)[:2])) / 2 + APART / 2
            pitch = asin(min(1.0, wide / radius))
            room = (self.near - beside - wide) / radius
            first = pi / 2 - asin(max(-1.0, min(1.0, room)))
            first = max(first, self.aside)
            side = number % 2
            if len(self.arms) > 1:
                side = int(max(angles[0] + pitch, first) + pitch > FULL)
            angle = max(angles[side] + pitch, first)
            angles[side] = angle + pitch
            if angles[side] > FULL:
                message = f"the feeder of '{label}' has no room round its arm"
                hint = "more arms, smaller parts, or rails: leave out --arm"
                raise RunError(Diagnostic("Layout", message, None, hint))
            turned = stand.yaw + (angle if side else -angle)
            x, y, _ = stand.place
            yield label, (x + radius * cos(turned), y + radius * sin(turned))

    @cached_property
    def pads(self) -> dict[str, PadPlace]:
        """Where a pad is on each part, and how large it may be there."""
        return {label: _largest_pad(self.product.solids[label]) for label in self.arm_of}

    @cached_property
    def pad(self) -> float:
        """Radius of the pads of the arms' tools: there is room for them on every part [m]."""
        return min(float(pad.radius) for pad in self.pads.values())

    @cached_property
    def tip(self) -> dict[str, Array]:
        """Where an arm's tool is on each part, in the product's frame (3,) [m]."""
        off = np.array([0.0, 0.0, GAP - SUCTION_GAP])
        return {label: np.asarray(pad.at + off) for label, pad in self.pads.items()}

    @property
    def _foot(self) -> Array:
        """The place in the product's frame that comes to where the product's middle is, on the
        floor (3,) [m]."""
        return np.array([*self.product.middle[:2], self.product.low[2] - PAYLOAD])

    def shown(self, label: str) -> Array:
        """How far a part is from its place in the product's frame as it is shown (3,) [m]."""
        well = self.wells[label]
        return np.array([*well.place, well.elevation]) - self._foot

    @property
    def placed(self) -> Array:
        """How far a part is from its place in the product's frame at the station (3,) [m]."""
        return np.array([*self.station, 0.0]) - self._foot

    def local(self, arm: int, place: Array) -> Array:
        """A place of the world in the frame of an arm's base (3,) [m]."""
        stand = self.stands[arm]
        c, s = cos(-stand.yaw), sin(-stand.yaw)
        x, y, z = place - stand.place
        return np.array([c * x - s * y, s * x + c * y, z])

    @cached_property
    def top(self) -> float:
        """Height of the product's top [m]."""
        return PAYLOAD + float(self.product.high[2] - self.product.low[2])

    def rises(self, label: str) -> Rise:
        """How a part comes straight down to its place, from where a carrier may still come and
        go."""
        solid, o = self.product.solids[label], self.factory.by_label[label]
        bottom = PAYLOAD + float(solid.low[2] - self.product.low[2])
        parent = self.factory.operations[self.factory.parents[o.index]]
        stroke = parent.approach.stroke if parent.approach else 0.0
        return Rise.of(max(stroke, self.top - bottom + ABOVE))

    def leaves(self, label: str) -> Rise:
        """How the empty tool goes straight up from where it has placed a part."""
        tip = PAYLOAD + float(self.tip[label][2] - self.product.low[2])
        return Rise.of(self.top + ABOVE - tip)

    @cached_property
    def over_well(self) -> Rise:
        """How the tool goes straight up from a feeder."""
        length = max(OVER_WELL, self.top + 2 * ABOVE - self.show)
        return Rise(length / 2, length)

    def loads(self, label: str) -> list[tuple[Array, Array, Array]]:
        """The boxes of a part in the tool's frame, held with the tool's angle at 0: place, half
        sizes, quaternion."""
        solid = self.product.solids[label]
        middle, half = (solid.low + solid.high) / 2, (solid.high - solid.low) / 2
        place = down(0.0).T @ (middle - self.tip[label]) + [0.0, 0.0, STEM]
        return [(place, half, np.array([0.0, 1.0, 0.0, 0.0]))]

    def obstacles(self, arm: int, bare: Layout) -> Iterator[StandingBox]:
        """What stands in an arm's way, or may come there while it is on a transfer.

        Args:
            arm: the arm (index).
            bare: the layout without legs.
        """
        yield StandingBox("the floor", (-9.0, -9.0, -0.1), (9.0, 9.0, 0.0))
        yield self.carrier
        for label, well in self.wells.items():
            xlo, xhi, ylo, yhi = well.feeder.housing
            yield StandingBox(feeder_name(label), (xlo, ylo, 0.0), (xhi, yhi, well.feeder.high))
            yield from self._part(f"'{label}'", label, self.shown(label))
        for label in self.product.solids:
            yield from self._part(placed_name(label), label, self.placed)
        first = self.factory.first(0).label
        feeder = feeder_of(bare, first)
        for name, box, bottom in (
            ("post", feeder.post, 0.0),
            ("boom", feeder.boom, feeder.low),
            ("housing", feeder.housing, feeder.low),
        ):
            yield _upright(f"the {name} of '{first}'", box, bottom, feeder.high)
        for tool in self.tools.values():
            name = self.factory.robots[tool.robot].name
            yield _upright(name, tool.box, 0.0, tool.high)
        yield _upright("the outfeed's shed", bare.shed, 0.0, self.top + 0.06)
        yield _upright("the outfeed", bare.outfeed, 0.0, self.top)
        for other, stand in self.stands.items():
            if other != arm:
                name = self.factory.robots[other].name
                yield _upright(f"the base of {name}", _round(stand), 0.0, stand.place[2] + BASE)

    @property
    def carrier(self) -> StandingBox:
        """All that the carrier takes with the product on its line."""
        ends = [self.line.middle(x) for x in (self.line.reach, self.line.length)]
        low, high = sorted(end[0] for end in ends)
        side = max(float(self.half[1]), self.factory.carriage / 2)
        half, y = float(self.half[0]), ends[0][1]
        back = max(half, self.line.reach + self.factory.carriage / 2)
        return _upright(CARRIER, (low - back, high + half, y - side, y + side), 0.0, self.top)

    def _part(self, name: str, label: str, off: Array) -> Iterator[StandingBox]:
        """The boxes round the convex pieces of a part."""
        solid = self.product.solids[label]
        ends = [(piece.min(axis=0), piece.max(axis=0)) for piece in solid.pieces if solid.mesh]
        for low, high in ends or [(solid.low, solid.high)]:
            xlo, ylo, zlo = (low + off).tolist()
            xhi, yhi, zhi = (high + off).tolist()
            yield StandingBox(name, (xlo, ylo, zlo), (xhi, yhi, zhi))

    @cached_property
    def floor(self) -> Box:
        """The floor that the cell takes [m]."""
        xlo, xhi, ylo, yhi = self.rails.floor
        boxes = [well.feeder.housing for well in self.wells.values()]
        boxes += map(_round, self.stands.values())
        boxes += [tool.box for tool in self.tools.values()]
        c, path = self.rails.clearance, self.rails.guidepaths[0]
        further = path.middle(path.length)[0] - self.line.middle(self.line.length)[0]
        behind = xlo - further
        return (
            float(min(behind, *(b[0] for b in boxes))) - c,
            float(max(xhi, *(b[1] for b in boxes))) + c,
            float(min(ylo, *(b[2] for b in boxes))) - c,
            float(max(yhi, *(b[3] for b in boxes))) + c,
        )


SIDES = (1.0, -1.0)
"""The sides of the line on which arms stand."""

BASE = 0.24
"""Height of what of an arm stands above its pedestal, at least [m]."""

CARRIER = "the carrier"


def feeder_name(label: str) -> str:
    """What the feeder of a part is called."""
    return f"the feeder of '{label}'"


def placed_name(label: str) -> str:
    """What a part in the product is called."""
    return f"'{label}' in the product"


def _largest_pad(solid: Solid) -> PadPlace:
    """The largest pad that a part is level under; one of the least share for none."""
    for share in SHARES:
        place = pad_place(solid, (1.0, 0.0), largest=PAD_RADIUS, share=share)
        if place.level:
            break
    return place


def _round(stand: Stand) -> Box:
    """The square round a pedestal [m]."""
    x, y, _ = stand.place
    return x - PEDESTAL, x + PEDESTAL, y - PEDESTAL, y + PEDESTAL


def _upright(name: str, box: Box, low: float, high: float) -> StandingBox:
    xlo, xhi, ylo, yhi = map(float, box)
    return StandingBox(name, (xlo, ylo, float(low)), (xhi, yhi, float(high)))
