"""Certify a layout: no two robots that are not coupled by a mode can touch, nor their payloads.

Guarantees nothing about how the layout was made, and uses nothing of it: regions are read from the
guidepaths and the parts' real geometry. Two regions in one layer have to be a clearance apart
unless they are never taken at once. They are not where a payload is *coupled*, on the way that it
goes in the mode of operation X alone, and the other region is that of a payload of another robot of
X, which is then in that very mode; nor where both are coupled, in modes that have a robot in
common; nor, of robots that have no operation in common (*crossing*), where the coordinated net
excludes or orders all places in which they are near (`exclusions`). A coupled pair in one mode is
looked at again: where the carrier brings a pile as well, the other waits at its standoff. Near
linear.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from itertools import product as combinations

import numpy as np
import shapely

from factory.floor.layout.certificate import (
    ALWAYS,
    HAND_BODY,
    LOADS,
    NAMES,
    OUTFEED,
    PAYLOAD_BODY,
    RAISED,
    STATIONS,
    Certificate,
    Exclusions,
    Fault,
    Region,
    Shared,
    fault,
)
from factory.floor.layout.crossings import embedding_faults, near
from factory.floor.layout.dimensions import BELT_GAP, FINGER_LOW, FINGER_TOP, PAYLOAD, PAYLOADS
from factory.floor.layout.exclusions import exclusions
from factory.floor.layout.guidepath import Box
from factory.floor.layout.layout import Layout, delivery
from factory.floor.layout.outfeed import dip_of, slot_of
from factory.floor.layout.sweeps import Pile, piles, regions
from factory.theory.plant.approaches import MARGIN
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import OperationId
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import ARM_LOW, ARM_TOP, CARRIAGE_TOP

TOLERANCE = 1e-6
"""Distances are compared to this [m]: a thousandth of what a layout is rounded to."""

EVEN = 1e-4
"""Products end at one height if they differ by no more than this [m]: the tray is 0.4 mm under the
lowest, and a run fails where it is 0.5 mm under one."""

MOST = 100
"""So many faults are listed; there is no use in more."""


def certify(layout: Layout) -> Certificate:
    """The clearance certificate of a layout, computed without anything of the search. Never raises;
    see `Certificate.holds`.

    Args:
        layout: the layout.
    """
    factory, (search, faults) = layout.factory, searched(layout)
    swept = search.swept
    faults = [fault for fault in faults if fault not in search.crossing]
    apart = Exclusions() if faults else exclusions(layout)
    if faults or apart.faults:
        faults += search.crossing
    top = max(region.z[1] for region in swept)
    return Certificate(
        layout.clearance,
        tuple(zip(NAMES, (0.0, CARRIAGE_TOP, PAYLOAD), (CARRIAGE_TOP, ARM_TOP, top), strict=True)),
        (
            ("carriages to arms", ARM_LOW - CARRIAGE_TOP),
            ("masts and arms to fingers", FINGER_LOW - ARM_TOP),
            ("masts and arms to payloads", PAYLOAD - ARM_TOP),
            ("fingers to payloads", PAYLOAD - FINGER_TOP),
            ("outfeed to payloads", BELT_GAP),
        ),
        tuple(robot.name for robot in factory.robots),
        tuple(operation.label for operation in factory.operations),
        tuple(swept),
        tuple(search.shared.values()),
        (*faults[:MOST], *apart.faults[:MOST]),
        search.pairs,
        apart,
        tuple(search.crossing),
    )


def searched(layout: Layout) -> tuple[ClearanceSearch, list[Fault]]:
    """The search among all regions of a layout, and all faults except machines that are near each
    other in two places of the net: of guidepaths, regions, waiting payloads, lowered payloads and
    the outfeed."""
    by_label = piles(layout.factory, layout.product)
    search = ClearanceSearch(layout, regions(layout, by_label))
    return search, [
        *islice(embedding_faults(layout), MOST),
        *islice(search.faults(), MOST),
        *islice(_standoffs(layout, by_label), MOST),
        *islice(_raised(layout, by_label), MOST),
        *_uneven(layout, by_label),
    ]


def separation(one: Box, other: Box) -> float:
    """The distance of two boxes [m]; negative: their depth of overlap."""
    x = max(other[0] - one[1], one[0] - other[1])
    y = max(other[2] - one[3], one[2] - other[3])
    if max(x, y) <= 0:
        return float(max(x, y))
    return float(np.hypot(max(x, 0.0), max(y, 0.0)))


class ClearanceSearch:
    """Finds the pairs of regions that are too near, and why some may be. `pairs`: number of pairs
    compared, a measure of work; `crossing`: the faults of robots without a common operation, which
    the coordinated net may keep apart."""

    def __init__(self, layout: Layout, swept: list[Region]) -> None:
        self.layout, self.swept = layout, swept
        self.shared: dict[tuple[int, int, int, int], Shared] = {}
        self.pairs = 0
        self.crossing = list[Fault]()
        self._members = [frozenset(o.robots) for o in layout.factory.operations]

    def faults(self) -> Iterator[Fault]:
        """Every pair that is too near without a reason."""
        for layer in range(len(NAMES)):
            here = [region for region in self.swept if region.layer == layer]
            for one, other in self.near(here):
                if not self.settled(one, other):
                    near = self._fault(one, other)
                    if self._cross(one, other):
                        self.crossing.append(near)
                    yield near

    def near(self, here: list[Region]) -> Iterator[tuple[Region, Region]]:
        """Pairs of one layer less than a clearance apart in plan: of different robots, or of a
        station and its own robot."""
        corners = np.array([region.box for region in here], float).reshape(-1, 4)
        cells = shapely.box(corners[:, 0], corners[:, 2], corners[:, 1], corners[:, 3])
        robot = np.array([region.robot for region in here])
        stands = np.isin([region.kind for region in here], STATIONS)
        least = max(self.layout.clearance - TOLERANCE, 0.0)
        for first, second in near(cells, "dwithin", least):
            self.pairs += len(first)
            kept = (robot[first] != robot[second]) | (stands[first] != stands[second])
            for i, j in zip(first[kept].tolist(), second[kept].tolist(), strict=True):
                yield here[i], here[j]

    def settled(self, one: Region, other: Region) -> bool:
        """Whether two regions near in plan are never taken together, or are apart in height."""
        kinds = {one.kind, other.kind}
        if one.robot == other.robot and OUTFEED in kinds:
            return self._serves(one) and self._serves(other)
        if one.robot == other.robot and HAND_BODY in kinds and not kinds.isdisjoint(RAISED):
            return True  # a feeder leaves room for the hand that takes its part (Layout.feeder)
        if not kinds.isdisjoint(RAISED) and kinds <= {*RAISED, *LOADS}:
            gap = max(one.z[0] - other.z[1], other.z[0] - one.z[1])
            return gap >= self.layout.clearance - TOLERANCE
        if not kinds <= {*LOADS}:
            return False
        return (
            self._joined(one, other)
            or self._joined(other, one)
            or self._in_turn(one, other)
            or self._over(one, other)
            or self._over(other, one)
        )

    def _cross(self, one: Region, other: Region) -> bool:
        """Whether both are regions of robots, not stations, without a common operation."""
        robots = self.layout.factory.robots
        mine, others = (robots[region.robot].operations for region in (one, other))
        return {one.kind, other.kind}.isdisjoint(STATIONS) and {*mine}.isdisjoint(others)

    def _serves(self, region: Region) -> bool:
        """Whether the outfeed may take a region in: itself, the robot under it, the released
        product."""
        return region.kind not in LOADS or self.layout.factory.drops(OperationId(region.mode))

    def _joined(self, one: Region, other: Region) -> bool:
        """Whether one is coupled in a mode of the other's robot."""
        if one.mode == ALWAYS or other.robot not in self._members[one.mode]:
            return False
        self._share(one, other, one.mode, one.mode)
        return True

    def _in_turn(self, one: Region, other: Region) -> bool:
        """Whether both are coupled, in modes with a robot in common."""
        if ALWAYS in (one.mode, other.mode):
            return False
        if self._members[one.mode].isdisjoint(self._members[other.mode]):
            return False
        self._share(one, other, one.mode, other.mode)
        return True

    def _over(self, one: Region, other: Region) -> bool:
        """Whether one is of a fixed robot over a station of the other's: that is below its tool, or
        they are near in space (`exclusions`)."""
        end = delivery(self.layout.factory, one.robot)
        if self.layout.factory.robots[one.robot].travels or end is None:
            return False
        if end.carrier != other.robot:
            return False
        self._share(one, other, end.index, end.index)
        return True

    def _share(self, one: Region, other: Region, first: int, second: int) -> None:
        pair = sorted(((one.robot, first), (other.robot, second)))
        (i, first), (j, second) = pair
        if (i, j, first, second) in self.shared:
            return
        robots, operations = self.layout.factory.robots, self.layout.factory.operations
        labels = dict.fromkeys(operations[number].label for number in (first, second))
        x, y = self.layout.meeting(operations[first])
        self.shared[i, j, first, second] = Shared(
            (robots[i].name, robots[j].name), tuple(labels), (round(x, 6), round(y, 6))
        )

    def _fault(self, one: Region, other: Region) -> Fault:
        c = self.layout.clearance
        gap = separation(one.box, other.box)
        names = [region.named(self.layout.factory) for region in (one, other)]
        measured = (
            f"are {gap * 1000:.1f} mm apart" if gap > 0 else f"overlap by {-gap * 1000:.1f} mm"
        )
        message = (
            f"{names[0]} and {names[1]} {measured} in the layer of {NAMES[one.layer]};"
            f" {c * 1000:g} mm are needed"
        )
        return fault(self.layout.factory, message, one, other, lacking=c - gap)


def _standoffs(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Faults where a carrier brings a pile itself: an input that waits at its standoff must be
    clear of the pile's way, and wait no farther away than where it comes from."""
    for operation in layout.factory.making:
        carrier = operation.template.carrier - 1
        if operation.before[carrier] == NOPART or len(operation.inputs) == 1:
            continue
        piles = _way(layout, by_label, operation, carrier)
        for slot, label in enumerate(operation.before):
            if slot == carrier or label == NOPART:
                continue
            guests = _way(layout, by_label, operation, slot)
            guest = guests[0]
            before, visit = layout.ways[operation.index, guest.robot]
            room = before.at - visit.at - layout.standoff(operation, slot)
            if room < -TOLERANCE:
                name = layout.factory.robots[guest.robot].name
                message = (
                    f"{name} waits for '{operation.label}' {-room * 1000:.1f} mm behind the last"
                    " station of its guidepath: it could never start"
                )
                yield fault(layout.factory, message, guest, lacking=-room)
            if slot != operation.lowered:
                pairs = combinations(piles, guests)
                yield from _met(
                    layout, *min(pairs, key=lambda pair: separation(pair[0].box, pair[1].box))
                )


def _raised(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Faults where a lowered input does not come above the other inputs."""
    for operation in layout.factory.making:
        if operation.lowered < 0:
            continue
        guest = operation.robots[operation.lowered]
        low = by_label[operation.before[operation.lowered]].z[0]
        low += layout.visits[operation.index, guest].elevation
        pile = layout.visits[operation.index, operation.carrier].elevation
        for robot, label in zip(operation.robots, operation.before, strict=True):
            if robot == guest or label == NOPART:
                continue
            over = low - by_label[label].z[1] - pile
            if over < MARGIN - TOLERANCE:
                name = layout.factory.robots[guest].name
                message = (
                    f"{name} comes {over * 1000:.1f} mm over '{label}' in '{operation.label}';"
                    f" {MARGIN * 1000:g} mm are needed"
                )
                here = Region(guest, PAYLOADS, PAYLOAD_BODY, by_label[label].box, by_label[label].z)
                yield fault(layout.factory, message, here, lacking=MARGIN - over)


def _uneven(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Faults where products of different units end at different heights: the tray takes all at
    one."""
    factory = layout.factory
    lows = {product: by_label[product].z[0] for product in factory.products}
    if len(lows) > 1:
        slot = slot_of(layout)
        lows = {product: low + dip_of(layout, slot, product) for product, low in lows.items()}
    lowest = min(lows, key=lows.__getitem__)
    for product, low in lows.items():
        if (above := low - lows[lowest]) > EVEN + TOLERANCE:
            message = (
                f"'{product}' ends {above * 1000:.2f} mm higher than '{lowest}', and the outfeed's"
                " tray takes both at one height: move its parts down"
            )
            yield fault(factory, message, factory.dropoff.carrier, lacking=above)


def _way(
    layout: Layout, by_label: Mapping[str, Pile], operation: Operation, slot: int
) -> list[Region]:
    """The region that a robot's payload sweeps in a mode before its gate opens."""
    robot = operation.robots[slot]
    label = operation.before[slot]
    before, visit = layout.ways[operation.index, robot]
    pile, end = by_label[label].carried(visit), visit.at + layout.standoff(operation, slot)
    return [
        Region(robot, PAYLOADS, PAYLOAD_BODY, box, pile.z, label, operation.index)
        for box in layout.guidepaths[robot].sweeps(pile.box, before.at, end)
    ]


def _met(layout: Layout, pile: Region, guest: Region) -> Iterator[Fault]:
    gap = separation(pile.box, guest.box)
    if gap >= layout.clearance - TOLERANCE:
        return
    waits, comes = (layout.factory.robots[region.robot].name for region in (guest, pile))
    label = layout.factory.operations[pile.mode].label
    message = (
        f"{waits}'s '{guest.label}' waits {gap * 1000:.1f} mm from the way of {comes}'s"
        f" '{pile.label}' in '{label}'; {layout.clearance * 1000:g} mm are needed"
    )
    yield fault(layout.factory, message, guest, pile, lacking=layout.clearance - gap)
