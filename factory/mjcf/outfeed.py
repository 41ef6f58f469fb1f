"""The outfeed: a track under the output robot's A end, and a tray on it that takes a product away.

The tray holds a finished product as robots do, by a star of welds to a body that is heavy beside
any part. A product need not stand by itself, nor can it tip on the way out.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from factory.layout.dimensions import BELT_GAP, FINGER_TOP, PAYLOAD, TRAY
from factory.layout.layout import Layout, Point2
from factory.mjcf import names
from factory.mjcf.elements import add, add_shown, add_station
from factory.mjcf.robots import Drive, add_inertia

TRAY_MASS = 4.0
"""Mass of the empty tray [kg]."""

LEAST_WIDTH, SLENDEREST = 1e-5, 1e-7
"""Half the least width of tray and belt [m], and in half their length: of what is thinner the
engine cannot make out the inertia."""

Point3 = tuple[float, float, float]

SHED = (0.87, 0.88, 0.89, 1.0)


def add_tray(world: Element, actuator: Element, layout: Layout, drive: Drive) -> None:
    """The tray under the place where the output robot delivers, its joint and its drive."""
    x, y = layout.guidepaths[0].a
    xlo, xhi, ylo, yhi = layout.payloads[layout.factory.pag.root]
    body = add(world, "body", name=names.OUTFEED_TRAY, pos=(x, y, 0), sleep="allowed")
    slide = names.OUTFEED_SLIDE
    joint = add(body, "joint", name=slide, type="slide", axis="1 0 0", frictionloss=0.2)
    add_inertia(joint, drive)
    add_shown(
        body,
        names.OUTFEED_TRAY,
        "box",
        mass=TRAY_MASS,
        pos=((xlo + xhi) / 2, (ylo + yhi) / 2, PAYLOAD - BELT_GAP - TRAY / 2),
        size=(*_plate((xhi - xlo) / 2, (yhi - ylo) / 2), TRAY / 2 - 1e-4),
        material="tray",
    )
    gains = drive.attributes()
    add(actuator, "pid", name=names.OUTFEED_DRIVE, joint=slide, input="pos vel ff", **gains)


def add_outfeed(world: Element, layout: Layout) -> None:
    """A table with a track at the output robot's A end, into a shed."""
    xlo, xhi, ylo, yhi = layout.outfeed
    top = PAYLOAD - BELT_GAP - TRAY
    thick = (top - FINGER_TOP) * 0.8
    (x, y), half = ((xlo + xhi) / 2, (ylo + yhi) / 2), ((xhi - xlo) / 2, (yhi - ylo) / 2)
    body = add(world, "body", name="outfeed", pos=(x, y, 0.0))
    size = (*_plate(*half), thick / 2)
    add_station(body, "outfeed/belt", pos=(0, 0, top - thick / 2), size=size, material="belt")
    tall = float(layout.product.high[2] - layout.product.low[2])
    length = layout.product_length + 0.1
    shed, wall = half[0] - length / 2, top + tall / 2 + 0.005
    shown: list[tuple[str, Point3, Point3]] = []
    for side in (-1, 1):
        rim = (x, y + side * (half[1] + 0.006), top - 0.008)
        shown.append((f"side{side}", rim, (half[0], 0.0055, 0.012)))
        for end in (-1, 1):
            foot = (x + end * (half[0] - 0.03), y + side * (half[1] - 0.008), (top - thick) / 2)
            shown.append((f"leg{side}{end}", foot, (0.006, 0.006, (top - thick) / 2)))
        beside = (x + shed, y + side * (half[1] + 0.0165), wall)
        shown.append((f"wall{side}", beside, (length / 2, 0.004, tall / 2 + 0.025)))
    roof = (x + shed + 0.002, y, top + tall + 0.0335)
    shown.append(("roof", roof, (length / 2 + 0.008, half[1] + 0.024, 0.004)))
    back = (x + half[0] + 0.0045, y, wall)
    shown.append(("back", back, (0.004, half[1] + 0.0205, tall / 2 + 0.025)))
    for name, pos, size in shown:
        look = {"material": "frame"} if name.startswith(("side", "leg")) else {"rgba": SHED}
        add_shown(world, f"outfeed/{name}", "box", pos=pos, size=size, **look)


def _plate(x: float, y: float) -> Point2:
    """Half the length and width of a plate under a product of these: the same, but of what is thin
    as dust or a thread."""
    least = max(LEAST_WIDTH, SLENDEREST * max(x, y))
    return max(x, least), max(y, least)
