"""What a picture shows: its camera, by name, and how it is shared between the 3-D and the panels
beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from factory.support.arrays import Array
from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.pictures.sight import Framing, View, fit, tangents, towards
from factory.support.pictures.video import Size
from factory.theory.problem.pag import PAG

Standing = Literal["tour", "overview", "orbit", "top", "product"]
"""`tour`: of a film, the overview, cut to two hand-overs and at the end to the product; of a still
the overview; `overview`: the whole factory, aslant; `orbit`: the same from all sides in turn;
`top`: from above; `product`: follows the product that is furthest on its way."""

CAMERAS: tuple[Standing, ...] = get_args(Standing)

PART, HANDOVER = "part:", "handover:"

Camera = str
"""One of CAMERAS; or `part:LABEL`, which follows that part from its feeder to the dropoff; or
`handover:LABEL`, which looks from near by where that part or sub-assembly is taken."""

TURN = 8.0
"""How fast `orbit` goes round [degrees/s]."""


def camera_names(pag: PAG | None) -> tuple[Camera, ...]:
    """The names of all cameras of a product; without those of labels if it is None."""
    return (*CAMERAS, *(head + k for head, (_, ks) in _labels(pag).items() for k in sorted(ks)))


def camera_named(name: str, pag: PAG | None = None) -> Camera:
    """The camera of a name. Raises InputError (BadValue) for an unknown camera, and for an unknown
    part or label if the product is given, with the valid names."""
    head, colon, label = name.partition(":")
    labels = _labels(pag)
    if head + colon in labels:
        noun, valid = labels[head + colon]
        if pag is None or label in valid:
            return name
        raise _none_of(noun, label, valid)
    if name in CAMERAS:
        return name
    raise _none_of("camera", name, (*CAMERAS, *(f"{head}LABEL" for head in labels)))


def _labels(pag: PAG | None) -> dict[str, tuple[str, tuple[str, ...]]]:
    """What the labels of cameras are, by what these begin with, and those of a product."""
    nodes = () if pag is None else pag.nodes
    parts = tuple(node.label for node in nodes if not node.inputs)
    return {PART: ("part", parts), HANDOVER: ("label", tuple(node.label for node in nodes))}


def _none_of(noun: str, name: str, valid: Sequence[str]) -> InputError:
    near, every = (did_you_mean(word, valid, f"{noun}s") for word in (name, ""))
    hint = every if near == every else f"{near} {every}"
    return InputError(Diagnostic("BadValue", f"there is no {noun} '{name}'", None, hint))


def orbit(points: Array, framing: Framing, turn: float = TURN) -> Callable[[float], View]:
    """The view at each time [s] from a camera that goes round at an even height, `turn` degrees a
    second. It comes nearer and goes away calmly, and has everything in the frame all the way."""
    elevation = 36.0 if framing.aspect >= 1 else 50.0
    azimuths = np.arange(0.0, 360.0, 3.0)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    about, tall = points - middle, tangents(framing)[0]
    best = [fit(about, towards(a, elevation), framing) for a in azimuths]
    aside = _calm(np.array([(v.axes @ v.position)[:2] for v in best]))
    needed = [_away(about, v.axes, at, framing) for v, at in zip(best, aside, strict=True)]
    away = _calm(_most(np.array(needed)))
    depth = float(np.linalg.norm(about, axis=1).max())

    def view(time: float) -> View:
        azimuth = -62.0 + turn * time
        axes = towards(azimuth, elevation)
        right, up, back = (
            np.interp(azimuth, azimuths, values, period=360.0) for values in (*aside.T, away)
        )
        position = middle + right * axes[0] + up * axes[1] - back * axes[2]
        return View(position, axes, tall * framing.aspect, tall, float(back), depth)

    return view


def _away(points: Array, axes: Array, at: Array, framing: Framing) -> float:
    """Distance that a camera has to go back along `axes` from the plane through the origin, `at`
    (2,) to the right and up in it, to have all points in the frame."""
    _, side, low, high = tangents(framing)
    r, u, f = axes @ points.T - np.array([[at[0]], [at[1]], [0.0]])
    return float((np.maximum(np.abs(r) / side, np.maximum(u / high, -u / low)) - f).max())


CALM = 8
"""Half the steps of an orbit over which a camera's way is evened out."""


def _calm(values: Array) -> Array:
    """A closed row of values, smoothed by a weighted mean of neighbours."""
    weights = np.hanning(2 * CALM + 3)[1:-1]
    shifted = (w * np.roll(values, n - CALM, axis=0) for n, w in enumerate(weights))
    return np.asarray(sum(shifted) / weights.sum())


def _most(values: Array) -> Array:
    """A closed row of values, each the maximum of its neighbours."""
    return np.asarray(np.max([np.roll(values, n, axis=0) for n in range(-CALM, CALM + 1)], axis=0))


def from_above(points: Array, framing: Framing) -> View:
    """Straight down, north up, or turned by a quarter where that fills the picture better."""
    upright, turned = (fit(points, towards(a, 90.0), framing) for a in (-90.0, 180.0))
    return turned if turned.distance < 0.9 * upright.distance else upright


PanelName = Literal["net", "gantt"]
"""`net`: the net with its tokens; `gantt`: what each robot did in the last seconds."""

PANELS: tuple[PanelName, ...] = get_args(PanelName)

RendererName = Literal["auto", "classic", "filament"]
"""`classic`: the same to the bit each time; `filament`: physically based, needs Vulkan; `auto`:
that for stills where it works, else the classic one."""

RENDERERS: tuple[RendererName, ...] = get_args(RendererName)

SHARE = 0.30
"""Of the longer side of a picture that panels take, or more where they need it."""

LEAST = 240
"""Pixels that a panel is wide and high at least."""


@dataclass(frozen=True, slots=True)
class Picture:
    """How a still or a film is taken.

    Attributes:
        size: width and height [pixels].
        camera: name of the camera.
        caption: whether it has a caption.
        panels: names of the panels beside the 3-D.
        title: shown at the beginning.
        renderer: what draws it.

    Raises InputError (BadValue) for an unknown camera, panel or renderer, and where there is no
    room for the panels.
    """

    size: Size = (1280, 720)
    camera: Camera = "tour"
    caption: bool = True
    panels: tuple[PanelName, ...] = ()
    title: str = ""
    renderer: RendererName = "auto"

    def __post_init__(self) -> None:
        if self.renderer not in RENDERERS:
            raise _none_of("renderer", self.renderer, RENDERERS)
        camera_named(self.camera)
        shared(self.size, panels_named(",".join(self.panels)))

    def check(self, pag: PAG) -> None:
        """Raises InputError (BadValue) for a camera of a label that is not in the product."""
        camera_named(self.camera, pag)


@dataclass(frozen=True, slots=True)
class Area:
    """A part of a picture: `left` and `top`, `width` and `height` [px]."""

    left: int
    top: int
    width: int
    height: int


def panels_named(text: str | None) -> tuple[PanelName, ...]:
    """`net,gantt` as the panels it names, in their order. Raises InputError (BadValue)."""
    words = [word.strip() for word in (text or "").split(",") if word.strip()]
    for word in words:
        if word not in PANELS:
            hint = did_you_mean(word, PANELS, "panels")
            raise InputError(Diagnostic("BadValue", f"there is no panel '{word}'", None, hint))
    return tuple(panel for panel in PANELS if panel in words)


def shared(size: Size, panels: Sequence[PanelName]) -> tuple[Area, dict[PanelName, Area]]:
    """The area of the 3-D and those of the panels: beside it, or below it in an upright picture.

    Raises InputError (BadValue) where there is no room."""
    width, height = size
    if not panels:
        return Area(0, 0, width, height), {}
    beside = width >= height
    least = LEAST if beside else LEAST * len(panels)
    taken = max(2 * round(SHARE * max(size) / 2), least)
    wide, tall = (taken, height) if beside else (width, taken)
    if wide < LEAST or tall < LEAST * len(panels) or 2 * taken > max(size):
        hint = "take 1280x720, or leave panels out"
        message = f"{width}x{height} has no room for {' and '.join(panels)}"
        raise InputError(Diagnostic("BadValue", message, None, hint))
    scene = Area(0, 0, width - wide if beside else width, height if beside else height - tall)
    left, top = (width - wide, 0) if beside else (0, height - tall)
    edges = [round(tall * n / len(panels)) for n in range(len(panels) + 1)]
    return scene, {
        panel: Area(left, top + edges[n], wide, edges[n + 1] - edges[n])
        for n, panel in enumerate(panels)
    }


USUAL = Picture()
