"""Robots with a lift: what must be lowered is lowered, in either world, from any marking."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.floor.geometry.product import product_geometry
from factory.floor.layout.clearance import certify
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.compiler.expanding import expand
from factory.theory.lang.pag_reader import read_pag
from factory.theory.plant.approaches import MARGIN
from tests.layout_values import with_visits
from tests.simulation_values import FENCE, laid_out_with_lifts


def test_a_stroke_too_short_fails_the_certificate() -> None:
    """Planted fault: what is lowered comes only 5 mm above the others."""
    layout = laid_out_with_lifts(FENCE)
    factory = layout.factory
    operations = tuple(
        o
        if o.lowered < 0
        else replace(o, approach=replace(o.approach, stroke=o.approach.stroke - MARGIN + 0.005))
        for o in factory.operations
    )
    lower = with_visits(replace(layout, factory=replace(factory, operations=operations)))
    assert certify(layout).holds
    faults = certify(lower).faults
    assert any("comes 5.0 mm over" in fault.message for fault in faults)


def test_a_catalogue_without_lifts_is_told() -> None:
    from factory.theory.compiler.compiler import compile_pag
    from tests.pag_values import catalogue

    templates = all_templates()
    pag = read_pag(FENCE, templates)
    found = matings(expand(pag, templates), product_geometry(pag)).approaches
    with pytest.raises(InputError, match="must be lowered, and a 'dot' has no lift"):
        compile_pag(pag, templates, catalogue(), found)
