"""The scene: floor, light, cameras, guidepaths, feeders and the outfeed. Nothing here moves by
itself."""

from __future__ import annotations

from math import cos, hypot, radians, sin, tan
from xml.etree.ElementTree import Element

from factory.layout.dimensions import BOOM, BOOM_HEIGHT, CARRIAGE, PAYLOAD, POST
from factory.layout.layout import Layout
from factory.mjcf.elements import add, add_shown, add_station, fill, numbers
from factory.mjcf.names import COMPASS, feeder
from factory.mjcf.outfeed import add_outfeed
from factory.mjcf.robots import heading_quaternion

VIEW = 32.0
"""Vertical field of view of the cameras [degrees]: narrow, for a calm perspective. The free
camera's is the same (skeleton.xml)."""

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
    for robot, path in zip(layout.factory.robots, layout.guidepaths, strict=True):
        a, b = path.carriage(path.reach), path.carriage(path.length)
        middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, 0.004)
        half = path.travel / 2 + CARRIAGE / 2
        add_shown(
            world,
            f"{robot.name}/rail",
            "box",
            pos=middle,
            quat=heading_quaternion(path),
            size=(half, 0.010, 0.004),
            material="rail",
        )
    for operation in layout.factory.leaves:
        _feeder(world, layout, operation.label)
    add_outfeed(world, layout)


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


def _feeder(world: Element, layout: Layout, label: str) -> None:
    """A post behind the robot's rear stop and a boom over the place where the part is presented."""
    operation, found = layout.factory.by_label[label], layout.feeder(label)
    path, name = layout.guidepaths[operation.carrier], feeder(label)
    x, y = layout.meeting(operation)
    u, quat = path.heading, heading_quaternion(path)
    body = add(world, "body", name=name, pos=(x, y, 0.0), quat=quat)
    back, ahead, across = found.back, found.ahead, found.across * path.left
    top, beam = found.height, BOOM_HEIGHT
    post = (POST / 2, POST / 2, (top + beam) / 2)
    boom = ((ahead - back) / 2, BOOM / 2, beam / 2)
    for kind, at, size in (
        ("post", (back, across, (top + beam) / 2), post),
        ("boom", ((back + ahead) / 2, across, top + beam / 2), boom),
    ):
        add_station(body, f"{name}/{kind}", pos=at, size=size, material="post")
    for kind, along, z, shape, shown in (
        ("cap", back, top + beam, "box", (POST / 2 + 0.001, POST / 2 + 0.001, 0.002)),
        ("head", ahead, top + beam / 2, "cylinder", (0.012, beam / 2 + 0.002)),
    ):
        add_shown(
            world,
            f"{name}/{kind}",
            shape,
            pos=(x + along * u[0] - across * u[1], y + along * u[1] + across * u[0], z),
            quat=quat,
            size=shown,
            rgba=layout.product.solids[label].rgba,
        )
