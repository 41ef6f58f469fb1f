"""How long the outfeed takes: its tray takes a product into the shed, waits until that is shut, and
comes back."""

from __future__ import annotations

from factory.control.profile import SpeedProfile
from factory.layout.dimensions import BEHIND, PLAY
from factory.layout.layout import Layout
from factory.support.settings import Settings


def leaving(layout: Layout, settings: Settings) -> float:
    """How long a product takes from its dropoff until it is out of sight [s]."""
    profile = SpeedProfile(settings.outfeed, settings.outfeed_acceleration)
    tray = profile.rest(layout.outfeed_way)
    shut = tray - profile.landing(BEHIND - PLAY) + _shutter(layout, settings)
    return max(tray, shut) + settings.tick


def away(layout: Layout, settings: Settings) -> float:
    """How long the outfeed takes from a product to the next [s]."""
    tray = SpeedProfile(settings.outfeed, settings.outfeed_acceleration).rest(layout.outfeed_way)
    back = max(tray, _shutter(layout, settings)) + settings.tick
    return leaving(layout, settings) + back


def _shutter(layout: Layout, settings: Settings) -> float:
    return SpeedProfile(*settings.shutter_limits).rest(layout.shutter_stroke)
