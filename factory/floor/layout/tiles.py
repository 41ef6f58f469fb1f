"""The square tiles of a platen under a layout."""

from __future__ import annotations

from math import ceil, floor

import numpy as np
import shapely

from factory.floor.layout.layout import Layout
from factory.floor.layout.presence import ROUNDING
from factory.floor.layout.sweeps import regions
from factory.support.arrays import Array
from factory.support.boxes import Box, Point2

SHIFTS = 12
"""So many places of the tiles' edges are tried along each axis."""


def tiles_of(layout: Layout) -> list[Box]:
    """The tiles that a layout on a platen needs, row by row: those under its regions, the fewest
    for the places of their edges that are tried. None without a platen."""
    if not layout.tile:
        return []
    boxes, size = _boxes(layout), layout.tile
    x, y = layout.floor[0], layout.floor[2]
    steps = [size * step / SHIFTS for step in range(SHIFTS)]
    choices = [_covered(boxes, (x - dx, y - dy), size) for dy in steps for dx in steps]
    return min(choices, key=len)


def fill_of(layout: Layout, tiles: list[Box]) -> float:
    """The share of tiles that regions lie over."""
    xlo, xhi, ylo, yhi = _boxes(layout).T
    area = shapely.union_all(shapely.box(xlo, ylo, xhi, yhi)).area
    return round(float(area) / (len(tiles) * layout.tile**2), 3)


def _boxes(layout: Layout) -> Array:
    """The regions of a layout (n, 4) [m]."""
    occupied = layout.certificate.regions if layout.certificate else None
    if occupied is None:
        occupied = tuple(regions(layout))
    return np.array([region.box for region in occupied])


def _covered(boxes: Array, corner: Point2, size: float) -> list[Box]:
    """The tiles of a grid with a corner there that have a part of some boxes (n, 4)."""
    taken = set[tuple[int, int]]()
    for xlo, xhi, ylo, yhi in boxes.tolist():
        columns, rows = (
            range(floor((low - at) / size + ROUNDING), ceil((high - at) / size - ROUNDING))
            for low, high, at in ((xlo, xhi, corner[0]), (ylo, yhi, corner[1]))
        )
        taken |= {(row, column) for row in rows for column in columns}
    return [
        tuple(round(at, 6) for at in (x, x + size, y, y + size))  # type: ignore[misc]
        for row, column in sorted(taken)
        for x, y in [(corner[0] + column * size, corner[1] + row * size)]
    ]
