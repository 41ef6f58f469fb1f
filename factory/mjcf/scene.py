"""The scene: floor, light, cameras, and rails. Nothing here moves."""

from __future__ import annotations

from math import cos, hypot, radians, sin, tan
from xml.etree.ElementTree import Element

from factory.layout.dimensions import CARRIAGE, PAYLOAD
from factory.layout.layout import Layout
from factory.mjcf.elements import add, add_shown, add_station, fill, numbers
from factory.mjcf.names import COMPASS
from factory.mjcf.robots import heading_quaternion
from factory.mjcf.stops import robot_room

VIEW = 32.0
"""Vertical field of view of the cameras [degrees]: narrow, for a calm perspective. The free
camera's is the same (skeleton.xml)."""

SHOE = 0.026
"""Half the length of the shoe of a carriage on its rail (mjcf/*.xml) [m]."""

FAR = 1e5
"""How far away the ends of the compass are [m]."""

GROUND = 0.1
"""Half the thickness of the floor [m]: spare copies are kept below it."""

OVERVIEW = radians(42), radians(-62)
"""From how high up and from how far around the overview camera looks [rad]."""

KEY, FILL = (0.40, 0.48, -0.78), (-0.65, 0.30, -0.70)
"""Directions of the two lights; the first casts the shadows."""


def add_scene(world: Element, statistic: Element, layout: Layout) -> None:
    """Everything that stands still, and how large it is."""
    x, y, radius = _floor(layout)
    fill(statistic, center=(x, y, 0.1), extent=radius)
    _floor_and_light(world, layout)
    _cameras(world, layout)
    for robot in range(len(layout.guidepaths)):
        _rail(world, layout, robot)


def _rail(world: Element, layout: Layout, robot: int) -> None:
    """A robot's rail, and a buffer at either end: its shoe meets it where the joint's limit
    begins (`stops.py`), its carriage passes over it."""
    name, path, room = (
        layout.factory.robots[robot].name,
        layout.guidepaths[robot],
        robot_room(layout.clearance),
    )
    (low, high), over = layout.ends(robot), CARRIAGE / 2 + room.stop
    face = SHOE + room.play
    for kind, start, end, (side, bottom, top) in (
        ("rail", low - over, high + over, (0.010, 0.0, 0.008)),
        ("buffer/A", low - over, low - face, (0.009, 0.008, 0.014)),
        ("buffer/B", high + face, high + over, (0.009, 0.008, 0.014)),
    ):
        add_shown(
            world,
            f"{name}/{kind}",
            "box",
            pos=(*path.carriage((start + end) / 2), (bottom + top) / 2),
            quat=heading_quaternion(path),
            size=((end - start) / 2, side, (top - bottom) / 2),
            material="rail" if kind == "rail" else "buffer",
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


def _aim(up: float, around: float, distance: float) -> tuple[tuple[float, float, float], str]:
    """Where a camera is that looks at the origin from so high up and from so far around [rad], and
    its axes."""
    right = (-sin(around), cos(around), 0.0)
    above = (-sin(up) * cos(around), -sin(up) * sin(around), cos(up))
    flat = distance * cos(up)
    return (flat * cos(around), flat * sin(around), distance * sin(up)), numbers((*right, *above))


def _cameras(world: Element, layout: Layout) -> None:
    x, y, _ = _floor(layout)
    at, axes = _aim(*OVERVIEW, look_distance(layout, 16 / 9))
    pos = (x + at[0], y + at[1], 0.05 + at[2])
    add(world, "camera", name="overview", pos=pos, xyaxes=axes, fovy=VIEW)
    xlo, xhi, ylo, yhi = layout.floor
    tall = max(yhi - ylo, (xhi - xlo) * 9 / 16) * 1.12 + 0.2
    pos = (x, y, tall / 2 / tan(radians(VIEW / 2)))
    add(world, "camera", name="top", pos=pos, xyaxes="1 0 0 0 1 0", fovy=VIEW)


def look_distance(layout: Layout, aspect: float) -> float:
    """How far the overview camera stands so that the floor fills the picture [m]."""
    xlo, xhi, ylo, yhi = layout.floor
    up, around = OVERVIEW
    wide = abs((xhi - xlo) * sin(around)) + abs((yhi - ylo) * cos(around))
    deep = abs((xhi - xlo) * cos(around)) + abs((yhi - ylo) * sin(around))
    tall = deep * sin(up) + 0.25 * cos(up)
    half = tan(radians(VIEW / 2))
    return max(tall / 2 / half, wide / 2 / half / aspect) * 1.04 + deep / 2 * cos(up) * 0.8


def add_follower(body: Element, layout: Layout) -> None:
    """The camera `product`, which rides with the output robot and looks at its nest."""
    size = float(max(layout.product.high - layout.product.low)) + 0.1
    at, axes = _aim(radians(32), radians(-125), 2.2 * size + 0.15)
    pos = (layout.guidepaths[0].reach + at[0], at[1], PAYLOAD + 0.3 * size + at[2])
    add(body, "camera", name="product", pos=pos, xyaxes=axes, fovy=VIEW)
