"""Where things stand in a cell: the carriers' lines and their stations, arms on either side of the
first, and the feeders of each arm on a circle round its base."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import asin, cos, pi, sin

import numpy as np

from factory.api import Array, Diagnostic, Factory, Layout, Product, RunError, Solid
from factory.apps.arms.arming import RAILS
from factory.apps.arms.body import PEDESTAL, STEM, Stand
from factory.apps.arms.burdens import Burden, burden_of
from factory.apps.arms.cell import GAP, Well, down, shown_height, well_of
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.lines import LANE, Line, line_of, overlap
from factory.apps.arms.reach import Ring, ring_of
from factory.floor.geometry.suction import GAP as SUCTION_GAP
from factory.floor.layout.dimensions import PAYLOAD
from factory.floor.layout.guidepath import Box, Point2

CLOSER = 0.02
"""How much farther from an arm than the station its feeders are [m]."""

APART = 0.02
"""Between what stands beside each other [m]."""

FULL = pi - 0.1
"""Angle from the station up to which there are feeders on either side of an arm [rad]."""

TURN, CIRCLES = 0.04, 4
"""Between the angles that are tried for a feeder or a line [rad], and number of circles."""

FAR_OFF = 9.0
"""Longer than any line [m]."""

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
        factory: of carriers, tools that work on what these carry, and arms.
        rails: by carrier (index), the layout on rails of what it brings, whose line and hand it
            takes; the first brings the product.
        chain: the arms, to the tip of their tools.
        aside: least angle between the station and a feeder, as its arm sees them [rad].
        far: how far an arm stands from the station, as a share of the width of its ring.
        size: of the tools' pads, the number of those that some burden has room for.
    """

    factory: Factory
    rails: Mapping[int, Layout]
    chain: SerialChain
    aside: float = 0.0
    far: float = 0.41
    size: int = 0

    @property
    def product(self) -> Product:
        """The solids."""
        return self.rails[0].product

    @property
    def clearance(self) -> float:
        """Between what stands [m]."""
        return self.rails[0].clearance

    @cached_property
    def arms(self) -> tuple[int, ...]:
        """The arms (index)."""
        return tuple(robot.index for robot in self.factory.robots if robot.body.first.moves)

    def labels(self, arm: int) -> list[str]:
        """What an arm takes, in the order of its program."""
        operations = self.factory.operations
        return [operations[tour[0]].label for tour in self.factory.tours[arm]]

    @cached_property
    def arm_of(self) -> dict[str, int]:
        """The arm (index) that takes each part and sub-assembly."""
        return {label: arm for arm in self.arms for label in self.labels(arm)}

    @cached_property
    def burdens(self) -> dict[str, Burden]:
        """What the arms bring."""
        tours = (tour[0] for arm in self.arms for tour in self.factory.tours[arm])
        every = (burden_of(self.factory, self.product, first) for first in tours)
        return {burden.label: burden for burden in every}

    def names(self, label: str) -> list[str]:
        """All labels of what an arm brings: of the operations that change nothing of it, too."""
        contents, parts = self.factory.contents, {*self.burdens[label].parts}
        return [o.label for o in self.factory.making if {*contents[o.label]} == parts]

    @cached_property
    def half(self) -> Array:
        """Half the length and half the width of the product (2,) [m]."""
        return np.asarray((self.product.high - self.product.low)[:2] / 2)

    @cached_property
    def station(self) -> Point2:
        """The product's middle at the station of the first line [m]."""
        path = self.rails[0].guidepaths[0]
        return path.middle(path.reach + self.lane)

    @cached_property
    def lane(self) -> float:
        """From the station to the outfeed [m]."""
        return round(LANE + 2 * float(self.half[0]), 3)

    @cached_property
    def lines(self) -> dict[int, Line]:
        """The lines by carrier (index)."""
        lines, room = {**self._lines}, [well.feeder.housing for well in self.wells.values()]
        room += map(pedestal, self.stands.values())
        for carrier, line in self._lines.items():
            brought = (b for b in self.burdens.values() if b.onto == carrier)
            wide = max(float(np.linalg.norm((b.high - b.low)[:2])) for b in brought)
            others = [other for n, other in lines.items() if n != carrier]
            boxes = [box for other in others for box in (other.swept, *other.tool_boxes)]
            lines[carrier] = line.with_tools(wide / 2 + APART, [*room, *boxes])
        return lines

    @cached_property
    def _lines(self) -> dict[int, Line]:
        """The lines, their tools not placed yet: those of sub-assemblies end behind the arm, on its
        circle. Raises RunError (Layout) where there is no room for one."""
        lines = dict[int, Line]()
        for carrier, draft in self.drafts.items():
            if carrier:
                lines[carrier] = self._beside(draft, [*map(_behind, lines.values())])
            else:
                lines[carrier] = replace(draft, station=self.station, ahead=self.lane)
        return lines

    @cached_property
    def drafts(self) -> dict[int, Line]:
        """The lines by carrier (index), wherever they are."""
        return {
            carrier: line_of(self.factory, carrier, self.product, rails)
            for carrier, rails in self.rails.items()
        }

    def _beside(self, line: Line, taken: Sequence[Box]) -> Line:
        """A line where it is clear of others."""
        stand, radius = self.stands[self.arms[0]], self.near + CLOSER
        taken = [*taken, pedestal(stand)]
        for angle in np.arange(TURN, FULL, TURN).tolist():
            x, y, _ = stand.place
            turned = stand.yaw - angle
            u, v = line.off
            at = x + radius * cos(turned) - u, y + radius * sin(turned) - v
            placed = replace(line, station=(round(at[0], 6), round(at[1], 6)))
            if not any(overlap(_behind(placed), box) for box in taken):
                return placed
        message = f"the line of {line.name} has no room at its arm"
        raise RunError(Diagnostic("Layout", message, None, f"smaller parts; {RAILS}"))

    @cached_property
    def show(self) -> float:
        """Height at which the bottoms of parts are shown [m]."""
        fed = (b.solids[0] for b in self.burdens.values() if b.source is None)
        return shown_height([*fed], self.clearance)

    @cached_property
    def ring(self) -> Ring:
        """Where the arms stand, and between which distances from their axes they take and place.
        Raises RunError (Unreachable) where their tools do not come up and down far enough."""
        tips, low = list[float](), float(self.product.low[2])
        for label, tip in self.tip.items():
            burden, placed = self.burdens[label], PAYLOAD + float(tip[2]) - low
            fed = burden.source is None
            shown = self.show + float(tip[2] - burden.low[2]) if fed else placed
            tips += [shown, placed, shown + self.enters(label).length]
            tips += [shown + self.exits(label).length]
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
        return {label: well for arm in self.arms for label, well in self._places(arm)}

    def _places(self, arm: int) -> Iterator[tuple[str, Well]]:
        """The feeders of an arm: on a circle round it, the first ones next to the carrier's line;
        to the right and left of the station in turn, but with another arm opposite to the right as
        long as there is room: so the ways of both cross at the station alone."""
        stand, radius = self.stands[arm], self.near + CLOSER
        beside = max(float(self.half[1]), self.factory.carriage / 2) + self.clearance
        angles, taken = [0.0, 0.0], [*map(_behind, self._lines.values())]
        fed = [label for label in self.labels(arm) if self.burdens[label].source is None]
        for number, label in enumerate(fed):
            solid = self.product.solids[label]
            wide = float(np.linalg.norm((solid.high - solid.low)[:2])) / 2 + APART / 2
            pitch = asin(min(1.0, wide / radius))
            room = (self.near - beside - wide) / radius
            first = pi / 2 - asin(max(-1.0, min(1.0, room)))
            first = max(first, self.aside)
            preferred = number % 2
            if len(self.arms) > 1:
                preferred = int(max(angles[0] + pitch, first) + pitch > FULL)
            angle = max(angles[preferred] + pitch, first)
            well = self._well(solid, stand, radius, angle if preferred else -angle)
            if angle + pitch > FULL or self._meets(well, taken):
                yield label, (well := self._anywhere(solid, stand, first, taken))
            else:
                angles[preferred] = angle + pitch
                yield label, well
            taken.append(well.feeder.housing)

    def _anywhere(self, solid: Solid, stand: Stand, first: float, taken: Sequence[Box]) -> Well:
        """The feeder of a part where one has room, on circles round an arm. Raises RunError
        (Layout)."""
        circles = np.linspace(self.near + CLOSER, self.ring.outer, CIRCLES)
        for radius in circles.tolist():
            for angle in np.arange(first, FULL, TURN).tolist():
                for turned in (angle, -angle):
                    well = self._well(solid, stand, radius, turned)
                    if not self._meets(well, taken, APART):
                        return well
        message = f"the feeder of '{solid.label}' has no room round its arm"
        hint = "more arms, smaller parts, or rails: leave out --arm"
        raise RunError(Diagnostic("Layout", message, None, hint))

    @staticmethod
    def _meets(well: Well, taken: Sequence[Box], room: float = 0.0) -> bool:
        xlo, xhi, ylo, yhi = well.feeder.housing
        grown = xlo - room, xhi + room, ylo - room, yhi + room
        return any(overlap(grown, box) for box in taken)

    def _well(self, solid: Solid, stand: Stand, radius: float, angle: float) -> Well:
        """The feeder of a part on a circle round an arm, at an angle from the station [rad]."""
        x, y, _ = stand.place
        turned = stand.yaw + angle
        at = x + radius * cos(turned), y + radius * sin(turned)
        return well_of(solid, at, self.product, self.show, self.clearance)

    @cached_property
    def sizes(self) -> list[float]:
        """The radii of pads for which there is room on some burden [m]."""
        return sorted({round(float(burden.pad.radius), 4) for burden in self.burdens.values()})

    @property
    def pad(self) -> float:
        """Radius of the pads of the arms' tools, which may be larger than what they hold [m]."""
        return self.sizes[self.size]

    def covered(self, label: str) -> float:
        """Radius of what a pad covers of a burden [m]."""
        return min(self.pad, float(self.burdens[label].pad.radius))

    @cached_property
    def tip(self) -> dict[str, Array]:
        """Where an arm's tool is on each part, in the product's frame (3,) [m]."""
        off = np.array([0.0, 0.0, GAP - SUCTION_GAP])
        return {label: np.asarray(b.pad.at + off) for label, b in self.burdens.items()}

    @property
    def _foot(self) -> Array:
        """The place in the product's frame that comes to where the product's middle is, on the
        floor (3,) [m]."""
        return np.array([*self.product.middle[:2], self.product.low[2] - PAYLOAD])

    def shown(self, label: str) -> Array:
        """How far from its place in the product's frame what an arm brings is as the arm takes it
        (3,) [m]."""
        if (source := self.burdens[label].source) is not None:
            return self.placed(source)
        well = self.wells[label]
        return np.array([*well.place, well.elevation]) - self._foot

    def placed(self, carrier: int) -> Array:
        """How far a part is from its place in the product's frame at the station of a line
        (3,) [m]."""
        return np.array([*self.lines[carrier].station, 0.0]) - self._foot

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

    def _height(self, z: float) -> float:
        """Height of a place of the product's frame on a carrier [m]."""
        return PAYLOAD + z - float(self.product.low[2])

    def rises(self, label: str) -> Rise:
        """How what an arm brings comes straight down to its place, from where a carrier may still
        come and go."""
        burden = self.burdens[label]
        stroke = burden.join.approach.stroke if burden.join.approach else 0.0
        bottom = self._height(float(burden.low[2]))
        return Rise.of(max(stroke, self.drafts[burden.onto].top - bottom + ABOVE))

    def leaves(self, label: str) -> Rise:
        """How the empty tool goes straight up from where it has placed something."""
        tip = self._height(float(self.tip[label][2]))
        return Rise.of(self.drafts[self.burdens[label].onto].top + ABOVE - tip)

    def enters(self, label: str) -> Rise:
        """How the empty tool comes straight down to what it takes."""
        source = self.burdens[label].source
        if source is None:
            length = max(OVER_WELL, self.top + 2 * ABOVE - self.show)
            return Rise(length / 2, length)
        return Rise.of(self.drafts[source].top + ABOVE - self._height(float(self.tip[label][2])))

    def exits(self, label: str) -> Rise:
        """How it goes straight up with it."""
        burden = self.burdens[label]
        if burden.source is None:
            return self.enters(label)
        return Rise.of(self.drafts[burden.source].top + ABOVE - self._height(float(burden.low[2])))

    def loads(self, label: str) -> list[tuple[Array, Array, Array]]:
        """The boxes of what an arm brings in the tool's frame, held with the tool's angle at 0:
        place, half sizes, quaternion."""
        boxes = list[tuple[Array, Array, Array]]()
        for solid in self.burdens[label].solids:
            middle, half = (solid.low + solid.high) / 2, (solid.high - solid.low) / 2
            place = down(0.0).T @ (middle - self.tip[label]) + [0.0, 0.0, STEM]
            boxes.append((place, half, np.array([0.0, 1.0, 0.0, 0.0])))
        return boxes


SIDES = (1.0, -1.0)
"""The sides of the line on which arms stand."""


def pedestal(stand: Stand) -> Box:
    """The square round a pedestal [m]."""
    x, y, _ = stand.place
    return x - PEDESTAL, x + PEDESTAL, y - PEDESTAL, y + PEDESTAL


def _behind(line: Line) -> Box:
    """All that a line may take, wherever its tools and its feeder are; beside one that ends at an
    arm there is room for what the arm brings [m]."""
    (x, y), (low, high) = line.station, line.band
    room = APART if line.carrier else 0.0
    return x - FAR_OFF, x + line.ahead + line.extent[1] + room, y + low - room, y + high + room
