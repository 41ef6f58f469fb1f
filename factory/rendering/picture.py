"""What a picture shows, and how it is shared between the 3-D and the panels beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from factory.problem.pag import PAG
from factory.rendering.camera import Camera, camera_named
from factory.support.errors import Diagnostic, InputError, did_you_mean

Size = tuple[int, int]
"""Width and height [px]."""

PanelName = Literal["net", "gantt"]
"""`net`: the net with its tokens; `gantt`: what each robot did in the last seconds."""

PANELS: tuple[PanelName, ...] = get_args(PanelName)

SHARE = 0.44
"""Of the longer side of a picture that panels take."""

LEAST = 240
"""Pixels that a panel is wide and high at least."""


@dataclass(frozen=True, slots=True)
class Picture:
    """How a still or a film is taken: its `size`, the `camera`, whether it has a `caption`, the
    `panels` beside the 3-D, and a `title` shown at the beginning. Raises InputError (BadValue) for
    an unknown camera or panel, and where there is no room for the panels."""

    size: Size = (1280, 720)
    camera: Camera = "overview"
    caption: bool = True
    panels: tuple[PanelName, ...] = ()
    title: str = ""

    def __post_init__(self) -> None:
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
    wide = 2 * round(SHARE * width / 2) if beside else width
    tall = height if beside else 2 * round(SHARE * height / 2)
    if wide < LEAST or tall < LEAST * len(panels):
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
