"""The outfeed: a track under the output robot's A end, a tray on it that takes a product away, and
the shed into which it does. A shutter closes the shed before the product's bodies are used again.

The tray holds a finished product as robots do, by a star of welds to a body that is heavy beside
any part. A product need not stand by itself, nor can it tip on the way out.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.elements import add_station
from factory.engine.mjcf.masks import masks_of, tray_code
from factory.engine.mjcf.robots import MOTOR, Drive, add_drive
from factory.engine.mjcf.stops import stops_of, tray_clearance
from factory.floor.layout.dimensions import BELT_GAP, PAYLOAD, PLAY, TRAY, WALL
from factory.floor.layout.layout import Layout
from factory.floor.layout.outfeed import BELT, SLIT, dip_of, slot_of, slotted, table
from factory.support.boxes import Point2
from factory.support.xml_writer import add

TRAY_MASS = 4.0
"""Mass of the empty tray [kg]."""

LEAST_WIDTH, SLENDEREST = 1e-5, 1e-7
"""Half the least width of tray and belt [m], and in half their length: of what is thinner the
engine cannot make out the inertia."""

SHUTTER_MASS = 0.4
"""Mass of the shed's shutter [kg]."""

CRACK = 2e-5
"""Between the shutter and the walls before which it slides [m]: so narrow that no line of sight
through it gets to a product of less than 0.7 m."""


def add_outfeed(
    world: Element, actuator: Element, layout: Layout, tray: Drive, shutter: Drive
) -> None:
    """The belt at the output robot's A end and the shed that it leads into, then what moves: the
    tray under the place where the output robot delivers, and the shutter of the shed."""
    _add_table(world, layout)
    _add_tray(world, actuator, layout, tray)
    _add_shutter(world, actuator, layout, shutter)


def _add_tray(world: Element, actuator: Element, layout: Layout, drive: Drive) -> None:
    """It touches the product that it holds by design, so it is masked as what it holds. It is as
    much higher as a round bottom dips into its slot."""
    x, y = layout.guidepaths[0].a
    xlo, xhi, ylo, yhi = layout.outgoing
    body = add(world, "body", name=names.OUTFEED_TRAY, pos=(x, y, 0), sleep="allowed")
    slide = names.OUTFEED_SLIDE
    joint = add(body, "joint", name=slide, type="slide", axis="1 0 0", frictionloss=0.2)
    stops = stops_of(0.0, layout.outfeed_way, tray_clearance(layout))
    add_drive(actuator, joint, drive, stops, names.OUTFEED_DRIVE)
    contype, conaffinity = masks_of(tray_code(layout.factory))
    plate, slot = (xlo, xhi, ylo, yhi), slot_of(layout)
    low, high = PAYLOAD - BELT_GAP - TRAY + 1e-4, PAYLOAD - BELT_GAP - 1e-4 + dip_of(layout, slot)
    for number, (at, half) in enumerate(slotted(plate, slot), 1):
        add(
            body,
            "geom",
            name=names.OUTFEED_TRAY + (f"/{number}" if number > 1 else ""),
            type="box",
            mass=TRAY_MASS if number == 1 else 0,
            pos=(*at, (low + high) / 2),
            size=(*_plate(*half), (high - low) / 2),
            contype=contype,
            conaffinity=conaffinity,
            material="tray",
        )


def _add_shutter(world: Element, actuator: Element, layout: Layout, drive: Drive) -> None:
    """A plate before the mouth of the shed, up; its joint goes down from there."""
    start, _, ylo, yhi = layout.shed
    stroke = layout.shutter_stroke
    body = add(world, "body", name=names.SHUTTER, pos=(start, (ylo + yhi) / 2, 0), sleep="allowed")
    slide = {"type": "slide", "axis": "0 0 1", "armature": MOTOR, "frictionloss": 0.2}
    joint = add(body, "joint", name=names.SHUTTER, **slide)
    add_drive(actuator, joint, drive, stops_of(-stroke, 0.0, layout.clearance))
    thick = (WALL - CRACK) / 2
    low = BELT + SLIT + stroke
    add(
        body,
        "geom",
        name=names.SHUTTER,
        class_="station",
        type="box",
        mass=SHUTTER_MASS,
        pos=(thick, 0, low + (stroke + PLAY) / 2),
        size=(thick, (yhi - ylo) / 2, (stroke + PLAY) / 2),
        material="tray",
    )


def _add_table(world: Element, layout: Layout) -> None:
    """What stands of it."""
    xlo, xhi, ylo, yhi = layout.outfeed
    body = add(world, "body", name="outfeed", pos=((xlo + xhi) / 2, (ylo + yhi) / 2, 0.0))
    for name, pos, (length, width, height) in table(layout):
        belt, leg = name.startswith("belt"), name.startswith("leg")
        plan = _plate(length, width) if belt else (length, width)
        material = "belt" if belt else "frame" if leg else "housing"
        size = (*plan, height)
        add_station(body, f"outfeed/{name}", pos=pos, size=size, material=material)


def _plate(x: float, y: float) -> Point2:
    """Half the length and width of a plate under a product of these: the same, but of what is thin
    as dust or a thread."""
    least = max(LEAST_WIDTH, SLENDEREST * max(x, y))
    return max(x, least), max(y, least)
