"""How long the outfeed takes: its tray takes a product into the shed, waits until that is shut, and
comes back."""

from __future__ import annotations

from math import sqrt

from factory.control.profile import SpeedProfile
from factory.layout.dimensions import BEHIND, PLAY
from factory.layout.layout import Layout
from factory.support.settings import Settings

CRUISE = 1.2
"""The tray's way is at least so many times what it takes to reach its speed and to brake: a drive
whose acceleration is reversed at once gets half as far again off its reference."""


def tray_profile(layout: Layout, settings: Settings) -> SpeedProfile:
    """The tray's speed and acceleration: on a short way less than it is allowed, so that it goes at
    one speed for a while."""
    acceleration = settings.outfeed_acceleration
    reached = sqrt(layout.outfeed_way * acceleration / CRUISE)
    return SpeedProfile(min(settings.outfeed, reached), acceleration)


def leaving(layout: Layout, settings: Settings) -> float:
    """How long a product takes from its dropoff until it is out of sight [s]."""
    profile = tray_profile(layout, settings)
    tray = profile.rest(layout.outfeed_way)
    shut = tray - profile.landing(BEHIND - PLAY) + _shutter(layout, settings)
    return max(tray, shut) + settings.tick


def away(layout: Layout, settings: Settings) -> float:
    """How long the outfeed takes from a product to the next [s]."""
    tray = tray_profile(layout, settings).rest(layout.outfeed_way)
    back = max(tray, _shutter(layout, settings)) + settings.tick
    return leaving(layout, settings) + back


def _shutter(layout: Layout, settings: Settings) -> float:
    return SpeedProfile(*settings.shutter_limits).rest(layout.shutter_stroke)
