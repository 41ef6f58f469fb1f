"""Solids as drawn: what two have in common, by how much, and what one sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.floor.geometry.distances import distances_to
from factory.floor.geometry.overlap import _deepest, common, drawn, merged, swept
from factory.floor.geometry.overlapping import Overlapping
from factory.floor.geometry.product import product_geometry
from factory.pipeline import all_templates
from factory.theory.lang.pag_reader import load_pag

SMALL = 1e-12
"""A volume [m³] that rounding makes."""


def block(*size: float, at: tuple[float, float, float] = (0, 0, 0)) -> Manifold:
    """A box of these lengths about a point [mm]."""
    return Manifold.cube(1e-3 * np.array(size), True).translate(1e-3 * np.array(at))


def rod(radius: float, height: float) -> Manifold:
    """An upright cylinder about the origin [mm]."""
    return Manifold.cylinder(1e-3 * height, 1e-3 * radius, -1.0, 96, True)


FRAME = block(80, 80, 60) - block(40, 40, 100)


@pytest.mark.parametrize(
    ("one", "other", "depth"),
    [
        (block(20, 20, 20), block(20, 20, 20, at=(0, 0, 19.6)), 0.4),
        (block(20, 20, 20), block(20, 20, 20, at=(0, 0, 20)), 0.0),
        (FRAME, block(40.8, 40.8, 60), 0.4),
        (FRAME, block(39.8, 39.8, 60), 0.0),
        (block(80, 80, 10) - rod(10, 30), rod(10.1, 60), 0.1),
        (block(80, 80, 10) - rod(10, 30), rod(9.9, 60), 0.0),
        (block(80, 80, 10), rod(2, 60), 2.0),
    ],
)
def test_the_depth_is_the_least_erosion_that_parts_two_solids(one, other, depth):
    for a, b in ((one, other), (other, one)):
        assert 1e3 * common(a, b).depth == pytest.approx(depth, rel=0.02, abs=1e-6)


def test_the_deepest_point_is_that_of_all_distances():
    """Points that are not measured are no deeper."""
    points = np.random.default_rng(0).uniform(-0.03, 0.03, (200, 3))
    for body in (FRAME, rod(30, 60), Manifold.sphere(0.03, 64)):
        vertices, faces = merged(body.to_mesh64())
        every = distances_to(points, vertices[faces])
        box = np.array([[-1.0] * 3, [1.0] * 3])
        assert _deepest(points, body, box) == (every.max(), every.argmax())


def test_depths_do_not_depend_on_where_the_product_is():
    def away(body: Manifold) -> Manifold:
        return body.rotate([17, 31, 5]).translate([0.3, -1.2, 0.7])

    peg = block(40.8, 40.8, 60)
    assert common(away(FRAME), away(peg)).depth == pytest.approx(4e-4, rel=1e-6)
    assert common(away(FRAME), away(block(40, 40, 60))).depth < 1e-9


def heap(rng: np.random.Generator) -> Manifold:
    sizes, places = rng.integers(1, 5, (3, 3)), rng.integers(-4, 5, (3, 3))
    blocks = [block(*size, at=place) for size, place in zip(sizes, places, strict=True)]
    return blocks[0] + blocks[1] - blocks[2]


def test_what_is_swept_is_met_where_some_step_of_the_way_is_met():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        one, other = heap(rng), heap(rng).translate([0.004, 0, 0]).rotate(10 * rng.random(3))
        shift = 1e-3 * rng.integers(-8, 9, 3).astype(float)
        steps = [common(one.translate(t * shift), other).volume for t in np.linspace(0, 1, 60)]
        way = common(swept(one, shift), other, both=False)
        assert way.volume >= max(steps) - SMALL
        if max(steps) == 0.0:  # between two steps it comes no further than this
            assert way.depth < 1e-3 * np.linalg.norm(shift)


def test_a_thin_wall_on_the_way_is_cut():
    wall = block(0.1, 50, 50, at=(30, 0, 0))
    way = common(swept(block(5, 5, 5), np.array([0.2, 0, 0])), wall, both=False)
    assert way.volume == pytest.approx(0.1 * 5 * 5 * 1e-9, rel=1e-6)
    assert way.depth == pytest.approx(5e-5, rel=1e-6)


def test_walls_that_are_upright_up_to_rounding_are_swept_as_they_are():
    """Of many that face the way, each by itself: their prisms touch in edges."""
    plain = rod(5, 30).refine(12)
    noise = np.random.default_rng(5).normal(0.0, 2e-9, (3, plain.num_vert()))
    body = plain.warp_batch(lambda corners: corners + noise[:, : len(corners)].T)
    wall = block(40, 40, 4, at=(0, 0, 40))
    way = common(swept(body, np.array([0, 0, 0.06])), wall, both=False)
    area = plain.volume() / 0.03
    assert way.volume == pytest.approx(4e-3 * area, rel=1e-4)
    assert way.depth == pytest.approx(2e-3, rel=0.02)


def test_sliding_along_a_face_cuts_nothing():
    floor = block(200, 200, 10, at=(0, 0, -7.5))
    turned = [body.rotate([0, 0, 29]) for body in (block(5, 5, 5), floor)]
    assert common(swept(turned[0], np.array([0.15, 0.02, 0])), turned[1]).depth < 1e-9


TEXT = """
root = all;
all = mate ( core, ball );
core = mate ( ring, pin );
ring = atomic ( mesh = "ring.stl", scale = 0.001 );
pin = atomic ( cylinder = (0.0051, 0.04) );
ball = atomic ( sphere = 0.004, pos = (0, 0, 0.0239) )
"""


def bodies_of(folder: Path, text: str, mesh: trimesh.Trimesh) -> dict[str, Any]:
    """The volumes of a product's parts, with a mesh in the file that the text names."""
    (folder / "product.pag").write_text(text)
    (folder / "ring.stl").write_bytes(mesh.export(file_type="stl"))
    product = product_geometry(load_pag(folder / "product.pag", all_templates()))
    assert all(drawn(solid) is drawn(solid) for solid in product.solids.values())  # made once
    return {label: drawn(solid) for label, solid in product.solids.items()}


def test_parts_of_a_product_overlap_as_they_are_drawn(tmp_path):
    mesh = trimesh.creation.annulus(5.0, 20.0, 10.0, sections=64)
    ring, pin, ball = bodies_of(tmp_path, TEXT, mesh).values()
    assert common(ring, pin).depth == pytest.approx(1e-4, rel=0.1)
    assert common(pin, ball).depth == pytest.approx(1e-4, rel=0.1)
    assert common(ball.translate((0, 0, 0.001)), pin).depth == 0.0
    assert common(swept(ring, np.array([0.1, 0, 0])), pin, both=False).depth > 3e-3
    assert common(swept(ring, np.array([0, 0, 0.1])), ball, both=False).depth == 0.0  # through


def test_an_open_mesh_has_no_solid(tmp_path):
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    box.update_faces(np.arange(12) > 5)
    text = 'root = ring; ring = atomic ( mesh = "ring.stl", scale = 0.001 )'
    assert bodies_of(tmp_path, text, box) == {"ring": None}


def test_an_overlap_that_is_all_facets_is_said_to_be_and_may_be_allowed() -> None:
    for sagitta, is_facets in ((1e-4, False), (2e-4, True), (3e-4, True)):
        fault = Overlapping("peg", "hole", 2e-4, sagitta).fault(())
        assert fault is not None
        assert ("may be their facets" in fault.message) == is_facets
        assert (fault.hint or "").endswith(f"peg:hole:{1e3 * sagitta:g}mm") == is_facets
