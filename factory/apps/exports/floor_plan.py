"""Shapes of a floor plan [m], shared by its drawings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from factory.api import Dimensions, Ground, Layout, LayoutMachines, Solid
from factory.apps.drawing.canvas import hexadecimal, hull
from factory.support.boxes import Box, Extent, Point2

JUNCTION = 0.008
"""Radius of the circle at a junction [m]."""


@dataclass(frozen=True, slots=True)
class Flat:
    """A shape in plan.

    Attributes:
        style: its kind.
        points: two opposite corners of a box, the middle of a circle, the ends of a line, or
            the corners of an area [m].
        radius: of a circle [m].
        box: whether it is a box.
        name: of a part, and of its feeder, its label; of a guidepath and a carriage that of the
            robot.
        paint: colour of a part, `#rrggbb`.
    """

    style: str
    points: tuple[Point2, ...]
    radius: float = 0.0
    box: bool = False
    name: str = ""
    paint: str = ""

    @classmethod
    def of_box(cls, style: str, box: Box) -> Flat:
        """A box."""
        return cls(style, ((box[0], box[2]), (box[1], box[3])), box=True)


def flat_shapes(layout: Layout) -> Iterator[Flat]:
    """The shapes of a layout, from the ground up: `floor`, each `tile`, `coupled` and `uncoupled`
    sweeps, `belt` with the `product` on it, `boom`, `post` and `housing` of feeders, `path` (where
    carriages go) and `last` (from there to A) of guidepaths, `finger`, `arm` and carriage (`dot`
    or `tool`) of robots at home, `part`, `junction`."""
    yield Flat.of_box("floor", layout.floor)
    yield from (Flat.of_box("tile", tile) for tile in Ground.tiles(layout))
    yield from _sweeps(layout)
    yield Flat.of_box("belt", layout.outfeed)
    leaves = layout.factory.leaves
    for leaf in leaves:
        yield part_outline(layout, leaf.label, layout.guidepaths[0].a, "product")
    for leaf in leaves:
        feeder = LayoutMachines(layout).feeder(leaf.label)
        for style, box in (
            ("boom", feeder.boom),
            ("post", feeder.post),
            ("housing", feeder.housing),
        ):
            yield replace(Flat.of_box(style, box), name=leaf.label)
    for robot, path in zip(layout.factory.robots, layout.guidepaths, strict=True):
        stop = path.carriage(path.reach)
        turns = [*map(path.corner, reversed(path.corners))]
        for leg in pairwise([path.carriage(path.length), *turns, stop]):
            yield Flat("path", leg, name=robot.name)
        yield Flat("last", (stop, path.a), name=robot.name)
    for robot in layout.factory.robots:
        yield from _robot(layout, robot.index, "tool" if robot.type == "tool" else "dot")
    for leaf in leaves:
        visit = layout.visits[leaf.index, leaf.carrier]
        at = layout.guidepaths[leaf.carrier].middle(visit.at)
        yield part_outline(layout, leaf.label, at, "part")
    for at in stations(layout):
        yield Flat("junction", (at,), JUNCTION)


def stations(layout: Layout) -> dict[Point2, list[str]]:
    """Junctions (x, y) [m], each with the operations that take place there, the last first."""
    junctions: dict[Point2, list[str]] = {}
    for operation in reversed(layout.factory.operations):
        if len(operation.robots) > 1:
            path = layout.guidepaths[operation.carrier]
            x, y = path.middle(layout.station(operation.index))
            junctions.setdefault((round(x, 6), round(y, 6)), []).append(operation.label)
    return junctions


def part_outline(layout: Layout, label: str, at: Point2, style: str) -> Flat:
    """Outline of a part in a product whose middle is at a point: a circle for spheres and upright
    cylinders."""
    solid, middle = layout.product.solids[label], layout.product.middle
    x, y = at[0] - float(middle[0]), at[1] - float(middle[1])
    paint = hexadecimal(solid.rgba)
    if _is_round(solid):
        centre = float(solid.position[0]) + x, float(solid.position[1]) + y
        return Flat(style, (centre,), solid.size[0], name=label, paint=paint)
    corners = hull(np.round(solid.corners[:, :2], 6))
    return Flat(style, tuple((px + x, py + y) for px, py in corners), name=label, paint=paint)


def _sweeps(layout: Layout) -> Iterator[Flat]:
    """Regions swept by payloads: the coupled ones first, so that those of every mode lie on top."""
    payloads = [region for region in LayoutMachines(layout).regions if region.is_payload]
    for style in ("coupled", "uncoupled"):
        boxes = (r.box for r in payloads if r.is_coupled == (style == "coupled"))
        yield from (Flat.of_box(style, box) for box in dict.fromkeys(boxes))


def _robot(layout: Layout, robot: int, style: str) -> Iterator[Flat]:
    path = layout.guidepaths[robot]
    half, rim, foot = layout.factory.carriage / 2, path.reach - path.arm, path.carriage(path.length)
    for limb in LayoutMachines(layout).limbs(robot):
        sides = sorted((limb.low[1] * path.left, limb.high[1] * path.left))
        box: Extent = (limb.low[0], limb.high[0], sides[0], sides[1])
        yield Flat.of_box("finger", path.world(box, foot))
    arm: Extent = (0.0, rim, -Dimensions.ARM_WIDTH / 2, Dimensions.ARM_WIDTH / 2)
    yield Flat.of_box("arm", path.world(arm, foot))
    carriage = Flat.of_box(style, path.world((-half, half, -half, half), foot))
    yield replace(carriage, name=layout.factory.robots[robot].name)


def _is_round(solid: Solid) -> bool:
    if solid.kind == "cylinder":
        _, x, y, _ = solid.quaternion
        return bool(abs(1 - 2 * (x * x + y * y)) > 1 - 1e-9)
    return solid.kind == "sphere"
