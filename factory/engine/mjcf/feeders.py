"""Feeders: a post, a boom, and a housing from which a slider brings parts down by a suction pad.

The housing is a box open below. Parts come into it unseen, and only there.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.elements import add_shown, add_station
from factory.engine.mjcf.masks import feeder_codes, masks_of
from factory.engine.mjcf.robots import MOTOR, Drive, add_drive, heading_quaternion
from factory.engine.mjcf.stops import stops_of
from factory.floor.geometry.suction import PadPlace
from factory.floor.layout.dimensions import BOOM, BOOM_HEIGHT, PAD, POST, WALL
from factory.floor.layout.feeding import housed_outlets, outlets_of
from factory.floor.layout.guidepath import Feeder
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.support.xml_writer import add

SLIDER_MASS = 0.4
"""Mass of a slider with its rod and pad [kg]."""

ROD = 0.003
"""Radius of a slider's rod where the pad is not smaller [m]."""

OVER = 0.01
"""How far a rod stands out of its housing at least [m]."""

RUBBER = (0.20, 0.22, 0.25, 1.0)

Point3 = tuple[float, float, float]

Shape = tuple[str, Point3, Point3, str]
"""A box that stands: its kind, its place and half its sizes [m], its material."""


def add_feeders(
    world: Element,
    actuator: Element,
    layout: Layout,
    hanging: Hanging,
    drives: Mapping[str, Drive],
) -> None:
    """The feeders of a layout, with their sliders and the drives of these, by labels."""
    outlets = outlets_of(layout)
    codes = feeder_codes(layout.factory, outlets)
    housed = {outlet.label for outlet in housed_outlets(layout)}
    for outlet in outlets:
        at, feeder = outlet.label, outlet.feeder
        if not (at in housed or at in hanging.places):
            continue
        path = layout.guidepaths[outlet.robot]
        x, y = layout.meeting(outlet.leaf)
        body = add(
            world,
            "body",
            name=names.feeder(at),
            pos=(x, y, 0.0),
            quat=heading_quaternion(path),
        )
        if at in housed:
            shapes = _well(feeder) if feeder.rises else _housing(feeder, path.left)
            for kind, where, size, material in shapes:
                add_station(
                    body, f"{names.feeder(at)}/{kind}", pos=where, size=size, material=material
                )
        if at not in hanging.places:
            continue
        place, code = hanging.places[at], codes[outlet.robot]
        end = OVER if feeder.rises else feeder.high + OVER
        joint = _add_slider(body, at, end, place, code)
        low, high = sorted((hanging.lowest(at), feeder.stroke))
        stops = stops_of(low, high, layout.clearance)
        add_drive(actuator, joint, drives[at], stops)


def _well(feeder: Feeder) -> list[Shape]:
    """What stands still where parts rise: a box open above, in a frame whose x is the heading."""
    rear, front, near, far = feeder.inside
    ahead, across = (rear + front) / 2, (near + far) / 2
    length, width = front - rear, far - near
    middle, half = (feeder.low + feeder.high) / 2, (feeder.high - feeder.low) / 2
    shapes: list[Shape] = [
        (
            "post",
            (ahead, across, feeder.low / 2),
            (length / 2 + WALL, width / 2 + WALL, feeder.low / 2),
            "post",
        )
    ]
    return shapes + _walls(ahead, across, (length, width), middle, half)


def _walls(
    ahead: float, across: float, inside: tuple[float, float], middle: float, half: float
) -> list[Shape]:
    """The four walls round what is `inside`, of a length and a width [m]."""
    (length, width), shapes = inside, list[Shape]()
    for side in (-1, 1):
        along = ahead + side * (length + WALL) / 2, across, middle
        beside = ahead, across + side * (width + WALL) / 2, middle
        shapes.append((f"end{side}", along, (WALL / 2, width / 2 + WALL, half), "housing"))
        shapes.append((f"wall{side}", beside, (length / 2, WALL / 2, half), "housing"))
    return shapes


def _housing(feeder: Feeder, left: float) -> list[Shape]:
    """What stands still where parts come down, in a frame whose x is the heading."""
    rear, front, near, far = feeder.inside
    ahead, across = (rear + front) / 2, (near + far) / 2 * left
    length, width = front - rear, far - near
    low, top = feeder.low, feeder.high
    middle, half = (low + top - WALL) / 2, (top - WALL - low) / 2
    across_post = feeder.across * left
    boom = rear - WALL - feeder.back - POST / 2
    shapes: list[Shape] = [
        ("post", (feeder.back, across_post, top / 2), (POST / 2, POST / 2, top / 2), "post"),
        (
            "boom",
            (feeder.back + (POST + boom) / 2, across_post, top - BOOM_HEIGHT / 2),
            (boom / 2, BOOM / 2, BOOM_HEIGHT / 2),
            "post",
        ),
        (
            "lid",
            (ahead, across, top - WALL / 2),
            (length / 2 + WALL, width / 2 + WALL, WALL / 2),
            "housing",
        ),
    ]
    return shapes + _walls(ahead, across, (length, width), middle, half)


def _add_slider(feeder: Element, outlet: str, end: float, at: PadPlace, code: int) -> Element:
    """The slider, down where it presents the part of the outlet that it is named after; its joint,
    which is returned, goes up from there, and its rod to the height `end` [m]. The pad touches the
    part by design, and the rod its bearing in the lid: the one is masked as what the feeder holds,
    the other is only shown."""
    name = names.slider(outlet)
    body = add(feeder, "body", name=name, pos="0 0 0", sleep="allowed")
    slide = {"type": "slide", "axis": "0 0 1", "armature": MOTOR, "frictionloss": 0.2}
    joint = add(body, "joint", name=name, **slide)
    x, y, z = (float(v) for v in at.at)
    begin = z + PAD if end > z else z
    contype, conaffinity = masks_of(code)
    add(
        body,
        "geom",
        name=names.pad(outlet),
        type="cylinder",
        pos=(x, y, z + PAD / 2),
        size=(at.radius, PAD / 2),
        mass=SLIDER_MASS,
        contype=contype,
        conaffinity=conaffinity,
        rgba=RUBBER,
    )
    rod = f"{names.feeder(outlet)}/rod"
    add_shown(
        add(body, "body", name=rod),
        rod,
        "cylinder",
        pos=(x, y, (begin + end) / 2),
        size=(min(ROD, 0.6 * at.radius), abs(end - begin) / 2),
        material="rail",
    )
    return joint
