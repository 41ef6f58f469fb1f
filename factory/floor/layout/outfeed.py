"""The outfeed: the duration of its cycle (the tray carries a product into the shed, waits until
that is shut, and comes back), the slot in the tray for a round bottom, and what stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np

from factory.floor.layout.dimensions import (
    BEHIND,
    BELT_GAP,
    FINGER_TOP,
    PAYLOAD,
    PLAY,
    SLOT,
    TRAY,
    WALL,
    Clearance,
)
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.surfaces import Body, Surfaces
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array
from factory.support.boxes import Box, Point2
from factory.support.settings import Settings
from factory.theory.control.governed import GovernedAxis, Trajectory
from factory.theory.control.profile import SpeedProfile

CRUISE = 1.2
"""The tray's way is at least so many times what it takes to reach its speed and to brake: a drive
whose acceleration is reversed at once gets half as far again off its reference."""

NEAR = 1e-3
"""The tray is somewhere when it is within this [m]."""

FLAT = 1e-5
"""What dips no deeper stands flat [m]."""

BELT = PAYLOAD - BELT_GAP - TRAY
"""Height of the belt [m]."""

SLIT = 2e-4
"""Between the shutter when it is down and the belt [m]."""

UPRIGHT, LEG = 0.004, 0.006
"""Half the widths of the uprights on which the shutter slides, and of the legs [m]."""

Point3 = tuple[float, float, float]

Slab = tuple[str, Point3, Point3]
"""Something that stands: its name, its middle, and half its size [m]."""

HalfSpace = tuple[int, float, int]
"""All that is beyond a bound [m] on an axis, one way (+1, -1) along it."""


def tray_profile(layout: Layout, settings: Settings) -> SpeedProfile:
    """Speed and acceleration of the tray: below the limits on a short way, so that it moves at
    constant speed for a while."""
    acceleration = settings.outfeed_acceleration
    reached = sqrt(layout.outfeed_way * acceleration / CRUISE)
    return SpeedProfile(min(settings.outfeed, reached), acceleration)


def leaving(layout: Layout, settings: Settings) -> float:
    """Time from a dropoff until the product is out of sight [s]: the tray sets out a tick later,
    and the shutter comes down once the product is past it."""
    tray, shutter = _drives(layout, settings)
    way = tray.way(layout.outfeed_way)
    past = way.passes(BEHIND - PLAY)
    shut = past + _arrives(shutter.way(layout.shutter_stroke), settings)
    return (1 + max(_arrives(way, settings), shut)) * settings.tick


def away(layout: Layout, settings: Settings) -> float:
    """Time from one dropoff until the next may begin [s]."""
    tray, shutter = _drives(layout, settings)
    ways = tray.way(layout.outfeed_way), shutter.way(layout.shutter_stroke)
    back = max(_arrives(way, settings) for way in ways)
    return leaving(layout, settings) + back * settings.tick


def _drives(layout: Layout, settings: Settings) -> tuple[GovernedAxis, GovernedAxis]:
    """The drives of tray and shutter."""
    tray = tray_profile(layout, settings)
    limits = (tray.speed, tray.acceleration), settings.shutter_limits
    one, other = (GovernedAxis(speed, most, settings.tick, settings.lag) for speed, most in limits)
    return one, other


def _arrives(way: Trajectory, settings: Settings) -> int:
    """The tick in which the tray or its shutter is where it goes."""
    return way.rests(NEAR, NEAR / settings.tick)


def table(layout: Layout) -> Iterator[Slab]:
    """The belt, the shed's walls, roof and back, with uprights for the shutter, and the legs, about
    the middle of the outfeed's box: name, middle and half the size [m]."""
    xlo, xhi, ylo, yhi = layout.outfeed
    thick = (BELT - FINGER_TOP) * 0.8
    (x, y), half = ((xlo + xhi) / 2, (ylo + yhi) / 2), ((xhi - xlo) / 2, (yhi - ylo) / 2)
    mouth, back, low, high = layout.shed
    mouth += WALL
    stroke = layout.shutter_stroke
    top = BELT + SLIT + stroke + WALL
    length, width = back - mouth - WALL, high - low
    along, across = mouth + length / 2 - x, (low + high) / 2 - y
    end = mouth + length + WALL / 2 - x
    a, slot = layout.guidepaths[0].a, slot_of(layout)
    if slot is not None:
        slot = slot[0] + a[0] - x, slot[1] + a[1] - y, slot[2] + a[1] - y
    belt = -half[0], min(half[0], mouth + length - x - SLIT), -half[1], half[1]
    for number, (at, rest) in enumerate(slotted(belt, slot), 1):
        name = "belt" + (f"/{number}" if number > 1 else "")
        yield name, (*at, BELT - thick / 2), (*rest, thick / 2)
    yield "roof", (along, across, top - WALL / 2), (length / 2, width / 2 - WALL, WALL / 2)
    yield "back", (end, across, top / 2), (WALL / 2, width / 2, top / 2)
    for side in (-1, 1):
        beside = across + side * (width - WALL) / 2
        yield f"wall{side}", (along, beside, top / 2), (length / 2, WALL / 2, top / 2)
        upright = mouth + UPRIGHT - x, beside, top + stroke / 2
        yield f"upright{side}", upright, (UPRIGHT, WALL / 2, stroke / 2)
    leg, front = min(LEG, *half), layout.outgoing[1]
    for side in (-1, 1):
        foot = a[0] + front + 2 * leg - x, side * (half[1] - leg), (BELT - thick) / 2
        yield f"leg{side}", foot, (leg, leg, (BELT - thick) / 2)


def shed_with_uprights(layout: Layout) -> tuple[Box, float]:
    """The box of the shed with the uprights of its shutter, and the height of the top of these, or
    of the shutter where that is up [m]."""
    mouth, back, low, high = layout.shed
    top = max(at[2] + half[2] for _, at, half in table(layout)) + PLAY
    return (mouth - UPRIGHT, back, low, high), top


def slot_of(layout: Layout) -> tuple[float, float, float] | None:
    """The slot through which the output robot's hand comes up to the product, about the product's
    middle: its end, as far as the robot can be pushed, and its sides [m]; None if the hand is not
    below."""
    path, hand = layout.guidepaths[0], layout.hand(0)
    upright = [limb for limb in limbs(layout, 0) if limb.name.endswith(("column", "pad"))]
    if hand is None or not hand.kind.rises:
        return None
    ends = max(limb.high[0] for limb in upright) - path.reach + SLOT
    ends += Clearance(layout.clearance).stop
    low = min(limb.low[1] for limb in upright) + path.offset - SLOT
    return ends, low, max(limb.high[1] for limb in upright) + path.offset + SLOT


def dip_of(layout: Layout, slot: tuple[float, float, float] | None, label: str = "") -> float:
    """Depth of the product in the tray's slot [m]; in a mix of what touches the tray first, or of
    one product, by its label."""
    if slot is None:
        return 0.0
    (_, xhi, ylo, yhi), (end, low, high) = layout.outgoing, slot
    x, y = layout.product.middle[:2].tolist()
    beside = (1, y + low, -1, low - ylo), (1, y + high, 1, yhi - high), (0, x + end, 1, xhi - end)
    plates = [(axis, at, way) for axis, at, way, room in beside if room > SLOT]
    bodies, bottom = layout.product.kept(Surfaces).bodies, float(layout.product.low[2])
    if label:
        bodies = {part: bodies[part] for part in layout.factory.contents[label]}
        bottom = float(min(layout.product.solids[part].low[2] for part in bodies))
    return dip([body for of_part in bodies.values() for body in of_part], bottom, plates)


def slotted(plate: Box, slot: tuple[float, float, float] | None) -> list[tuple[Point2, Point2]]:
    """The rectangles, middles and half sizes, that make up a plate with a slot from its rear."""
    xlo, xhi, ylo, yhi = plate
    boxes = [plate]
    if slot is not None:
        end, low, high = slot
        boxes = [
            (xlo, xhi, ylo, low),
            (xlo, xhi, high, yhi),
            (end, xhi, max(low, ylo), min(high, yhi)),
        ]
        boxes = [box for box in boxes if min(box[1] - box[0], box[3] - box[2]) > SLOT] or [plate]
    return [
        (((x0 + x1) / 2, (y0 + y1) / 2), ((x1 - x0) / 2, (y1 - y0) / 2)) for x0, x1, y0, y1 in boxes
    ]


def dip(bodies: Sequence[Body], bottom: float, plates: list[HalfSpace]) -> float:
    """Height difference between the `bottom` of a product and the lowest point of its bodies over
    some level plates [m]; 0 where they are over none."""
    least = np.inf
    for body in sorted(bodies, key=lambda body: float(body.low[2])):
        if float(body.low[2]) >= least:
            break
        least = min(least, *(_lowest(body, *plate) for plate in plates), np.inf)
    deep = least - bottom
    return deep if FLAT < deep < np.inf else 0.0


def _lowest(body: Body, axis: int, bound: float, way: int) -> float:
    """Lowest point of a body beyond a bound [m]; inf if it is not there."""
    beyond = way * (np.array([body.low, body.high])[:, axis] - bound)
    if beyond.max() <= 0:
        return np.inf
    if body.ball:
        middle, radius = (body.low + body.high) / 2, (body.high - body.low)[2] / 2
        short = max(0.0, -way * float(middle[axis] - bound))
        return float(middle[2] - np.sqrt(max(radius**2 - short**2, 0.0)))
    ends = body.edges
    far = way * (ends[:, :, axis] - bound)
    heights: Array = ends[:, :, 2]
    lowest = heights[far >= 0].min(initial=np.inf)
    crossing = far.prod(axis=1) < 0
    share = far[crossing, 0] / (far[crossing, 0] - far[crossing, 1])
    at = heights[crossing, 0] + share * (heights[crossing, 1] - heights[crossing, 0])
    return float(min(lowest, at.min(initial=np.inf)))
