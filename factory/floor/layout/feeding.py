"""Feeders of a layout: where each robot's magazine stands, and when the robot may go on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot

from factory.floor.layout.dimensions import (
    BEAM,
    BOOM,
    BOOM_HEIGHT,
    FINGER,
    PAD,
    PAYLOAD,
    PLAY,
    POST,
    RISE,
    SIDE,
    Clearance,
)
from factory.floor.layout.guidepath import Feeder
from factory.floor.layout.layout import Layout
from factory.support.boxes import Extent, hull
from factory.theory.plant.operation import Operation


@dataclass(frozen=True, eq=False, slots=True)
class Outlet:
    """Where the feeder of a robot shows a part in a `layout`: the operation in which it is taken
    (`leaf`)."""

    layout: Layout
    leaf: Operation

    @property
    def label(self) -> str:
        """The label of the part."""
        return self.leaf.label

    @property
    def robot(self) -> int:
        """The robot (index) that takes it."""
        return self.leaf.carrier

    @property
    def feeder(self) -> Feeder:
        """Its feeder."""
        return feeder_of(self.layout, self.label)

    @property
    def elevation(self) -> float:
        """How far above its place in the product the part is taken [m]."""
        return self.layout.visits[self.leaf.index, self.robot].elevation


def outlets_of(layout: Layout) -> tuple[Outlet, ...]:
    """The outlets of a layout's feeders, one for each part, in the order of the factory's
    labels."""
    return tuple(Outlet(layout, leaf) for leaf in layout.factory.leaves)


def lines_of(layout: Layout) -> tuple[tuple[Outlet, ...], ...]:
    """The outlets of each robot's feeder (by index), in the order of its program."""
    by_label = {outlet.label: outlet for outlet in outlets_of(layout)}
    return tuple(
        tuple(by_label[label] for label in layout.magazine(robot))
        for robot in range(len(layout.factory.robots))
    )


def housed_outlets(layout: Layout) -> Iterator[Outlet]:
    """The outlets with a housing of their own: parts of one line that come down share that of its
    first part, those that rise do not."""
    for line in lines_of(layout):
        yield from line if line and line[0].feeder.rises else line[:1]


def feeder_of(layout: Layout, label: str) -> Feeder:
    """The feeder of a part: a housing over the place where the part is presented, and the post that
    carries it, behind the rear stop of the robot that it serves. Parts of one line share a housing,
    in which they hang with their tops at one height. Computed once."""
    return layout.kept(_feeder, label)


def _feeder(layout: Layout, label: str) -> Feeder:
    by_label, room = layout.factory.by_label, Clearance(layout.clearance).room
    operation = by_label[label]
    robot = operation.carrier
    if layout.chains and robot in layout.chains.robots:
        return layout.chains.feeder(label)
    path, shown = layout.guidepaths[robot], layout.magazine(robot)
    visit = layout.visits[operation.index, robot]
    middle, elevation = path.middle(visit.at), visit.elevation
    solids = [layout.product.solids[part] for part in shown]
    first, rises = layout.factory.robots[robot].operations[0], layout.rise(robot)
    highest = max(
        float(solid.high[2]) + (layout.visits[by_label[part].index, robot].elevation - elevation)
        for part, solid in zip(shown, solids, strict=True)
    )
    tallest = max(float(solid.high[2] - solid.low[2]) for solid in solids)
    rear, front, near, far = _shown(layout, robot)
    inside = rear - PLAY, front + PLAY, near - PLAY, far + PLAY
    housing = rear - SIDE, front + SIDE, near - SIDE, far + SIDE
    across, half = path.offset + path.aside, POST / 2
    hand, grip = layout.hand(robot), layout.grip(robot)
    c = Clearance(layout.clearance, layout.factory.carriage)
    back = -c.post(path.reach, min(rear, grip[0]) if grip else rear)
    if hand is not None and hand.kind.tall:
        top = max(hand.beam + BEAM, hand.places[0][2] + max(hand.radius, FINGER / 2))
        top += layout.visits[first, robot].height + rises - elevation
        room = max(room, round(top - highest + layout.clearance, 6))
        if hand.kind.hangs:
            across = round((near + far) / 2, 3)
    over = PAYLOAD + elevation - layout.product.low[2]
    low = float(over + highest) + room
    high_up = RISE * hypot(inside[1] - inside[0], inside[3] - inside[2])
    stroke = room + high_up + tallest
    x, y = visit.shift
    ahead, _, aside, _ = path.frame((x, x, y, y))
    return Feeder(
        back - ahead,
        across - aside,
        (inside[0] - ahead, inside[1] - ahead, inside[2] - aside, inside[3] - aside),
        path.world((back - half, back + half, across - half, across + half), middle),
        path.world((back, housing[0], across - BOOM / 2, across + BOOM / 2), middle),
        path.world(housing, middle),
        low,
        max(low - room + stroke + PAD + SIDE, low + BOOM_HEIGHT),
        stroke + (highest - float(layout.product.solids[label].high[2])),
    )


def passing(layout: Layout, leaf: Operation) -> float:
    """How far a feeder's robot goes until all its payloads are clear of any part that comes down
    next [m]."""
    if layout.chains and leaf.carrier in layout.chains.robots:
        return layout.chains.passing(leaf.index)
    return cleared(layout, leaf.carrier, layout.guidepaths[leaf.carrier].sideways)


def cleared(layout: Layout, robot: int, sideways: float) -> float:
    """The same for a robot that goes straight ahead from its feeder, or to its side t (+1), or to
    the other (-1)."""
    path, factory = layout.guidepaths[robot], layout.factory
    rear, _, low, high = hull(
        [
            path.frame(layout.held(robot, number, factory.operations[number].label))
            for number in factory.robots[robot].operations
            if factory.operations[number].carrier == robot and not factory.drops(number)
        ]
    )
    shown = _shown(layout, robot)
    ways = {0.0: shown[1] - rear, 1.0: shown[3] - low, -1.0: high - shown[2]}
    return ways[sideways] + layout.clearance


def _shown(layout: Layout, robot: int) -> Extent:
    """The box of everything that a robot's feeder presents, about the middle of its guidepath."""
    by_label = layout.factory.by_label
    boxes = [layout.held(robot, by_label[p].index, p) for p in layout.magazine(robot)]
    return layout.guidepaths[robot].frame(hull(boxes))
