"""Lay out a factory: choose sides with symmetric payloads, then stretch with the real ones.

Guarantees what `factory.layout.clearance` proves: no two robots that are not coupled by a mode can touch,
nor their payloads. All lengths are whole millimetres, so that a written model loses nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import ceil

from factory.errors import Diagnostic, RunError
from factory.factory import Factory
from factory.geometry import Product
from factory.layout.dimensions import CARRIAGE, Clearance
from factory.layout.plan import Box, Guidepath, Layout, Point2
from factory.layout.stretching import Extent, Shape, Sides, Stretched, is_tool, stretch, up

SHED = 0.1
"""Length of the open part of the outfeed beyond the product, and of what its end has to spare [m]."""


def lay_out(
    factory: Factory,
    product: Product,
    clearance: float = 0.02,
    floor: Point2 | None = None,
) -> Layout:
    """The layout of a factory. Raises RunError (Layout) where it does not fit a floor of the given width
    and depth, saying by how much and where."""
    c = Clearance(clearance)
    payloads = payload_boxes(factory, product)
    tools = [is_tool(factory, robot.index) for robot in factory.robots]
    sides = stretch(factory, _symmetric(factory, payloads, tools, c), c).sides
    axes = headings(factory, sides)
    shapes = exact_shapes(factory, payloads, axes, sides, tools, c)
    stretched = stretch(factory, shapes.__getitem__, c, sides)
    guidepaths = _embed(factory, axes, shapes, stretched, sides, c)
    outfeed = _outfeed(guidepaths[0], shapes[0].last, c)
    tree = stretched.subtrees[0]
    b = guidepaths[0].middle(guidepaths[0].length)
    xlo, xhi = b[0] + min(tree.back), outfeed[1]
    ylo, yhi = min(b[1] + min(tree.low), outfeed[2]), max(b[1] + max(tree.high), outfeed[3])
    layout = Layout(
        factory,
        product,
        clearance,
        guidepaths,
        tuple(stretched.stations),
        payloads,
        outfeed,
        (xlo, xhi, ylo, yhi),
    )
    if floor is not None:
        _check_floor(layout, floor)
    return layout


def payload_boxes(factory: Factory, product: Product) -> dict[str, Box]:
    """The plan of every sub-assembly about the product's middle, from its parts' real geometry."""
    x, y, _ = product.middle
    boxes: dict[str, Box] = {}
    for operation in reversed(factory.operations[:-1]):
        if operation.inputs:
            parts = [boxes[label] for label in operation.inputs]
            boxes[operation.label] = (
                min(b[0] for b in parts),
                max(b[1] for b in parts),
                min(b[2] for b in parts),
                max(b[3] for b in parts),
            )
        else:
            solid = product.solids[operation.label]
            low, high = solid.low, solid.high
            boxes[operation.label] = (
                float(low[0] - x),
                float(high[0] - x),
                float(low[1] - y),
                float(high[1] - y),
            )
    return boxes


def _symmetric(
    factory: Factory, payloads: Mapping[str, Box], tools: list[bool], c: Clearance
) -> Callable[[int], Shape]:
    """Shapes whose extents are the same in every direction, to choose the sides by."""

    def shape(robot: int) -> Shape:
        def square(label: str) -> Extent:
            half = max(abs(edge) for edge in payloads[label])
            return (-half, half, -half, half)

        piles = {
            number: square(factory.operations[number].label)
            for number in _carried(factory, robot)
        }
        last = list(piles.values())[-1] if piles else (0.0, 0.0, 0.0, 0.0)
        return Shape(piles, last, 0.0, c.rim, c.reach(c.rim), 0.0, tools[robot])

    return shape


def _carried(factory: Factory, robot: int) -> list[int]:
    return [
        number
        for number in factory.robots[robot].operations
        if factory.operations[number].carrier == robot and number != factory.dropoff.index
    ]


def headings(factory: Factory, sides: Sides) -> list[tuple[Point2, Point2]]:
    """(u, t) of each robot: a robot on side +1 of its carrier heads against the carrier's t."""
    axes: list[tuple[Point2, Point2]] = [((1.0, 0.0), (0.0, 1.0))] * len(factory.robots)
    for robot, carrier in enumerate(carriers(factory)):
        if carrier >= 0:
            (u, t), side = axes[carrier], sides[robot]
            axes[robot] = ((-side * t[0], -side * t[1]), u)
    return axes


def carriers(factory: Factory) -> list[int]:
    """For each robot the carrier it delivers to; -1 for the output robot."""
    return [
        -1 if robot.index == 0 else factory.operations[robot.operations[-1]].carrier
        for robot in factory.robots
    ]


def exact_shapes(
    factory: Factory,
    payloads: Mapping[str, Box],
    axes: list[tuple[Point2, Point2]],
    sides: Sides,
    tools: list[bool],
    c: Clearance,
) -> list[Shape]:
    """Shapes from the payloads as they lie in the world: parts never turn."""
    shapes: list[Shape] = []
    for robot, carrier in enumerate(carriers(factory)):
        u, t = axes[robot]
        numbers = _carried(factory, robot)
        piles = {n: project(payloads[factory.operations[n].label], u, t) for n in numbers}
        last = list(piles.values())[-1] if piles else (0.0, 0.0, 0.0, 0.0)
        held = _worked_on(factory, robot, carrier, sides, shapes) if tools[robot] else last
        lane = sides[robot] * shapes[carrier].offset if carrier >= 0 else 0.0
        arm = up(max(c.rim, c.rim + lane, c.c - last[0] if carrier < 0 else 0.0))
        shapes.append(
            Shape(
                piles,
                last,
                _millimetres((held[2] + held[3]) / 2),
                arm,
                up(c.reach(arm, lane)),
                _millimetres((held[0] + held[1]) / 2),
                tools[robot],
            )
        )
    return shapes


def _worked_on(
    factory: Factory, robot: int, carrier: int, sides: Sides, shapes: list[Shape]
) -> Extent:
    """The pile that a tool works on, in the tool's frame: its heading is against the carrier's side."""
    pile = shapes[carrier].piles[factory.robots[robot].operations[0]]
    along = sorted((-sides[robot] * pile[2], -sides[robot] * pile[3]))
    return along[0], along[1], pile[0], pile[1]


def project(box: Box, u: Point2, t: Point2) -> Extent:
    """A box of the world in the frame (u, t), both along world axes."""
    along = sorted((box[0] * u[0] + box[2] * u[1], box[1] * u[0] + box[3] * u[1]))
    across = sorted((box[0] * t[0] + box[2] * t[1], box[1] * t[0] + box[3] * t[1]))
    return along[0], along[1], across[0], across[1]


def _millimetres(length: float) -> float:
    return round(length, 3)


def _embed(
    factory: Factory,
    axes: list[tuple[Point2, Point2]],
    shapes: list[Shape],
    stretched: Stretched,
    sides: Sides,
    c: Clearance,
) -> tuple[Guidepath, ...]:
    """Places every robot, carriers first: its A is a station of its carrier."""
    paths: list[Guidepath] = []
    for robot, carrier in enumerate(carriers(factory)):
        u, t = axes[robot]
        a = (0.0, 0.0)
        if carrier >= 0:
            on = paths[carrier]
            station = stretched.stations[factory.robots[robot].operations[-1]]
            a = on.middle(on.length - station)
        shape = shapes[robot]
        paths.append(
            Guidepath(
                u,
                t,
                (_millimetres(a[0]), _millimetres(a[1])),
                stretched.travel[robot],
                shape.reach,
                shape.offset,
                shape.arm,
                shape.nest,
            )
        )
    return tuple(paths)


def _outfeed(path: Guidepath, last: Extent, c: Clearance) -> Box:
    """The conveyor: under the product at A and ahead, twice the product's length and some."""
    length = last[1] - last[0]
    u = (last[0] - c.c / 2, last[1] + length + 3 * SHED)
    return path.a[0] + u[0], path.a[0] + u[1], path.a[1] + last[2] - c.c, path.a[1] + last[3] + c.c


def _check_floor(layout: Layout, floor: Point2) -> None:
    xlo, xhi, ylo, yhi = layout.floor
    size = (xhi - xlo, yhi - ylo)
    if size[0] <= floor[0] and size[1] <= floor[1]:
        return
    excess = ", ".join(
        f"{size[i] - floor[i]:.3f} m too {word}"
        for i, word in ((0, "wide (along the output robot's path)"), (1, "deep (across it)"))
        if size[i] > floor[i]
    )
    message = f"the factory takes {size[0]:.3f} x {size[1]:.3f} m of floor: {excess}"
    longest = max(range(len(layout.guidepaths)), key=lambda i: layout.guidepaths[i].length)
    robot = layout.factory.robots[longest]
    hint = (
        f"the longest guidepath is that of {robot.name} ({layout.guidepaths[longest].length:.3f} m);"
        f" it fits --floor {ceil(size[0] * 100) / 100:g}x{ceil(size[1] * 100) / 100:g}"
    )
    raise RunError(Diagnostic("Layout", message, robot.position, hint))
