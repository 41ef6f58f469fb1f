"""Common places: on the top of each part, and apart; none where there is none."""

from __future__ import annotations

import numpy as np

from factory.floor.geometry.common_places import Top, common_places
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.pipeline import all_templates
from factory.theory.lang.pag_reader import read_pag

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
