"""Where things stand in a cell: the carriers' lines and their stations, arms on either side of the
first, and the feeders of each arm on a circle round its base."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import asin, copysign, cos, pi, sin, sqrt

import numpy as np

from factory.api import Diagnostic, Dimensions, Operation, RunError, Solid
from factory.apps.arms.body import Stand
from factory.apps.arms.cell import Well, well_of
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.crew import RAILS
from factory.apps.arms.handling import Handling
from factory.apps.arms.lines import BEHIND, LANE, Line, depth, overlap, pedestal, wrist
from factory.apps.arms.reach import Ring, ring_of
from factory.support.arrays import Array
from factory.support.boxes import Box, Point2, hull
from factory.support.rotations import about_vertical

CLOSER = 0.02
"""How much farther from an arm than the station its feeders are [m]."""

APART = 0.02
"""Between what stands beside each other [m]."""

FULL = pi - 0.1
"""Angle from the station up to which there are feeders on either side of an arm [rad]."""

BOTH = 0.12
"""How much farther from the station tools are where arms stand on both sides [m]."""

TURN, CIRCLES = 0.04, 4
"""Between the angles that are tried for a feeder or a line [rad], and number of circles."""

WRIST_BACK = 0.2
"""How far an arm's wrist is behind the tip of its tool, about [m]."""

FAR_OFF = 9.0
"""Longer than any line [m]."""

SIDES = (1.0, -1.0)
"""The sides of the line on which arms stand."""


@dataclass(frozen=True, eq=False)
class Arrangement(Handling):
    """Where the arms, the lines of carriers and the feeders of a cell stand.

    Attributes:
        chain: the arms, to the tip of their tools.
        aside: least angle between the station and a feeder, as its arm sees them [rad].
        far: how far an arm stands from the station, as a share of the width of its ring.
    """

    chain: SerialChain
    aside: float
    far: float

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
        ahead = [
            self.rises(label).aside + BEHIND * burden.hold.normal[0]
            for label, burden in self.burdens.items()
            if not burden.onto and burden.comes[0] > 0
        ]
        return round(float(max([LANE, *ahead])) + 2 * float(self.half[0]), 3)

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
            near = wide / 2 + APART + BOTH * (len(self.arms) > 1)
            lines[carrier] = line.with_tools(near, [*room, *boxes])
        return lines

    @cached_property
    def _lines(self) -> dict[int, Line]:
        """The lines, their tools not placed yet: those of sub-assemblies end behind the arm, on its
        circle. Raises RunError (Layout) where there is no room for one."""
        lines = dict[int, Line]()
        for carrier, draft in self.drafts.items():
            if carrier:
                line = self._beside(draft, [*lines.values()])
            else:
                line = replace(draft, station=self.station, ahead=self.lane)
            steps = self._steps(line)
            ahead = max(line.ahead, *steps.values(), 0.0)
            lines[carrier] = replace(line, steps=steps, ahead=ahead)
        return lines

    def _steps(self, line: Line) -> dict[int, float]:
        """`Line.steps`: where the circle of an arm whose tool comes to one distance crosses the
        line. Raises RunError (Unreachable) where it does not."""
        steps = dict[int, float]()
        if not self.ring.is_circle:
            return steps
        for label, burden in self.burdens.items():
            if line.carrier in burden.stops:
                place = self.tip[label][:2] - self.product.middle[:2] + line.station
                x, y = (place - self.stands[self.arm_of[label]].place[:2]).tolist()
                if abs(y) >= self.ring.outer:
                    message = f"'{label}' is {1e3 * abs(y):.0f} mm from the axis of its arm, across"
                    message += f" the line of {line.name}; its tool comes to"
                    message += f" {1e3 * self.ring.outer:.0f} mm"
                    raise RunError(Diagnostic("Unreachable", message, burden.join.position, RAILS))
                along = copysign(sqrt(self.ring.outer**2 - y**2), x)
                steps[burden.stops[line.carrier].index] = along - x
        return steps

    def _span(self, line: Line) -> Box:
        """All that a line may take, wherever its tools and its feeder are; beside one that ends at
        an arm there is room for what the arm brings, and for its wrist [m]."""
        (x, y), (low, high) = line.station, line.band
        room = APART if line.carrier else 0.0
        ahead = x + line.ahead + line.extent[1] + room
        boxes = [(x - FAR_OFF, ahead, y + low - room, y + high + room)]
        for label in self._from_sides(line):
            at = np.array(line.station) + (self.tip[label] - self.product.middle)[:2]
            boxes.append(wrist(at, self.burdens[label].hold.normal))
        return hull(boxes)

    def _from_sides(self, line: Line) -> list[str]:
        """What an arm holds from a side where it places it on a line, or takes it from there."""
        carrier, burdens = line.carrier, self.burdens.values()
        there = [burden.label for burden in burdens if carrier in (burden.onto, burden.source)]
        return [label for label in there if not self.is_upright(label)]

    def _beside(self, line: Line, others: Sequence[Line]) -> Line:
        """A line where it is clear of others. Raises RunError (Layout)."""
        arm, radius, least = self.arms[0], self.round, (FAR_OFF, "")
        stand, (u, v) = self.stands[arm], line.off
        taken = {f"the line of {other.name}": self._span(other) for other in others}
        taken[f"the base of {self.factory.robots[arm].name}"] = pedestal(stand)
        for angle in np.arange(TURN, FULL, TURN).tolist():
            x, y, _ = stand.place
            turned = stand.yaw - angle
            at = x + radius * cos(turned) - u, y + radius * sin(turned) - v
            placed = replace(line, station=(round(at[0], 6), round(at[1], 6)))
            span = self._span(placed)
            worst = max((depth(span, box), name) for name, box in taken.items())
            if worst[0] <= 0.0:
                return placed
            least = min(least, worst)
        raise RunError(self._no_room(line, *least))

    def _no_room(self, line: Line, near: float, name: str) -> Diagnostic:
        """Says that a line would be so much too near to something at best [m]."""
        (pile,) = (b.takes for b in self.burdens.values() if b.source == line.carrier)
        _, _, low, high = self._span(line)
        label = pile.label.partition("/")[0]
        message = (
            f"the line of {line.name}, on which '{label}' is built, has no room at its arm: it is"
            f" {1e3 * (high - low):.0f} mm wide and at best {1e3 * near:.0f} mm too near to {name}"
        )
        hint = f"fewer sub-assemblies, smaller parts; {RAILS}"
        if sides := self._from_sides(line):
            message += f"; the arm has its wrist beside it for {', '.join(map(repr, sides))}"
            hint = f"parts that are lowered, or held on top; {hint}"
        return Diagnostic("Layout", message, pile.position, hint)

    @cached_property
    def ring(self) -> Ring:
        """Where the arms stand, and between which distances from their axes they take and place.
        Raises RunError (Unreachable) where their tools do not come up and down far enough."""
        tips = list[float]()
        for label, tip in self.tip.items():
            burden, placed = self.burdens[label], self._height(float(tip[2]))
            fed = burden.source is None
            shown = self.shows(label) + float(tip[2] - burden.low[2]) if fed else placed
            tips += [
                shown,
                placed,
                *(shown + e.up for e in (self.enters(label), self.exits(label))),
            ]
            tips += [placed + end.up for end in (self.rises(label), self.leaves(label))]
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

    @property
    def round(self) -> float:
        """Distance of the feeders from an arm's axis [m]."""
        return self.ring.outer if self.ring.is_circle else self.near + CLOSER

    @cached_property
    def stands(self) -> dict[int, Stand]:
        """Where the arms stand, to the left and right of the line in turn."""
        if len(self.arms) > len(SIDES):
            message = f"{len(self.arms)} arms have no room at one station"
            raise RunError(Diagnostic("Layout", message, None, f"at most {len(SIDES)}"))
        (x, y), off = self.station, self.near
        if self.ring.is_circle:
            x -= sqrt(self.round**2 - off**2)
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
        stand, radius = self.stands[arm], self.round
        beside = max(float(self.half[1]), self.factory.carriage / 2) + self.clearance
        angles, taken = [0.0, 0.0], [*map(self._span, self._lines.values())]
        fed = [label for label in self.labels(arm) if self.burdens[label].source is None]
        for number, label in enumerate(fed):
            solid = self.product.solids[label].presented()
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
            level = not self.is_upright(label)
            if level or angle + pitch > FULL or self._meets(self._room(label, well), taken):
                yield label, (well := self._anywhere(solid, stand, first, taken))
            else:
                angles[preferred] = angle + pitch
                yield label, well
            taken.append(self._room(label, well))

    def _anywhere(self, solid: Solid, stand: Stand, first: float, taken: Sequence[Box]) -> Well:
        """The feeder of a part where one has room, on circles round an arm. Raises RunError
        (Layout)."""
        circles = np.linspace(self.round, self.ring.outer, CIRCLES)
        wells = [
            self._well(solid, stand, radius, turned)
            for radius in circles.tolist()
            for angle in np.arange(first, FULL, TURN).tolist()
            for turned in (angle, -angle)
        ]
        if not self.is_upright(solid.label):
            wells.sort(key=lambda well: self._off_wrist(solid.label, well, stand))
        for well in wells:
            if not self._meets(self._room(solid.label, well), taken, APART):
                return well
        message = f"the feeder of '{solid.label}' has no room round its arm"
        hint = "more arms, smaller parts, or rails: leave out --arm"
        raise RunError(Diagnostic("Layout", message, None, hint))

    @staticmethod
    def _meets(taking: Box, taken: Sequence[Box], room: float = 0.0) -> bool:
        xlo, xhi, ylo, yhi = taking
        grown = xlo - room, xhi + room, ylo - room, yhi + room
        return any(overlap(grown, box) for box in taken)

    def _well(self, solid: Solid, stand: Stand, radius: float, angle: float) -> Well:
        """The feeder of a part on a circle round an arm, at an angle from the station [rad]."""
        x, y, _ = stand.place
        turned = stand.yaw + angle
        at = x + radius * cos(turned), y + radius * sin(turned)
        if self.ring.is_circle:  # the tool comes there, which is not in the part's middle
            u, v = (self.tip_shown(solid.label) - (solid.low + solid.high) / 2)[:2].tolist()
            at = at[0] - u, at[1] - v
        return well_of(solid, at, self.product, self.shows(solid.label), self.clearance)

    def _room(self, label: str, well: Well) -> Box:
        """What a feeder takes, and an arm that takes from it behind its tool [m]."""
        if self.is_upright(label):
            return well.feeder.housing
        return hull([well.feeder.housing, wrist(*self._face(label, well))])

    def _face(self, label: str, well: Well) -> tuple[Array, Array]:
        """Where an arm's tool is on a part in its feeder (2,) [m], and the normal there (2,)."""
        normal = about_vertical(self.burdens[label].fed) @ self.burdens[label].hold.normal
        at = self.tip_shown(label)[:2] - self.product.middle[:2] + well.place
        return np.asarray(at), np.asarray(normal[:2])

    def _off_wrist(self, label: str, well: Well, stand: Stand) -> float:
        """How far an arm's wrist behind its tool would be from the circle through the station where
        the tool is at a feeder, and how much across the arm the tool would lie there [m]."""
        at, normal = self._face(label, well)
        off = at + WRIST_BACK * normal - stand.place[:2]
        far = float(np.linalg.norm(off))
        return abs(far - self.near) + WRIST_BACK * (1 - abs(float(off @ normal)) / far)

    @property
    def _foot(self) -> Array:
        """The place in the product's frame that comes to where the product's middle is, on the
        floor (3,) [m]."""
        return np.array([*self.product.middle[:2], self.product.low[2] - Dimensions.PAYLOAD])

    def shown(self, label: str) -> Array:
        """How far from its place in the product's frame what an arm brings is as the arm takes it
        (3,) [m]."""
        burden = self.burdens[label]
        if burden.source is not None:
            return self.placed(burden.source, burden.takes)
        well = self.wells[label]
        return np.array([*well.place, well.elevation]) - self._foot

    def placed(self, carrier: int, operation: Operation | None = None) -> Array:
        """How far a part is from its place in the product's frame where a carrier stands in an
        operation, or else at the station of its line (3,) [m]."""
        return np.array([*self.lines[carrier].stand(operation), 0.0]) - self._foot

    def local(self, arm: int, place: Array) -> Array:
        """A place of the world in the frame of an arm's base (3,) [m]."""
        stand = self.stands[arm]
        c, s = cos(-stand.yaw), sin(-stand.yaw)
        x, y, z = place - stand.place
        return np.array([c * x - s * y, s * x + c * y, z])
