"""Cells for tests: small products that arms place, laid out once, and their runs."""

from __future__ import annotations

from functools import cache

from factory.api import Diagnostic, InputError, RunError
from factory.apps.arms.cell import CellChains
from factory.apps.arms.ground import with_arm
from factory.floor.layout.layout import Layout
from factory.pipeline import Project
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates

SMALL = """root = box;
box = mate ( filled, lid );
filled = mate ( tub, motor );
tub = atomic ( box = (0.10, 0.07, 0.03), pos = (0, 0, 0.015), density = 1200 );
motor = atomic ( box = (0.05, 0.03, 0.024), pos = (-0.018, 0.01, 0.0421), density = 2500 );
lid = atomic ( box = (0.10, 0.07, 0.006), pos = (0, 0, 0.0573), density = 1200 )"""
"""A tub, a block and a lid."""


def project(text: str, arm: str) -> Project:
    """The project of a PAG's text with an arm."""
    templates = all_templates()
    return with_arm(Project(read_pag(text, templates), templates), arm)


@cache
def cell(arm: str = "six") -> Layout:
    """The cell of the small product."""
    return project(SMALL, arm).layout


def chains(layout: Layout) -> CellChains:
    """What a cell says of its arms."""
    assert isinstance(layout.chains, CellChains)
    return layout.chains


def refusal(text: str, arm: str = "six") -> Diagnostic:
    """Why the cell of a PAG's text is refused."""
    try:
        made = project(text, arm).layout
    except (InputError, RunError) as error:
        (why,) = error.diagnostics
        return why
    raise AssertionError(f"{made} is made")
