"""Parts that interlock, as a still: where they are in the product, then drawn out along each axis,
with who meets whom on the way."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from factory.geometry.meshes import Array, Indices
from factory.geometry.sight import View, fit, towards
from factory.planning.cannot import Interlock
from factory.planning.parts import InPlace
from factory.rendering.colours import EDGE, FAINT, GROUND, INK
from factory.rendering.ink import Colour, Ink, Pixels, fitted, width
from factory.rendering.painter import LooseParts
from factory.rendering.picture import Size
from factory.rendering.reel import SAMPLES, write_still
from factory.rendering.video import check_output

PANEL: Size = (640, 360)
"""Of each of the four pictures."""

HEAD, LINE, EDGES, POINTS, SMALL = 78, 34, 22, 18, 15
"""Heights above a picture and of a line of names, the margin [px], and sizes of words."""

MET = 8
"""So many names of those that meet each other are written."""

AZIMUTH, ELEVATION = -58.0, 26.0
"""From where the camera looks [degrees]."""

ROOM = 0.12
"""Between what is drawn out there is this share of the size of all that interlock."""

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
    """A source with interlocked units. `boxes` (n, 2, 3): bounding boxes of these units [m], in the
    order of `lock`."""

    source: InPlace
    lock: Interlock
    boxes: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        units = dict(self.source.units())
        solids = [[part.solid for part in units[label]] for label in self.lock.labels]
        ends = [
            (np.min([s.low for s in members], axis=0), np.max([s.high for s in members], axis=0))
            for members in solids
        ]
        object.__setattr__(self, "boxes", np.array(ends))

    def drawn_out(self, axis: int) -> Array:
        """Offsets of the units (n, 3) [m] that line them up along an axis, in their order on it."""
        low, high = self.boxes[:, 0, axis], self.boxes[:, 1, axis]
        room = ROOM * float(np.ptp(self.boxes.reshape(-1, 3), axis=0).max())
        order = np.argsort(low + high, kind="stable")
        ends = np.cumsum(high[order] - low[order] + room)
        offsets = np.zeros((len(low), 3))
        offsets[order, axis] = ends - high[order]
        offsets[:, axis] -= offsets[:, axis].mean()
        return offsets

    def met(self, axis: int, side: int) -> str:
        """The first units that block each other on the way out to one side of an axis, in words."""
        circuit = dict(self.lock.circuits)[axis, side]
        shown = (*circuit, circuit[0]) if len(circuit) < MET else (*circuit[:MET], "...")
        return " meets ".join(shown)

    def colour(self, number: int) -> Colour:
        """The colour of an interlocked unit."""
        return PAINTS[number % len(PAINTS)]

    def still(self, path: Path) -> None:
        """Write it as PNG. Raises InputError, MissingError where there is no GL."""
        wide, tall = PANEL
        rows = self._names()
        size = 2 * wide, 2 * (tall + HEAD) + LINE * len(rows) + EDGES
        check_output(path, size, still=True)
        pixels = np.empty((size[1], size[0], 3), np.uint8)
        pixels[:] = GROUND
        with _Parts(self) as stage:
            panels = [stage.whole(), *(stage.drawn_out(axis) for axis in range(3))]
        for number, panel in enumerate(panels):
            x, y = wide * (number % 2), (tall + HEAD) * (number // 2)
            pixels[y + HEAD : y + HEAD + tall, x : x + wide] = panel
            self._titles(Ink(pixels), number - 1, x + EDGES, y)
        ink = Ink(pixels)
        for row, names in enumerate(rows):
            middle = 2 * (tall + HEAD) + LINE * (row + 0.5) + EDGES / 2
            for left, number, name in names:
                ink.disc(left + 7, middle, 7, self.colour(number))
                ink.words(left + 22, middle, name, POINTS, INK)
        write_still(path, pixels)

    def _titles(self, ink: Ink, axis: int, x: float, y: float) -> None:
        """Draw the words above the picture of an axis, or for -1 above that of the product."""
        room = PANEL[0] - 2 * EDGES
        if axis < 0:
            count = len(self.lock.labels)
            lines = [f"{count} parts interlock, where they are in the product"]
        else:
            name = "xyz"[axis]
            ways = [f"to {sign}{name}: {self.met(axis, int(sign + '1'))}" for sign in "+-"]
            lines = [f"drawn out along {name}; going out", *ways]
        for n, words in enumerate(lines):
            points, colour = (SMALL, FAINT) if n else (POINTS, INK)
            ink.words(x, y + 18 + 22 * n, fitted(words, points, room), points, colour)
        ink.box(x - EDGES, y, x - EDGES + PANEL[0], y + 1, EDGE)

    def _names(self) -> list[list[tuple[float, int, str]]]:
        """The names of the interlocked units, in rows, each with its x [px] and its number."""
        rows: list[list[tuple[float, int, str]]] = [[]]
        x = float(EDGES)
        for number, name in enumerate(self.lock.labels):
            shown = fitted(name, POINTS, 300) or name[:3]
            length = 22 + width(shown, POINTS) + 2 * EDGES
            if x + length > 2 * PANEL[0] and rows[-1]:
                rows.append([])
                x = float(EDGES)
            rows[-1].append((x, number, shown))
            x += length
        return rows


class _Parts(LooseParts):
    """Draws the parts of a view, where they are or drawn out."""

    def __init__(self, shown: InterlockedView) -> None:
        self.shown = shown
        surfaces: dict[str, tuple[Array, Indices]] = {}
        colours: list[tuple[float, ...]] = []
        unit = []
        for label, members in shown.source.units():
            number = shown.lock.labels.index(label) if label in shown.lock.labels else -1
            paint = (*(c / 255 for c in shown.colour(number)), 1.0) if number >= 0 else REST
            for part in members:
                surfaces[part.label] = part.vertices, part.faces
                colours.append(paint)
                unit.append(number)
        self.unit = np.array(unit)
        points = shown.boxes.reshape(-1, 3)
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        self.far = np.array([0.0, 0.0, 1e4 * size])
        floor = float(points[:, 2].min()) - 1e3 * size
        super().__init__(surfaces, colours, floor, size, PANEL)

    def whole(self) -> Pixels:
        """All in place, the rest of the product faint."""
        return self._picture(np.zeros(self.shown.boxes[:, 0].shape), np.zeros(3))

    def drawn_out(self, axis: int) -> Pixels:
        """Those that interlock alone, drawn out along an axis."""
        return self._picture(self.shown.drawn_out(axis), self.far)

    def _picture(self, moved: Array, rest: Array) -> Pixels:
        """The units of the view moved (n, 3), and the rest (3,) [m]."""
        self.move(np.vstack([moved, rest])[self.unit])
        return self.renderer.mean(self._view(moved), SAMPLES)

    def _view(self, moved: Array) -> View:
        """The view that shows the interlocked units as large as possible."""
        bits = np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)])
        corners = self.shown.boxes[:, bits, [0, 1, 2]] + moved[:, None]
        return fit(corners.reshape(-1, 3), towards(AZIMUTH, ELEVATION), self.framing)
