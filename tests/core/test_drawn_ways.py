"""Ways of parts as they are drawn: a pin in a ring, a post beside, and what is known of them once
the product is turned."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.floor.geometry.overlap import Common, common, swept
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.floor.mating.bodies import bodies
from factory.floor.mating.drawn import DrawnWays
from factory.floor.mating.finder import Finder
from factory.floor.mating.paths import CLEAR, TOLERANCE, Depths
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates

TEXT = """
root = all;
all = mate ( ring, pin, post );
ring = atomic ( mesh = "ring.stl", scale = 0.001 {turn} );
pin = atomic ( cylinder = ({radius}, 0.04) {turn} );
post = atomic ( box = (0.004, 0.004, 0.04), pos = {place} {turn} )
"""
"""A ring of 20 mm with a bore of 5 mm, what is in it, and a post 10 mm beside it."""

RING, PIN, POST = range(3)

TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Brings x onto y, y onto z, z onto x."""

COARSE, FINE = 64, 900
"""Sections of a ring; one of so many is decimated first."""


def product_of(folder: Path, sections: int, radius: float = 0.0049, turn: bool = False) -> Product:
    mesh = trimesh.creation.annulus(5.0, 20.0, 10.0, sections=sections)
    (folder / "ring.stl").write_bytes(mesh.export(file_type="stl"))
    place = np.array([0.03, 0.0, 0.01])
    place, quat = (TURN @ place, ", quat = (1, 1, 1, 1)") if turn else (place, "")
    text = TEXT.format(radius=radius, place=tuple(place.tolist()), turn=quat)
    (folder / "product.pag").write_text(text)
    product = product_geometry(load_pag(folder / "product.pag", all_templates()))
    assert list(product.solids) == ["ring", "pin", "post"]
    return product


def ways_of(product: Product) -> DrawnWays:
    return DrawnWays(bodies(product, [*product.solids]))


def found(ways: DrawnWays, moving: int, standing: int, axis: int, still: bool = False) -> Depths:
    return ways.depths(np.array([moving]), np.array([standing]), np.array([still]), axis)


@pytest.mark.parametrize("sections", [COARSE, FINE])
def test_a_pin_leaves_a_ring_along_its_bore_alone(tmp_path: Path, sections: int) -> None:
    """Across it the pin is deepest in the middle of the ring's wall, which is 15 mm wide."""
    ways = ways_of(product_of(tmp_path, sections))
    along = found(ways, PIN, RING, 2)
    assert not along.faulty.any() and (along.path == 0.0).all()
    for axis in (0, 1):
        across = found(ways, PIN, RING, axis)
        assert across.faulty.all() and (across.finished == 0.0).all()
        assert across.path == pytest.approx(np.full((1, 2), 0.005), rel=0.03)
        assert across.shift == pytest.approx(np.full((1, 2), 0.015), rel=0.03)


def test_what_stands_still_is_looked_at_where_it_is(tmp_path: Path) -> None:
    ways = ways_of(product_of(tmp_path, COARSE, radius=0.0053))
    still, moved = (found(ways, PIN, RING, 0, still) for still in (True, False))
    assert still.finished == moved.finished > 2e-4
    assert (still.path == still.finished).all() and (still.graze == -np.inf).all()
    assert (moved.path > 10 * moved.finished).all()


@pytest.mark.parametrize("sections", [COARSE, FINE])
def test_a_pin_that_has_little_room_grazes(tmp_path: Path, sections: int) -> None:
    """0.03 mm, or less where the bore has corners; with a pin of 0.1 mm less nothing is near."""
    tight = found(ways_of(product_of(tmp_path, sections, radius=0.00497)), PIN, RING, 2)
    assert (tight.path <= TOLERANCE).all() and tight.faulty.all()
    assert ((tight.graze > -3.1e-5) & (tight.graze < -1e-5)).all()
    loose = found(ways_of(product_of(tmp_path, sections)), PIN, RING, 2)
    assert (loose.graze == -CLEAR).all()


def test_a_post_beside_a_ring_comes_from_its_side(tmp_path: Path) -> None:
    ways = ways_of(product_of(tmp_path, COARSE))
    assert found(ways, POST, RING, 0).faulty.tolist() == [[True, False]]
    assert found(ways, RING, POST, 0).faulty.tolist() == [[False, True]]
    assert not found(ways, POST, RING, 1).faulty.any()


def test_what_was_measured_of_a_product_holds_for_it_turned(tmp_path: Path) -> None:
    """As what is measured of the turned product itself."""
    first, alone = (product_of(tmp_path, COARSE, turn=turn) for turn in (False, True))
    every = [(*pair, axis) for pair in permutations(range(3), 2) for axis in range(3)]
    measured = ways_of(first)
    for case in every:
        found(measured, *case)
    known, anew = ways_of(replace(alone, twin=(first, TURN))), ways_of(alone)
    known._path = pytest.fail  # type: ignore[method-assign,assignment]
    for case in every:
        one, other = found(known, *case), found(anew, *case)
        assert (one.faulty == other.faulty).all(), case
        assert one.path == pytest.approx(other.path, rel=0.05, abs=1e-6), case


class Stubbed(DrawnWays):
    """Ways of bodies (manifolds), by number, of which nothing is measured beforehand."""

    def __init__(self, *drawn_bodies: Any, margin: float = 0.0) -> None:
        self._bodies, self._off = drawn_bodies, margin

    _beyond = 0.1  # type: ignore[assignment]

    def _body(self, part: int) -> Any:
        return self._bodies[part]

    def _coarse(self, part: int) -> Any:
        return SimpleNamespace(body=self._bodies[part], far=0.0)

    def _swept(self, part: int, axis: int, sign: int) -> Any:
        return swept(self._bodies[part], sign * self._beyond * np.eye(3)[axis])

    def _margin(self, one: int, other: int) -> float:
        return self._off

    def finished(self, one: int, other: int) -> Common:
        return common(self._bodies[one], self._bodies[other])


def cube(x: float, *sizes: float) -> Any:
    """A box about a point on the x axis [mm]."""
    return Manifold.cube([1e-3 * size for size in sizes], True).translate([1e-3 * x, 0, 0])


def test_a_part_meets_with_the_first_wall_that_comes() -> None:
    """It has come so far that the middle of that wall is there."""
    walls = cube(11, 2, 40, 40) + cube(31, 2, 40, 40)
    cut: Any = SimpleNamespace(deepest=np.zeros(3))
    assert Stubbed(walls)._shift(cut, 0, 0, -1) == pytest.approx(0.011)


@pytest.mark.parametrize(("gap", "passes"), [(CLEAR, False), (CLEAR + 2.1e-4, True)])
def test_decimated_parts_pass_with_room_for_what_they_may_be_off(gap: float, passes: bool) -> None:
    post, wall = cube(0, 10, 2, 2), cube(0, 10, 2, 2).translate([0, 0.002 + gap, 0])
    found = Stubbed(post, wall, margin=2e-4)._coarsely(0, 1, 0, 1)
    assert found == ((0.0, 0.0) if passes else None)


def test_a_way_leads_out_of_a_small_product(tmp_path: Path) -> None:
    """Two sheets 2.8 mm apart, face to face: the first passes the second on one side."""
    text = "root = all; all = mate ( a, b ); " + "; ".join(
        f"{name} = atomic ( box = (0.0001, 0.002, 0.002), pos = ({x}, 0, 0) )"
        for name, x in (("a", 0.0), ("b", 0.0029))
    )
    (tmp_path / "small.pag").write_text(text)
    ways = ways_of(product_geometry(load_pag(tmp_path / "small.pag", all_templates())))
    assert found(ways, 0, 1, 0).path == pytest.approx(np.array([[0.0, 5e-5]]))


def test_the_keys_of_pairs_ascend_as_pairs_are_sorted(tmp_path: Path) -> None:
    finder = Finder.at_once(product_of(tmp_path, COARSE))
    meeting, standing, moving = np.array([*product(range(4), range(3), range(3))]).T
    assert (np.diff(finder._key_of(meeting, moving, standing)) > 0).all()


def test_the_room_of_a_pin_in_a_ring_is_that_of_its_bore(tmp_path: Path) -> None:
    finder = Finder.at_once(product_of(tmp_path, COARSE, radius=0.0049))
    moving, standing, room = finder.rooms(2, 1e-3)
    (row,) = ((moving == PIN) & (standing == RING)).nonzero()[0]
    assert room[row] == pytest.approx([1e-4, 1e-4], abs=2e-5)


def test_what_a_sweep_has_twice_counts_once() -> None:
    dice, wall = cube(0, 2, 2, 2), cube(0, 2, 40, 40)

    class Twice:
        def __xor__(self, other: Any) -> Any:
            return SimpleNamespace(volume=lambda: 2 * dice.volume(), surface_area=dice.surface_area)

        def decompose(self) -> list[Any]:
            return [dice, dice]

    ways = Stubbed(dice, wall)
    ways._swept = lambda *_: Twice()  # type: ignore[method-assign]
    assert not ways._cuts(0, 1, 0, -1)
