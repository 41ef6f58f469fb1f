"""The scene: floor, light, cameras, and rails. Nothing here moves."""

from __future__ import annotations

from itertools import pairwise, product
from math import atan2, cos, dist, hypot, sin
from xml.etree.ElementTree import Element

import numpy as np

from factory.engine.mjcf.elements import add_shown, add_station
from factory.engine.mjcf.names import COMPASS
from factory.engine.mjcf.robots import heading_quaternion
from factory.floor.layout.dimensions import PAYLOAD, Clearance
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.floor.layout.tiles import tiles_of
from factory.support.arrays import Array
from factory.support.pictures.sight import Framing, View, fit, towards
from factory.support.xml_writer import add, fill, numbers

VIEW = 32.0
"""Vertical field of view of the cameras [degrees]: narrow, for a calm perspective. The free
camera's is the same (skeleton.xml)."""

SHOE = 0.026
"""Half the length of the shoe of a carriage on its rail (mjcf/*.xml) [m]."""

TILE_TOP = 0.005
"""How high the top of a platen's tiles is [m]: below the shoes of carriages."""

SEAM = 0.002
"""Half the seam between two tiles [m]."""

RAIL = 0.010, 0.008
"""Half the width of a rail, and its height [m]."""

CORNER = 8
"""Straight pieces in which the corner of a rail is drawn, each as much longer at its ends as `LAP`
[m]."""

LAP = 0.002

FAR = 1e5
"""How far away the ends of the compass are [m]."""

GROUND = 0.1
"""Half the thickness of the floor [m]: spare copies are kept below it."""

OVERVIEW, TOP = (-62.0, 42.0), (-90.0, 90.0)
"""From how far around and from how high up the cameras look that see all [degrees]."""

FRAMING = Framing(4 / 3, 0.05, 0.05, 0.05, VIEW)
"""What they see is in the frame of a window of this shape, or a wider one."""

KEY, FILL = (0.40, 0.48, -0.78), (-0.65, 0.30, -0.70)
"""Directions of the two lights; the first casts the shadows."""


def add_scene(world: Element, statistic: Element, layout: Layout) -> None:
    """Everything that stands still, and how large it is."""
    overview = _cameras(world, layout)
    # The engine's free camera begins 1.5 extents away from the centre, where the overview is.
    center = overview.position + overview.distance * overview.axes[2]
    fill(statistic, center=tuple(center.tolist()), extent=overview.distance / 1.5)
    _floor_and_light(world, layout)
    for robot, path in enumerate(layout.guidepaths):
        if path.travels and not layout.tile:
            _rail(world, layout, robot)
    _tiles(world, layout)


def _tiles(world: Element, layout: Layout) -> None:
    """The tiles of a platen, below all that floats over them."""
    for number, (xlo, xhi, ylo, yhi) in enumerate(tiles_of(layout), start=1):
        add_shown(
            world,
            f"tile/{number}",
            "box",
            pos=((xlo + xhi) / 2, (ylo + yhi) / 2, TILE_TOP / 2),
            size=((xhi - xlo) / 2 - SEAM, (yhi - ylo) / 2 - SEAM, TILE_TOP / 2),
            rgba="0.50 0.55 0.61 1",
        )


def _rail(world: Element, layout: Layout, robot: int) -> None:
    """A robot's rail, and a buffer at either end: its shoe meets it where the joint's limit
    begins (`stops.py`), its carriage passes over it."""
    name, path = layout.factory.robots[robot].name, layout.guidepaths[robot]
    room = Clearance(layout.clearance)
    (low, high), over = layout.ends(robot), layout.factory.carriage / 2 + room.stop
    face = SHOE + room.play
    if path.way:
        _bent_rail(world, name, path, (low - over, high + over))
    for kind, start, end, (side, bottom, top) in (
        ("rail", low - over, high + over, (RAIL[0], 0.0, RAIL[1])),
        ("buffer/A", low - over, low - face, (0.009, 0.008, 0.014)),
        ("buffer/B", high + face, high + over, (0.009, 0.008, 0.014)),
    )[bool(path.way) :]:
        add_shown(
            world,
            f"{name}/{kind}",
            "box",
            pos=(*path.carriage((start + end) / 2), (bottom + top) / 2),
            quat=heading_quaternion(path),
            size=((end - start) / 2, side, (top - bottom) / 2),
            material="rail" if kind == "rail" else "buffer",
        )


def _bent_rail(world: Element, name: str, path: Guidepath, span: tuple[float, float]) -> None:
    """The rail of a guidepath with bends, in straight pieces."""
    (side, top), round_ = RAIL, np.linspace(-path.rounding, path.rounding, CORNER + 1)
    corners = [at + off for at in path.all_corners for off in round_]
    ends = [path.carriage(x) for x in (span[0], *corners, span[1])]
    for number, ((x, y), (z, w)) in enumerate(pairwise(ends), start=1):
        half = atan2(w - y, z - x) / 2
        add_shown(
            world,
            f"{name}/rail/{number}",
            "box",
            pos=((x + z) / 2, (y + w) / 2, top / 2),
            quat=(cos(half), 0.0, 0.0, sin(half)),
            size=(dist((x, y), (z, w)) / 2 + LAP, side, top / 2),
            material="rail",
        )


def _floor(layout: Layout) -> tuple[float, float, float]:
    """The centre of the floor and half its diagonal [m]."""
    xlo, xhi, ylo, yhi = layout.floor
    return (xlo + xhi) / 2, (ylo + yhi) / 2, hypot(xhi - xlo, yhi - ylo) / 2


def _floor_and_light(world: Element, layout: Layout) -> None:
    x, y, radius = _floor(layout)
    add(
        world,
        "geom",
        name="floor",
        type="plane",
        size=(radius * 20, radius * 20, 0.1),
        material="floor",
        contype=0,
        conaffinity=0,
        castshadow=False,
    )
    # What is drawn is endless; what collides is a slab, since the engine tries every geom of every
    # awake body against a plane, but only what comes near against a box.
    ground = add(world, "body", name="ground", pos=(x, y, -GROUND))
    size = (radius * 20, radius * 20, GROUND)
    add_station(ground, "ground", size=size, group=3)
    _compass(world, layout)
    for name, ray, shadow, diffuse, specular in (
        ("key", KEY, True, "0.50 0.49 0.47", "0.12 0.12 0.12"),
        ("fill", FILL, False, "0.14 0.145 0.16", "0 0 0"),
    ):
        add(
            world,
            "light",
            name=name,
            type="directional",
            castshadow=shadow,
            dir=ray,
            pos=(x - ray[0] * 3 * radius, y - ray[1] * 3 * radius, -ray[2] * 3 * radius),
            diffuse=diffuse,
            specular=specular,
        )


def _compass(world: Element, layout: Layout) -> None:
    """Two specks far away at either end of the floor's longer side, which nothing sees or touches.
    The engine's broad phase boxes all bodies along the principal axes of the places of all geoms,
    and sweeps along the first: these make it an edge of the floor, so that the boxes are tight."""
    x, y, _ = _floor(layout)
    xlo, xhi, ylo, yhi = layout.floor
    east, north = (FAR, 0.0) if xhi - xlo >= yhi - ylo else (0.0, FAR)
    body = add(world, "body", name=COMPASS, pos=(x, y, 0.0))
    for side in (-1, 1):
        add_shown(
            body,
            f"{COMPASS}/{side}",
            "sphere",
            pos=(side * east, side * north, 0.0),
            size=0.001,
            rgba="0 0 0 0",
            group=3,
        )


def _cameras(world: Element, layout: Layout) -> View:
    """The cameras that see the whole factory; gives the view of the overview."""
    points = _corners(layout)
    views = {
        name: fit(points, towards(*angles), FRAMING)
        for name, angles in (("overview", OVERVIEW), ("top", TOP))
    }
    for name, view in views.items():
        pos = tuple(view.position.tolist())
        add(world, "camera", name=name, pos=pos, xyaxes=_xy(view.axes), fovy=VIEW)
    return views["overview"]


def _corners(layout: Layout) -> Array:
    """The corners of boxes round all that is in the factory (n, 3) [m]."""
    regions = layout.certificate.regions if layout.certificate else ()
    boxes = [(*region.box, *region.z) for region in regions] or [(*layout.floor, 0.0, PAYLOAD)]
    return np.array([corner for box in boxes for corner in product(box[:2], box[2:4], box[4:])])


def add_follower(body: Element, layout: Layout) -> None:
    """The camera `product`, which rides with the output robot and looks at its nest."""
    size = float(max(layout.product.high - layout.product.low)) + 0.1
    axes = towards(-125.0, 32.0)
    at = (2.2 * size + 0.15) * -axes[2]
    pos = (layout.guidepaths[0].reach + at[0], at[1], PAYLOAD + 0.3 * size + at[2])
    add(body, "camera", name="product", pos=pos, xyaxes=_xy(axes), fovy=VIEW)


def _xy(axes: Array) -> str:
    """The axes of a camera as a model has them."""
    return numbers(axes[:2].ravel().tolist())
