"""The layout: what it says of the paper's example, of floors and payloads, and of what it
builds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.common_places import Top, common_places
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.floor.layout.certificate import NAMES
from factory.floor.layout.clearance import certify
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.pag_reader import read_pag
from factory.theory.nets.coordinated import Coordination
from factory.theory.problem.template import Law, Point
from tests.examples import with_hands
from tests.layout_values import STYLES, paper_layout, random_layout
from tests.pag_values import SHAPES, TEMPLATES, catalogue, paper


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


NOTHING = np.full(2, np.inf), np.full(2, -np.inf)


def solids(shapes: list[tuple[str, float, float]]) -> list[Solid]:
    """Parts of these shapes at these places in plan."""
    names = [f"p{n}" for n in range(len(shapes))]
    parts = (
        f"{name} = atomic ( {shape}, pos = ( {x}, {y}, 0 ) );"
        for name, (shape, x, y) in zip(names, shapes, strict=True)
    )
    text = f"root = s; s = mate ( {', '.join(names)} ); {' '.join(parts)}"
    product = product_geometry(read_pag(text, all_templates()))
    return [product.solids[name] for name in names]


def test_needles_nearer_than_pads_can_be_have_none() -> None:
    needle = "box = ( 0.0002, 0.0002, 0.02 )"
    parts = solids([(needle, 0.0, 0.0), (needle, 0.0003, 0.0)])
    assert common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING) == []


def test_an_order_with_its_tokens_exchanged_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = with_hands("truck")
    assert certify(layout).holds
    order: Callable[..., None] = Coordination.order

    def exchanged(self: Coordination, place: str, past: Any, start: int, tokens: int) -> None:
        order(self, place, past, start, 0)

    monkeypatch.setattr(Coordination, "order", exchanged)
    fault, *_ = (f for f in certify(layout).faults if "for ever" in f.message)
    assert "order:" in fault.message


mujoco = pytest.importorskip("mujoco")


def laid_out(seed: int) -> Layout:
    """A layout of another shape and style for each seed."""
    shape, style = SHAPES[seed % len(SHAPES)], STYLES[seed % len(STYLES)]
    return random_layout(7 + seed, seed, shape, style, True)


@pytest.mark.parametrize("number", range(8))
def test_nothing_touches(number: int) -> None:
    """Two or three units, every robot with a speed and a gain of its own."""
    layout = laid_out(number)
    run = Simulation(
        layout, RunRequest("mujoco", units=2 + number % 2, seed=number, jitter=0.3)
    ).run()
    assert run.trouble is None, str(run.trouble)
    assert run.refines_net
    assert run.physics is not None
    assert run.physics.unintended_contacts == 0, run.physics.contacts


def test_layers_are_those_of_the_bodies() -> None:
    certificate = laid_out(0).certificate
    assert certificate is not None
    assert tuple(name for name, _, _ in certificate.layers) == NAMES
