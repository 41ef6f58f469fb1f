"""The examples on their floors, each laid out once for all tests of a process."""

from __future__ import annotations

from functools import cache

import factory
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from tests.command_line import ROOT


@cache
def without_hands(name: str) -> Layout:
    """An example laid out as `factory.lay_out` does."""
    file = ROOT / "examples" / f"{name}.pag"
    return factory.lay_out(factory.compile(factory.load_pag(file)))


@cache
def with_hands(name: str) -> Layout:
    """An example laid out as the command line does."""
    return read(ROOT / "examples" / f"{name}.pag").layout
