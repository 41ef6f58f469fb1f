"""What can be where: the regions that robots, payloads and stations sweep, read from a layout
alone.

A region is a rectangle in one layer, with the mode in which its robot is there. Everything below z0
may be anywhere on its guidepath in any mode. A payload is swept from goal to goal of its robot's
gear: *uncoupled* up to the last goal before it is delivered, *coupled* on its last way, which it
goes in the mode of one operation only, that of the carrier it delivers to. Stations stand where
they are in every mode.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.geometry.solids import Product
from factory.layout.dimensions import (
    ARM_LOW,
    ARM_TOP,
    ARM_WIDTH,
    ARMS,
    BOOM_HEIGHT,
    CARRIAGE,
    CARRIAGE_TOP,
    CARRIAGES,
    LAYERS,
    MAST,
    PAYLOAD,
    PAYLOADS,
)
from factory.layout.layout import Box, Extent, Guidepath, Layout
from factory.plant.factory import Factory
from factory.problem.pag import NOPART

NAMES = ("carriages", "masts and arms", "payloads")
"""The layers' names."""

KINDS = ("carriage", "mast", "arm", "payload", "post", "boom", "outfeed")
"""What a region is swept by; STATIONS are those that stand still."""

CARRIAGE_BODY, MAST_BODY, ARM_BODY, PAYLOAD_BODY, POST_BODY, BOOM, OUTFEED = range(len(KINDS))
STATIONS = (POST_BODY, BOOM, OUTFEED)

ALWAYS = -1
"""The mode of a region that is uncoupled."""


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle in one layer: which robot is there (a station counts to the robot it serves),
    with what, carrying which label, from z low to z high [m], a lift up, and in the mode of which
    operation, ALWAYS for an uncoupled region."""

    robot: int
    layer: int
    kind: int
    box: Box
    z: tuple[float, float]
    label: str = ""
    mode: int = ALWAYS


@dataclass(frozen=True, slots=True)
class Pile:
    """The real extents of a sub-assembly: its plan about the product's middle, its z range [m]."""

    box: Box
    z: tuple[float, float]

    def raised(self, height: float) -> Pile:
        """The same, so much higher [m]."""
        return Pile(self.box, (self.z[0] + height, self.z[1] + height))


def piles(factory: Factory, product: Product) -> dict[str, Pile]:
    """The extents of every label from its parts' solids, inputs before what is made of them."""
    x, y, _ = product.middle
    ground = float(product.low[2]) - PAYLOAD
    found: dict[str, Pile] = {}
    for operation in reversed(factory.operations[:-1]):
        inputs = [found[label] for label in operation.inputs]
        if not inputs:
            low, high = product.solids[operation.label].low, product.solids[operation.label].high
            inputs = [
                Pile(
                    (low[0] - x, high[0] - x, low[1] - y, high[1] - y),
                    (low[2] - ground, high[2] - ground),
                )
            ]
        found[operation.label] = Pile(
            hull([pile.box for pile in inputs]),
            (float(min(p.z[0] for p in inputs)), float(max(p.z[1] for p in inputs))),
        )
    return found


def hull(boxes: list[Box]) -> Box:
    """The bounding box of boxes."""
    xlo, xhi, ylo, yhi = zip(*boxes, strict=True)
    return float(min(xlo)), float(max(xhi)), float(min(ylo)), float(max(yhi))


def sweep(path: Guidepath, box: Box, start: float, end: float) -> Box:
    """What a box about the product's middle sweeps while the carriage goes from one arc length to
    another."""
    (x0, y0), (x1, y1) = path.middle(start), path.middle(end)
    return (
        min(x0, x1) + box[0],
        max(x0, x1) + box[1],
        min(y0, y1) + box[2],
        max(y0, y1) + box[3],
    )


def regions(
    layout: Layout, found: Mapping[str, Pile], robots: Collection[int] | None = None
) -> list[Region]:
    """Every region of a layout, robot by robot, or those of some robots. Linear in the sum of the
    gears' lengths."""
    result: list[Region] = []
    for robot in range(len(layout.guidepaths)) if robots is None else robots:
        result.extend(_bodies(layout, robot))
        result.extend(_payloads(layout, robot, found))
    chosen = None if robots is None else set(robots)
    for leaf in layout.factory.leaves:
        if chosen is None or leaf.carrier in chosen:
            result.extend(_feeder(layout, leaf.label, leaf.carrier))
    top = max(pile.z[1] for pile in found.values())
    result.extend(_upright(0, OUTFEED, layout.outfeed, top, ""))
    return result


def goals(layout: Layout, robot: int) -> list[float]:
    """The arc lengths at which a robot has its goals, in the order of its gear."""
    operations = layout.factory.operations
    return [
        layout.goal(number, operations[number].robots.index(robot))
        for number in layout.factory.robots[robot].operations
    ]


def _bodies(layout: Layout, robot: int) -> Iterator[Region]:
    """Carriage, mast and arm, anywhere on the guidepath."""
    path = layout.guidepaths[robot]
    stops = goals(layout, robot)
    start, end = min(path.reach, *stops), max(path.length, *stops)
    mast, width = (CARRIAGE_TOP, ARM_TOP), MAST / 2
    for kind, layer, half, ahead, side, z in (
        (CARRIAGE_BODY, CARRIAGES, CARRIAGE / 2, CARRIAGE / 2, CARRIAGE / 2, (0.0, CARRIAGE_TOP)),
        (MAST_BODY, ARMS, width, width, width, mast),
        (ARM_BODY, ARMS, 0.0, path.reach - path.arm, ARM_WIDTH / 2, (ARM_LOW, ARM_TOP)),
    ):
        foot: Extent = (-half, max(ahead, 0.0), -side, side)
        (x0, y0), (x1, y1) = path.carriage(start), path.carriage(end)
        one, other = path.world(foot, (x0, y0)), path.world(foot, (x1, y1))
        yield Region(robot, layer, kind, hull([one, other]), z)


def _payloads(layout: Layout, robot: int, found: Mapping[str, Pile]) -> Iterator[Region]:
    """Each pile from where it is taken or made to where the next operation has its goal."""
    path, operations = layout.guidepaths[robot], layout.factory.operations
    gear, stops = layout.factory.robots[robot].operations, goals(layout, robot)
    for step, number in enumerate(gear):
        operation = operations[number]
        label = operation.after[operation.robots.index(robot)]
        if label == NOPART:
            continue
        pile, at = found[label].raised(layout.elevations[robot]), stops[step]
        step = (step + 1) % len(gear)
        onward = operations[gear[step]]
        leaves = onward.after[onward.robots.index(robot)] == NOPART
        stand = sweep(path, pile.box, at, at if leaves else stops[step])
        yield Region(robot, PAYLOADS, PAYLOAD_BODY, stand, pile.z, label)
        if leaves:
            way = sweep(path, pile.box, at, stops[step])
            yield Region(robot, PAYLOADS, PAYLOAD_BODY, way, pile.z, label, onward.index)


def _feeder(layout: Layout, label: str, robot: int) -> Iterator[Region]:
    feeder = layout.feeder(label)
    height = feeder.height, feeder.height + BOOM_HEIGHT
    yield from _upright(robot, POST_BODY, feeder.post, height[1], label)
    yield Region(robot, PAYLOADS, BOOM, feeder.boom, height, label)


def _upright(robot: int, kind: int, box: Box, top: float, label: str) -> Iterator[Region]:
    """Something that stands in all layers."""
    for layer in LAYERS:
        yield Region(robot, layer, kind, box, (0.0, top), label)


def boxes(found: list[Region]) -> NDArray[np.float64]:
    """The boxes of regions (n, 4) [m]."""
    return np.array([region.box for region in found], float).reshape(-1, 4)
