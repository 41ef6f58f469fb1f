"""The exploded view of a product as a still, and the film in which it comes together."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from factory.api import DrawnSolids, Product, Solid
from factory.apps.planning.exploding import Explosion
from factory.apps.planning.loose_parts import LOOSE_SAMPLES, LooseParts
from factory.apps.planning.source import surface
from factory.support.arrays import Array, Indices
from factory.support.pictures.ink import Pixels
from factory.support.pictures.sight import View, fit, towards
from factory.support.pictures.smoothing import smooth
from factory.support.pictures.still import write_still
from factory.support.pictures.video import Size, VideoFile, check_output

FPS = 15.0

STILL: tuple[Size, Size] = (1280, 720), (900, 1200)
FILM: tuple[Size, Size] = (800, 450), (480, 640)
"""Of pictures: wide, or upright."""

AZIMUTH, ELEVATION, TURN = -58.0, 31.0, 40.0
"""From where the camera looks, and how far round it goes in a film [degrees]."""

BEFORE, AFTER, SLOWEST, LONGEST = 1.2, 1.8, 0.7, 5.0
"""Parts stand apart and the product stands for these times; an operation takes at most the third,
and all together the fourth [s]."""

MANY = 10_000
"""A film of more triangles has half the frames, and no shadows: these cost a second pass. Those of
closed meshes are fewer then, within SEEN of a pixel as far as the parts reach together."""

SEEN = 0.1
"""What is off by this share of a pixel is not seen."""

AROUND = 3.0
"""So many times the product's depth of the floor gets clean shadows: beyond it is speckled."""

EVEN = 9
"""Half the frames over which the camera's way is evened out."""


@dataclass(frozen=True)
class ExplodedView:
    """A product and its explosion."""

    product: Product
    explosion: Explosion
    boxes: Array = field(init=False, repr=False)
    """The corners (n, 8, 3) of the boxes of the parts [m]."""

    def __post_init__(self) -> None:
        solids = [self.product.solids[label] for label in self.explosion.parts]
        ends = np.array([[solid.low, solid.high] for solid in solids])
        bits = np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)])
        object.__setattr__(self, "boxes", ends[:, bits, [0, 1, 2]])

    @property
    def is_upright(self) -> bool:
        """Whether it is higher than wide, so that its pictures are upright."""
        wide, deep, tall = np.ptp(self._points(0.0), axis=0)
        return bool(tall > 1.1 * max(wide, deep))

    def still(self, path: Path) -> None:
        """Write a picture of all parts apart, as PNG. Raises InputError, MissingError where there
        is no GL."""
        size = STILL[self.is_upright]
        check_output(path, size, still=True)
        with _Stage(self, size) as stage:
            write_still(path, stage.still())

    def film(self, path: Path, fps: float = FPS) -> int:
        """Write the film, with `fps` frames a second, or half of that for a product of many faces;
        returns the number of frames. Raises as `still` does."""
        size = FILM[self.is_upright]
        fps = fps if self.faces <= MANY else fps / 2
        check_output(path, size, fps)
        count = len(self.explosion.steps)
        slow = min(SLOWEST, LONGEST / max(count, 1))
        frames = round((BEFORE + slow * count + AFTER) * fps)
        times = np.arange(frames) / fps
        done = np.clip((times - BEFORE) / slow, 0.0, count)
        with _Stage(self, size) as stage, VideoFile(path, size, fps) as file:
            for view, now in zip(stage.views(done), done, strict=True):
                file.write(stage.picture(float(now), view))
        return frames

    @property
    def faces(self) -> int:
        """Number of triangles."""
        solids = (self.product.solids[label] for label in self.explosion.parts)
        return sum(12 if solid.mesh is None else len(solid.mesh.faces) for solid in solids)

    def _points(self, done: float) -> Array:
        """The corners of all boxes (8 n, 3) when so many operations are done."""
        return np.asarray((self.boxes + self.explosion.offsets(done)[:, None]).reshape(-1, 3))


class _Stage(LooseParts):
    """Draws the parts of a view when so many operations are done."""

    def __init__(self, shown: ExplodedView, size: Size) -> None:
        self.shown = shown
        solids = [shown.product.solids[label] for label in shown.explosion.parts]
        apart = shown._points(0.0)
        extent = float(np.linalg.norm(np.ptp(apart, axis=0)))
        within = SEEN * extent / max(size) if shown.faces > MANY else 0.0
        surfaces = {solid.label: _surface(solid, within) for solid in solids}
        colours = [solid.rgba for solid in solids]
        super().__init__(surfaces, colours, float(apart[:, 2].min()), extent, size)
        self.last: float | None = None

    def still(self) -> Pixels:
        """All apart."""
        self._place(0.0)
        axes = towards(AZIMUTH, ELEVATION)
        view = fit(self.shown._points(0.0), axes, self.framing)
        return self.renderer.mean(replace(view, depth=AROUND * view.depth), LOOSE_SAMPLES)

    def picture(self, done: float, view: View) -> Pixels:
        """When so many operations are done."""
        self._place(done)
        drawn = self.renderer.draw(view, self.shown.faces <= MANY)
        return smooth(np.ascontiguousarray(drawn[::-1]))

    def _place(self, done: float) -> None:
        if done != self.last:
            self.move(self.shown.explosion.offsets(done))
            self.last = done

    def views(self, done: Array) -> list[View]:
        """The camera at each frame: it goes round, and nearer as the product comes together."""
        angles = AZIMUTH + TURN * np.linspace(0.0, 1.0, len(done))
        turned = [towards(float(angle), ELEVATION) for angle in angles]
        moments = zip(turned, done, strict=True)
        fitted = [fit(self.shown._points(float(now)), axes, self.framing) for axes, now in moments]
        numbers = np.array([(*(v.axes @ v.position), v.distance, AROUND * v.depth) for v in fitted])
        calm = _evened(numbers)
        return [
            View(axes.T @ row[:3], axes, v.wide, v.tall, float(row[3]), float(row[4]))
            for axes, v, row in zip(turned, fitted, calm, strict=True)
        ]


def _surface(solid: Solid, within: float) -> tuple[Array, Indices]:
    """The surface of a solid in place, with fewer triangles where these are about `within` a
    distance [m] of it."""
    body = DrawnSolids.body(solid) if within and solid.mesh is not None else None
    if body is None:
        return surface(solid)
    mesh = body.simplify(within).to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64)


def _evened(values: Array) -> Array:
    """Rows (n, k), each the mean of its neighbours; the ends are kept."""
    padded = np.pad(values, ((EVEN, EVEN), (0, 0)), mode="edge")
    weights = np.hanning(2 * EVEN + 3)[1:-1]
    weights /= weights.sum()
    moved = [w * padded[n : n + len(values)] for n, w in enumerate(weights)]
    return np.asarray(np.sum(moved, axis=0))
