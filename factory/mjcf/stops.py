"""End stops: what keeps a carriage on its rail, a lift in its column, the tray on its track.

A stop is the limit of a joint, with a buffer before it. The engine sees in a step that a buffer is
touched only when it is: whatever is pushed there from rest with an acceleration a [m/s²] is a h² in
the buffer by then, whose damper takes all speed away in the next step. So the buffer has room for
that (docs/decisions/guides.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from factory.layout.dimensions import Clearance
from factory.layout.layout import Layout
from factory.mjcf.elements import number, numbers

OVERLOAD = 5.0
"""A stop withstands a drive at full force and so many times its force besides."""


@dataclass(frozen=True, slots=True)
class Stops:
    """Where an axis is stopped, `low` and `high`, and how far before that its `buffers` begin
    [m]."""

    low: float
    high: float
    buffers: float

    def limit(self, joint: Element) -> None:
        """Give a joint these stops."""
        joint.set("range", numbers((self.low, self.high)))
        joint.set("margin", number(self.buffers))


def robot_room(clearance: float) -> Clearance:
    """The clearance that sets how far beyond its ends a robot is stopped, and its lift."""
    return Clearance(clearance)


def tray_room(clearance: float) -> Clearance:
    """The same of the tray: its track has half a clearance behind it to itself, so it may go twice
    as far as a robot."""
    return Clearance(2 * clearance)


def carriage_stops(layout: Layout, robot: int) -> Stops:
    """Of a robot's carriage, in arc length."""
    return _beyond(layout.ends(robot), robot_room(layout.clearance))


def lift_stops(stroke: float, clearance: float, low: float = 0.0) -> Stops:
    """Of a lift that is raised by a stroke, from as `low` as it gets [m]."""
    return _beyond((low, stroke), robot_room(clearance))


def tray_stops(layout: Layout) -> Stops:
    """Of the outfeed's tray."""
    return _beyond((0.0, layout.outfeed_way), tray_room(layout.clearance))


def shutter_stops(layout: Layout) -> Stops:
    """Of the shutter of the outfeed's shed, which goes down from 0."""
    return _beyond((-layout.shutter_stroke, 0.0), robot_room(layout.clearance))


def _beyond(ends: tuple[float, float], room: Clearance) -> Stops:
    return Stops(ends[0] - room.stop, ends[1] + room.stop, room.stop - room.play)
