"""All figures by name, each a function without arguments that gives its text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from math import radians
from pathlib import Path

import factory
from factory.api import Factory, Layout
from tools.figures.beyond import draw_corner, draw_counts, draw_tee
from tools.figures.fields import draw_spaces
from tools.figures.firing import Firing, draw_fragments
from tools.figures.floors import draw_gluing, draw_stretching, draw_way
from tools.figures.nets import draw_exclusion, draw_net
from tools.figures.pace import draw_pace
from tools.figures.rings import GearPicture, draw_tooth

PAPER = Path(__file__).resolve().parents[2] / "examples" / "paper.pag"


@cache
def layout() -> Layout:
    """The paper's example, laid out."""
    return factory.lay_out(PAPER)


@cache
def compiled() -> Factory:
    """The paper's example, compiled."""
    return layout().factory


def tree() -> str:
    """The paper's example as `factory export --format svg --of tree` draws it."""
    return str(factory.export(PAPER, "svg", of="tree"))


FIGURES: Mapping[str, Callable[[], str]] = {
    "tree": tree,
    "firing": lambda: Firing(compiled(), "sub1").draw(),
    "fragments": draw_fragments,
    "way": lambda: draw_way(layout()),
    "net": lambda: draw_net(compiled()),
    "exclusion": draw_exclusion,
    "gluing": draw_gluing,
    "stretching": lambda: draw_stretching(layout()),
    "spaces": draw_spaces,
    "train": lambda: draw_net(factory.compile(PAPER, robots=3), (2, 0, 1)),
    "pace": lambda: draw_pace(layout()),
    "corner": draw_corner,
    "tee": draw_tee,
    "counts": lambda: draw_counts(compiled()),
    "tooth": draw_tooth,
    "gears": lambda: GearPicture(compiled(), "r3").draw([radians(t) for t in (180, 270, 360)]),
}
"""Each figure by the name of its file."""
