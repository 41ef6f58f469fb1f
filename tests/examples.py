"""The examples on their floors, each laid out once for all tests of a process."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from tests.paths import ROOT


def plainly_laid_out(file: Path) -> Layout:
    """A product laid out as `factory.lay_out` does with its factory."""
    return Project.of_made(read(file).plain).layout


@cache
def without_hands(name: str) -> Layout:
    """An example laid out as `factory.lay_out` does."""
    return plainly_laid_out(ROOT / "examples" / f"{name}.pag")


@cache
def with_hands(name: str) -> Layout:
    """An example laid out as the command line does."""
    return read(ROOT / "examples" / f"{name}.pag").layout
