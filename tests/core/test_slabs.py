"""Convex prisms in place of a body: they contain nearly all of it, and little else."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from factory.floor.geometry.distances import distances_to
from factory.floor.geometry.overlap import merged
from factory.floor.geometry.slabs import slabs

ALLOWED, WITHIN = 2e-3, 1e-4


def machined(seed: int) -> Manifold:
    """A plate with a boss on it, bores from above, some of them blind, and one from the side; it
    lies in any attitude."""
    rng = np.random.default_rng(seed)
    wide, deep, thick = rng.uniform(0.06, 0.1), rng.uniform(0.04, 0.08), rng.uniform(0.01, 0.03)
    body = Manifold.cube((wide, deep, thick), True)
    body += Manifold.cylinder(thick, deep / 4, -1.0, 64)
    for _ in range(rng.integers(1, 7)):
        x, y = rng.uniform(-0.4, 0.4, 2) * (wide, deep)
        bore = Manifold.cylinder(3 * thick, rng.uniform(0.002, 0.008), -1.0, 64)
        body -= bore.translate((x, y, rng.uniform(-2, 0.3) * thick))
    side = Manifold.cylinder(1.0, thick / 5, -1.0, 64, True).rotate((90.0, 0.0, 0.0))
    body -= side.translate((rng.uniform(-0.4, 0.4) * wide, 0.0, 0.0))
    return body.rotate(rng.uniform(0, 360, 3)).translate((0.3, -0.2, 0.1))


@pytest.mark.parametrize("seed", range(4))
def test_prisms_are_nearly_the_body(seed: int) -> None:
    body = machined(seed)
    vertices, faces = merged(body.to_mesh64())
    pieces = slabs(vertices, faces, ALLOWED, WITHIN)
    whole = Manifold.batch_boolean([Manifold.hull_points(p) for p in pieces], OpType.Add)
    assert len(pieces) > 3
    assert (body - whole).volume() <= 2e-3 * body.volume()
    beyond = merged((whole - body).to_mesh64())[0]
    assert distances_to(beyond, vertices[faces]).max() <= 2 * ALLOWED + WITHIN


def test_a_body_without_an_axis_is_left_to_others() -> None:
    ball = merged(Manifold.sphere(0.05, 64).to_mesh64())
    assert slabs(*ball, ALLOWED, WITHIN) == ()


def test_narrow_holes_are_closed_and_many_wide_ones_are_left_to_others() -> None:
    plate = Manifold.cube((0.1, 0.1, 0.004), True)
    places = [(x, y, 0.0) for x in np.linspace(-0.045, 0.045, 15) for y in (-0.02, 0.0, 0.02)]
    for radius, count in ((ALLOWED / 2.1, 1), (ALLOWED, 0)):
        hole = Manifold.cylinder(0.1, radius, -1.0, 48, True)
        body = plate - Manifold.compose([hole.translate(at) for at in places])
        assert len(slabs(*merged(body.to_mesh64()), ALLOWED, 1e-6)) == count
