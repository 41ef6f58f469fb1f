"""The shapes that stretching and packing work with: piles in the frame of the robot that carries
them, arms, lanes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from factory.geometry.solids import Product
from factory.layout.dimensions import Clearance
from factory.layout.layout import Box, Extent, Point2
from factory.layout.stretching import Shape, is_tool, up
from factory.layout.sweeps import hull
from factory.plant.factory import Factory

NOWHERE: Extent = (0.0, 0.0, 0.0, 0.0)


def payload_boxes(factory: Factory, product: Product) -> dict[str, Box]:
    """The plan of every sub-assembly about the product's middle, from its parts' real geometry."""
    x, y, _ = (float(v) for v in product.middle)
    found: dict[str, Box] = {}
    for operation in reversed(factory.operations[:-1]):
        if operation.inputs:
            found[operation.label] = hull([found[label] for label in operation.inputs])
            continue
        (xlo, ylo, _), (xhi, yhi, _) = (
            map(float, corner)
            for corner in (
                product.solids[operation.label].low,
                product.solids[operation.label].high,
            )
        )
        found[operation.label] = (xlo - x, xhi - x, ylo - y, yhi - y)
    return found


def symmetric_shapes(
    factory: Factory, payloads: Mapping[str, Box], c: Clearance
) -> Callable[[int], Shape]:
    """Shapes whose extents are the same in every direction, to choose the sides by."""

    def square(label: str) -> Extent:
        half = max(abs(edge) for edge in payloads[label])
        return (-half, half, -half, half)

    def shape(robot: int) -> Shape:
        piles = {n: square(factory.operations[n].label) for n in carried(factory, robot)}
        tool = is_tool(factory, robot)
        return Shape(piles, _last(piles), 0.0, c.rim, c.reach(c.rim), 0.0, tool)

    return shape


def exact_shapes(
    factory: Factory,
    payloads: Mapping[str, Box],
    axes: list[tuple[Point2, Point2]],
    c: Clearance,
    wide: Collection[int] = (),
) -> list[Shape]:
    """Shapes from the payloads as they lie in the world: parts never turn."""
    on = carriers(factory)
    return [
        oriented_shape(factory, payloads, robot, on[robot], *axes[robot], c, wide)
        for robot in range(len(factory.robots))
    ]


def oriented_shape(
    factory: Factory,
    payloads: Mapping[str, Box],
    robot: int,
    carrier: int,
    u: Point2,
    t: Point2,
    c: Clearance,
    wide: Collection[int] = (),
) -> Shape:
    """The shape of a robot that lies in a frame (u, t). Its arm ends beside the line of its
    carrier, which runs beside the product's middle as the carrier's last pile lies. `wide`: robots
    with room for relays, which run to either side of such a line."""
    numbers = carried(factory, robot)
    piles = {n: project(payloads[factory.operations[n].label], u, t) for n in numbers}
    last, tool = _last(piles), is_tool(factory, robot)
    held, lane, belt = last, 0.0, c.c - last[0]
    if carrier >= 0:
        made = factory.operations[factory.robots[carrier].operations[-2]].label
        along = project(payloads[made], u, t)
        lane, belt = -round((along[0] + along[1]) / 2, 3), 0.0
        lane += c.spread if carrier in wide else 0.0
    if tool:
        held = project(
            payloads[factory.operations[factory.robots[robot].operations[0]].label], u, t
        )
    arm = up(max(c.rim, c.rim + lane, belt))
    offset, nest = round((held[2] + held[3]) / 2, 3), round((held[0] + held[1]) / 2, 3)
    spread = c.spread if robot in wide else 0.0
    return Shape(piles, last, offset, arm, up(c.reach(arm, lane)), nest, tool, spread)


def carried(factory: Factory, robot: int) -> list[int]:
    """The operations of a robot after which it carries something, in its gear's order."""
    return [
        number
        for number in factory.robots[robot].operations
        if factory.operations[number].carrier == robot and number != factory.dropoff.index
    ]


def carriers(factory: Factory) -> list[int]:
    """For each robot the carrier it delivers to; -1 for the output robot."""
    return [
        -1 if robot.index == 0 else factory.operations[robot.operations[-1]].carrier
        for robot in factory.robots
    ]


def project(box: Box, u: Point2, t: Point2) -> Extent:
    """A box of the world in the frame (u, t), both along world axes."""
    along = sorted((box[0] * u[0] + box[2] * u[1], box[1] * u[0] + box[3] * u[1]))
    across = sorted((box[0] * t[0] + box[2] * t[1], box[1] * t[0] + box[3] * t[1]))
    return along[0], along[1], across[0], across[1]


def _last(piles: Mapping[int, Extent]) -> Extent:
    return list(piles.values())[-1] if piles else NOWHERE
