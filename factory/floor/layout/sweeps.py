"""What can be where: the regions that robots, payloads and stations sweep, read from a layout
alone.

A region is a rectangle in one layer, with the mode in which its robot is there. Everything below z0
may be anywhere on its guidepath in any mode. A payload is swept from goal to goal of its robot's
gear: *uncoupled* up to the last goal before it is delivered, *coupled* on its last way, which it
goes in the mode of one operation only, that of the carrier it delivers to. Stations stand where
they are in every mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from factory.floor.geometry.solids import Product
from factory.floor.geometry.turning import turning_box
from factory.floor.layout.certificate import (
    ARM_BODY,
    BOOM,
    CARRIAGE_BODY,
    HAND_BODY,
    HOUSING,
    MAST_BODY,
    OUTFEED,
    PAYLOAD_BODY,
    POST_BODY,
    SHED,
    Region,
)
from factory.floor.layout.dimensions import (
    ARMS,
    BOOM_HEIGHT,
    CARRIAGES,
    LAYERS,
    PAYLOAD,
    PAYLOADS,
    SIDE,
)
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.hands.hand import ROOT
from factory.floor.layout.hands.limbs import cross_of
from factory.floor.layout.layout import Layout
from factory.floor.layout.visits import Visit
from factory.support.arrays import Array
from factory.support.boxes import Box, Extent, Point2, hull, moved
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import ARM_LOW, ARM_TOP, ARM_WIDTH, CARRIAGE_TOP, MAST


@dataclass(frozen=True, slots=True)
class Pile:
    """The real extents of a sub-assembly: its box about the product's middle, its z range [m]."""

    box: Box
    z: tuple[float, float]

    def moved(self, by: Point2) -> Pile:
        """The pile, displaced."""
        return Pile(moved(self.box, by), self.z)

    def carried(self, visit: Visit, middle: Point2 = (0.0, 0.0)) -> Pile:
        """The pile as a robot carries it on its tour with a visit, about the middle of its
        guidepath."""
        (x, y), (low, high) = visit.shift, self.z
        box = moved(self.box, (x + middle[0], y + middle[1]))
        return Pile(box, (low + visit.elevation, high + visit.elevation))


def piles(factory: Factory, product: Product) -> dict[str, Pile]:
    """The extents of every label from its parts' solids, inputs before what is made of them; of a
    part that is presented turned, in all its orientations until it is joined."""
    by_label, turning = dict[str, Pile](), dict[str, Pile]()
    for operation in reversed(factory.making):
        label, inputs = operation.label, [by_label[x] for x in operation.inputs]
        if not inputs:
            solid = product.solids[label]
            inputs = [_pile(product, solid.low, solid.high)]
            if solid.fed:
                turning[label] = _pile(product, *turning_box(solid))
        elif len(inputs) == 1 and operation.inputs[0] in turning:
            turning[label] = turning[operation.inputs[0]]
        by_label[label] = Pile(
            hull([pile.box for pile in inputs]),
            (float(min(p.z[0] for p in inputs)), float(max(p.z[1] for p in inputs))),
        )
    return by_label | turning


def _pile(product: Product, low: Array, high: Array) -> Pile:
    """The extents of what is in a box of the product, from low (3,) to high (3,)."""
    x, y, _ = product.middle
    ground = float(product.low[2]) - PAYLOAD
    (xlo, ylo, zlo), (xhi, yhi, zhi) = low, high
    return Pile((xlo - x, xhi - x, ylo - y, yhi - y), (zlo - ground, zhi - ground))


def piles_of(layout: Layout) -> Mapping[str, Pile]:
    """The piles of a layout. Computed once."""
    return layout.kept(_piles)


def _piles(layout: Layout) -> Mapping[str, Pile]:
    return piles(layout.factory, layout.product)


def regions(layout: Layout) -> list[Region]:
    """What robots, payloads and stations sweep, robot by robot. Linear in the sum of the gears'
    lengths.

    Args:
        layout: the layout.
    """
    result, by_label = list[Region](), piles_of(layout)
    for robot in range(len(layout.factory.robots)):
        result.extend(_bodies(layout, robot))
        result.extend(_payloads(layout, robot, by_label))
    for leaf in layout.factory.leaves:
        if leaf.label == layout.magazine(leaf.carrier)[0]:
            result.extend(_feeder(layout, leaf.label, leaf.carrier))
    result.extend(_outfeed(layout, by_label))
    return result


def _outfeed(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Region]:
    top = max(pile.z[1] for pile in by_label.values())
    yield from _upright(0, OUTFEED, layout.outfeed, top, "")
    yield from _upright(0, SHED, layout.shed, top + layout.shutter_stroke + 2 * SIDE, "")


def _bodies(layout: Layout, robot: int) -> Iterator[Region]:
    """Carriage, mast and arm, anywhere on the guidepath."""
    path, ends = layout.guidepaths[robot], layout.ends(robot)
    carriage = layout.factory.carriage / 2
    mast, width = (CARRIAGE_TOP, ARM_TOP), MAST / 2
    for kind, layer, half, ahead, side, z in (
        (CARRIAGE_BODY, CARRIAGES, carriage, carriage, carriage, (0.0, CARRIAGE_TOP)),
        (MAST_BODY, ARMS, width, width, width, mast),
        (ARM_BODY, ARMS, 0.0, path.reach - path.arm, ARM_WIDTH / 2, (ARM_LOW, ARM_TOP)),
    ):
        foot: Extent = (-half, max(ahead, 0.0), -side, side)
        for box in path.swept(foot, *ends):
            yield Region(robot, layer, kind, box, z)
    if any(across := cross_of(layout, robot)):
        rim, (low, high) = path.reach - path.arm, sorted(side * path.left for side in across)
        foot = rim - ROOT, rim, low, high
        for box in path.swept(foot, *ends):
            yield Region(robot, ARMS, ARM_BODY, box, (ARM_LOW, ARM_TOP))


def _payloads(layout: Layout, robot: int, by_label: Mapping[str, Pile]) -> Iterator[Region]:
    """Each pile, with the hand that holds it, from where it is taken or made to where the next
    operation has its goal."""
    path, operations = layout.guidepaths[robot], layout.factory.operations
    grip = layout.grip(robot)
    gear, stops = layout.factory.robots[robot].operations, layout.stops(robot)
    for step, number in enumerate(gear):
        operation = operations[number]
        label = operation.after[operation.robots.index(robot)]
        if label == NOPART:
            continue
        pile, at = by_label[label].carried(layout.visits[number, robot]), stops[step]
        step = (step + 1) % len(gear)
        onward = operations[gear[step]]
        leaves = onward.after[onward.robots.index(robot)] == NOPART
        found_here = [(PAYLOAD_BODY, pile)]
        if grip is not None:
            found_here.append((HAND_BODY, Pile(path.world(grip, (0.0, 0.0)), pile.z)))
        for kind, held in found_here:
            for box in path.sweeps(held.box, at, at if leaves else stops[step]):
                yield Region(robot, PAYLOADS, kind, box, held.z, label)
            for box in path.sweeps(held.box, at, stops[step]) if leaves else ():
                yield Region(robot, PAYLOADS, kind, box, held.z, label, onward.index)


def _feeder(layout: Layout, label: str, robot: int) -> Iterator[Region]:
    feeder = feeder_of(layout, label)
    yield from _upright(robot, POST_BODY, feeder.post, feeder.high, label)
    height = feeder.high - BOOM_HEIGHT, feeder.high
    yield Region(robot, PAYLOADS, BOOM, feeder.boom, height, label)
    yield Region(robot, PAYLOADS, HOUSING, feeder.housing, (feeder.low, feeder.high), label)


def _upright(robot: int, kind: int, box: Box, top: float, label: str) -> Iterator[Region]:
    """Something that stands in all layers."""
    for layer in LAYERS:
        yield Region(robot, layer, kind, box, (0.0, top), label)


def regions_of(layout: Layout, robot: int, by_label: Mapping[str, Pile]) -> Iterator[Region]:
    """The regions of one robot, with its feeder, or with the outfeed."""
    yield from _bodies(layout, robot)
    yield from _payloads(layout, robot, by_label)
    if shown := layout.magazine(robot):
        yield from _feeder(layout, shown[0], robot)
    if not robot:
        yield from _outfeed(layout, by_label)
