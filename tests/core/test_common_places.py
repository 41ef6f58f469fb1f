"""Common places: on the top of each part, and apart; none where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.floor.geometry.common_places import APART, CommonPlace, Top, common_places
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.floor.geometry.suction import EVEN, Terrain, drawn_triangles
from factory.pipeline import all_templates
from factory.theory.lang.pag_reader import read_pag

NOTHING = np.full(2, np.inf), np.full(2, -np.inf)
HALF = st.floats(0.004, 0.03).map(lambda x: round(x, 4))
AT = st.floats(-0.03, 0.03).map(lambda x: round(x, 4))
SHAPES = st.one_of(
    st.tuples(HALF, HALF).map(lambda s: f"box = ( {2 * s[0]}, {2 * s[1]}, 0.02 )"),
    st.tuples(HALF).map(lambda s: f"cylinder = ( {s[0]}, 0.02 )"),
    st.tuples(HALF).map(
        lambda s: f"cylinder = ( {s[0]}, 0.03 ), quat = ( 0.7071068, 0.7071068, 0, 0 )"
    ),
    st.tuples(HALF).map(lambda s: f"sphere = {s[0]}"),
)


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


def faults(found: list[CommonPlace], parts: list[Solid]) -> list[str]:
    """What is wrong with common places of parts."""
    told = []
    if sorted(n for place in found for n in place.parts) != list(range(len(parts))):
        told.append("not each part once")
    for number, place in enumerate(found):
        for other in found[:number]:
            if np.linalg.norm(place.at - other.at) < place.radius + other.radius + APART:
                told.append("pads meet")
        for part in (parts[n] for n in place.parts):
            under = place.at - place.radius - 1e-6, place.at + place.radius + 1e-6
            if Terrain.of(drawn_triangles(part)).height_in(*under) < part.high[2] - EVEN:
                told.append("not on the top")
            if (under[0] < part.low[:2] - 2e-6).any() or (under[1] > part.high[:2] + 2e-6).any():
                told.append("out over a side")
    return told


@given(shapes=st.lists(st.tuples(SHAPES, AT, AT), min_size=2, max_size=6))
@settings(max_examples=60, deadline=None)
def test_pads_are_on_the_tops_of_their_parts_and_apart(
    shapes: list[tuple[str, float, float]],
) -> None:
    parts = solids(shapes)
    found = common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING)
    assert not found or not faults(found, parts)


def test_planted_places_are_found_wrong() -> None:
    parts = solids([("box = ( 0.04, 0.04, 0.02 )", 0, 0), ("box = ( 0.04, 0.04, 0.02 )", 0.03, 0)])
    (good,) = common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING)
    assert not faults([good], parts)
    assert faults([CommonPlace(good.at, good.radius, (0,))], parts) == ["not each part once"]
    beside = CommonPlace(good.at + 0.02, good.radius, (0, 1))
    assert "out over a side" in faults([beside], parts)
    both = [CommonPlace(good.at, good.radius, (n,)) for n in (0, 1)]
    assert "pads meet" in faults(both, parts)
    away = CommonPlace(good.at + np.array([0.0, 0.1]), good.radius, (0, 1))
    assert "not on the top" in faults([away], parts)


@pytest.mark.parametrize(
    ("second", "groups"),
    [
        (("box = ( 0.04, 0.04, 0.02 )", 0.03, 0.0), [(0, 1)]),
        (("box = ( 0.04, 0.04, 0.02 )", 0.05, 0.0), [(0,), (1,)]),
        (("cylinder = ( 0.01, 0.04 ), quat = ( 0.7071068, 0.7071068, 0, 0 )", 0.0, 0.0), [(0, 1)]),
    ],
)
def test_parts_over_each_other_have_one_place(
    second: tuple[str, float, float], groups: list[tuple[int, ...]]
) -> None:
    parts = solids([("box = ( 0.04, 0.04, 0.02 )", 0.0, 0.0), second])
    found = common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING)
    assert [place.parts for place in found] == groups


def test_what_a_hand_takes_is_left_free() -> None:
    parts = solids([("box = ( 0.04, 0.04, 0.02 )", 0, 0), ("box = ( 0.04, 0.04, 0.02 )", 0, 0)])
    tops = [Top.of(part, np.zeros(2)) for part in parts]
    (place,) = common_places(tops, (np.array([-9.0, -0.012]), np.array([9.0, 9.0])))
    assert place.at[1] + place.radius <= -0.012
    assert common_places(tops, (np.full(2, -9.0), np.full(2, 9.0))) == []


def test_needles_nearer_than_pads_can_be_have_none() -> None:
    needle = "box = ( 0.0002, 0.0002, 0.02 )"
    parts = solids([(needle, 0.0, 0.0), (needle, 0.0003, 0.0)])
    assert common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING) == []
