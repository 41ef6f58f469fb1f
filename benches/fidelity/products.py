"""The products of the campaigns."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import factory
from factory.apps.sweep.pool import cores, over_processes
from factory.floor.layout.layout import Layout

Item = TypeVar("Item")

Result = TypeVar("Result")

ROOT = Path(__file__).resolve().parent.parent.parent

EXAMPLES = ROOT / "examples"

BRICKS = Path(os.environ.get("FACTORY_LDRAW", ROOT.parent / "shared" / "products" / "ldraw"))
"""Where the LDraw products are, if they are on this machine."""

PAPER = "paper"

SMALL = (PAPER, "lamp")
"""Products that are made many hundred times: under every disturbance."""

REAL = ("gearbox",)
"""Real products with meshes, by the names of their files in examples/: made 50 times in a run."""

BRICKS_NAMES = (
    "30023-1-Lighthouse",
    "889-1-RadarTruck",
    "6966-1-JediStarfighter-Mini",
    "4494-1-Imperial_Shuttle-Mini",
    "5935-1-IslandHopper",
)
"""The LDraw products."""

CAMPAIGN = (*SMALL, "stool", *REAL)
"""Products whose modes are tried."""


@lru_cache
def layout(name: str) -> Layout:
    """The factory of an example, or of an LDraw product by the name of its file, laid out."""
    return factory.lay_out(factory.compile(factory.load_pag(file_of(name))))


def file_of(name: str) -> Path:
    """The PAG of an example, or of an LDraw product by the name of its file."""
    file = EXAMPLES / f"{name}.pag"
    return file if file.is_file() else BRICKS / f"{name}.pag"


def over_cores(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The results of `work` for all items, in their order, from as many processes as cores."""
    found = dict[int, Result]()
    for worked in over_processes(work, items, cores()):
        assert worked.result is not None
        found[worked.number] = worked.result
    return [found[number] for number in range(len(items))]


def is_here(name: str) -> bool:
    """Whether a product is on this machine."""
    return file_of(name).is_file()
