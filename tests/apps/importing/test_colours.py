"""Parts without colours get a restrained palette by size, and fasteners are of steel."""

from __future__ import annotations

from colorsys import rgb_to_hsv

import pytest

from factory.apps.importing.colours import PALETTE, STEEL, PartKind, colours_by_size, kinds_of


@pytest.mark.parametrize(
    ("name", "is_steel"),
    [
        *(("M4 screw", True), ("hex-nuts-2", True), ("pin_3", True), ("SpinnerPart", False)),
        *(("screwdriver", False), ("bolted plate", False), ("base", False)),
    ],
)
def test_fasteners_are_known_by_their_names(name: str, is_steel: bool) -> None:
    assert (colours_by_size({0: PartKind((name,), 0.5)})[0] == STEEL) is is_steel


def test_many_small_parts_are_fasteners_and_many_large_ones_are_not() -> None:
    names = ["a", "b", "c", "d", "e", "f", "g"]
    kinds = kinds_of([0, 1, 1, 1, 4, 4, 4], names, [0.9, 0.1, 0.1, 0.1, 0.4, 0.4, 0.4], 1.0)
    assert colours_by_size(kinds) == {0: PALETTE[0], 1: STEEL, 4: PALETTE[1]}


def test_neighbours_in_size_differ_and_none_shouts() -> None:
    chosen = colours_by_size({n: PartKind((f"p{n}",), 1 / (n + 1)) for n in range(30)})
    assert all(chosen[n] != chosen[n + 1] for n in range(29))
    assert all(rgb_to_hsv(*colour[:3])[1] < 0.6 for colour in PALETTE)
