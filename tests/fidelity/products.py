"""The products of the campaigns."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import factory
from factory.layout.plan import Layout

EXAMPLES = Path(__file__).resolve().parent.parent.parent / "examples"

PAPER = "paper"

SMALL = (PAPER, "lamp")
"""Products that are made many hundred times: under every disturbance."""

REAL = ("gearbox",)
"""Real products with meshes, by the names of their files in examples/: made 50 times in a run."""

CAMPAIGN = (*SMALL, "stool", *REAL)
"""Products whose modes are tried."""


@lru_cache
def layout(name: str) -> Layout:
    """The factory of an example, laid out."""
    return factory.lay_out(factory.compile(factory.load_pag(EXAMPLES / f"{name}.pag")))
