"""A platen: a floor of square tiles over which robots go in both directions, so that guidepaths may
bend and a factory takes less floor."""

from __future__ import annotations

from dataclasses import replace

from factory.api import Ground, Hands, Layout, LayoutMachines, Pace, RunError, Settings
from factory.apps.platen.compacting import compacted
from factory.support.boxes import Point2


def on_platen(layout: Layout, pace: Pace, tile: float, wanted: Point2 | None = None) -> Layout:
    """A layout on tiles of a size [m], with the bends that were found for robots of a `pace`, and
    certified anew. Raises RunError (Layout) where it does not fit a floor of the wanted width and
    depth."""
    for made in reversed(compacted(layout, pace)):
        try:
            layout = LayoutMachines(made).certified()
            break
        except RunError:  # the search knows regions only; the one before takes a little more
            continue
    return LayoutMachines(replace(layout, tile=tile)).certified(wanted)


def platen(layout: Layout, ground: Ground, settings: Settings, hands: Hands) -> Layout:
    """The variant of a layout on the tiles that a ground asks for. Raises RunError (Layout)."""
    assert ground.tile is not None
    return on_platen(layout, Pace.of(settings), ground.tile, ground.floor)
