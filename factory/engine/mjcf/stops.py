"""End stops: what keeps a carriage on its rail, a lift in its column, the tray on its track.

A stop is the limit of a joint, with a buffer before it. The engine sees in a step that a buffer is
touched only when it is: whatever is pushed there from rest with an acceleration a [m/s²] is a h² in
the buffer by then, whose damper takes all speed away in the next step. So the buffer has room for
that (docs/decisions/guides.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.layout import Layout
from factory.support.xml_writer import number, numbers

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


def tray_clearance(layout: Layout) -> float:
    """The clearance that sets how far beyond its ends the tray is stopped [m]: its track has half a
    clearance behind it to itself, so it may go twice as far as a robot."""
    return 2 * layout.clearance


def stops_of(low: float, high: float, clearance: float) -> Stops:
    """The stops of an axis beyond its ends, which may have a `clearance` to others [m]."""
    room = Clearance(clearance)
    return Stops(low - room.stop, high + room.stop, room.stop - room.play)
