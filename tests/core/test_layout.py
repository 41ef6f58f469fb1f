"""The layout: what it says of the paper's example, of floors and payloads, and of what it
builds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.floor.geometry.product import product_geometry
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.support.errors import InputError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.problem.template import Law, Point
from tests.layout_values import paper_layout, random_layout
from tests.pag_values import TEMPLATES, catalogue, paper


def test_the_same_input_gives_the_same_layout() -> None:
    anew = random_layout.__wrapped__
    first, second = (anew(30, 4, "any", "mixed") for _ in range(2))
    assert first.guidepaths == second.guidepaths and first.visits == second.visits


def test_stretching_changes_lengths_alone() -> None:
    """A larger clearance makes paths longer; nothing else is scaled."""
    near, far = (lay_out(paper_layout().factory, paper_layout().product, c) for c in (0.01, 0.04))
    assert near.guidepath_length < paper_layout().guidepath_length < far.guidepath_length
    assert [p.heading for p in near.guidepaths] == [p.heading for p in far.guidepaths]


def test_three_guests_at_one_point_are_refused() -> None:
    clamp = TEMPLATES["clamp"]
    press = replace(
        clamp,
        robots=("dot", "tool", "tool", "tool"),
        before=(*clamp.before, "nopart"),
        after=(*clamp.after, "nopart"),
        law=Law("navigation", (*clamp.law.goals, Point("A", 4, 2))),
    )
    with pytest.raises(InputError, match="3 guidepaths would end at one point"):
        laid_out_with(press)


def test_a_guest_with_its_goal_away_from_a_is_refused() -> None:
    weld = TEMPLATES["weld"]
    law = replace(weld.law, goals=(weld.law.goals[0], Point("B", 2)))
    with pytest.raises(InputError, match="'sub2': a robot that is not the carrier has its goal"):
        laid_out_with(replace(weld, law=law))


def laid_out_with(template: object) -> Layout:
    """The paper's example with one template replaced, under its own name or as weld."""
    name = template.name if template.name in ("mate", "weld") else "weld"  # type: ignore[attr-defined]
    templates = {**TEMPLATES, name: replace(template, name=name)}  # type: ignore[type-var]
    factory = compile_pag(paper(), templates, catalogue())  # type: ignore[arg-type]
    return lay_out(factory, product_geometry(factory.pag))
