"""Parts that interlock, as a still: where they are in the product, the rest of it faint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from factory.apps.planning.cannot import Interlock
from factory.apps.planning.loose_parts import LOOSE_SAMPLES, LooseParts
from factory.apps.planning.parts import InPlace
from factory.support.arrays import Array, Indices
from factory.support.pictures.ink import GROUND, INK, Colour, Ink, Pixels, fitted, width
from factory.support.pictures.sight import fit, towards
from factory.support.pictures.still import write_still
from factory.support.pictures.video import Size, check_output

SIZE: Size = (1280, 720)
"""Of the picture, without the names below it."""

LINE, EDGES, POINTS, LONGEST = 34, 22, 18, 300
"""Height of a line of names, margin, size and greatest length of a name [px]."""

AZIMUTH, ELEVATION = -58.0, 26.0
"""From where the camera looks [degrees]."""

REST = (0.6, 0.63, 0.67, 0.16)
"""The colour of what does not interlock."""

PAINTS: tuple[Colour, ...] = (
    (66, 133, 190),
    (222, 128, 48),
    (98, 150, 66),
    (190, 84, 130),
    (124, 108, 178),
    (196, 172, 52),
    (70, 150, 160),
    (150, 96, 66),
)
"""Of those that interlock, in turn."""


@dataclass(frozen=True)
class InterlockedView:
    """A source with interlocked units."""

    source: InPlace
    lock: Interlock

    def still(self, path: Path) -> None:
        """Write it as PNG, with the names of the interlocked units in their colours. Raises
        InputError, MissingError where there is no GL."""
        names = list(_placed(self.lock.labels))
        rows = 1 + max(row for row, _, _ in names)
        size = SIZE[0], SIZE[1] + LINE * rows + EDGES
        check_output(path, size, still=True)
        pixels = np.empty((size[1], size[0], 3), np.uint8)
        pixels[:] = GROUND
        pixels[: SIZE[1]] = self._picture()
        ink = Ink(pixels)
        for number, (row, left, name) in enumerate(names):
            middle = SIZE[1] + LINE * (row + 0.5) + EDGES / 2
            ink.disc(left + 7, middle, 7, PAINTS[number % len(PAINTS)])
            ink.words(left + 22, middle, name, POINTS, INK)
        write_still(path, pixels)

    def _picture(self) -> Pixels:
        """The interlocked units, as large as possible, and the rest."""
        surfaces: dict[str, tuple[Array, Indices]] = {}
        colours: list[tuple[float, ...]] = []
        ends = []
        for label, members in self.source.units():
            paint = REST
            if label in self.lock.labels:
                red, green, blue = PAINTS[self.lock.labels.index(label) % len(PAINTS)]
                paint = red / 255, green / 255, blue / 255, 1.0
                ends += [(part.solid.low, part.solid.high) for part in members]
            for part in members:
                surfaces[part.label] = part.vertices, part.faces
                colours.append(paint)
        bits = np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)])
        points = np.array(ends)[:, bits, [0, 1, 2]].reshape(-1, 3)
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        floor = float(points[:, 2].min()) - 1e3 * extent
        with LooseParts(surfaces, colours, floor, extent, SIZE) as stage:
            stage.move(np.zeros((len(colours), 3)))
            view = fit(points, towards(AZIMUTH, ELEVATION), stage.framing)
            return stage.renderer.mean(view, LOOSE_SAMPLES)


def _placed(labels: tuple[str, ...]) -> Iterator[tuple[int, float, str]]:
    """For each name its row, its x [px], and as much of it as is written."""
    row, x = 0, float(EDGES)
    for label in labels:
        name = fitted(label, POINTS, LONGEST) or label[:3]
        length = 22 + width(name, POINTS) + 2 * EDGES
        if x + length > SIZE[0] and x > EDGES:
            row, x = row + 1, float(EDGES)
        yield row, x, name
        x += length
