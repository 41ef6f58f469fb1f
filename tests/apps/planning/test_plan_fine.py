"""Parts of many triangles: decimated bodies decide nothing that the parts themselves would not, and
nothing is decomposed before there is a tree."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

from factory.floor.geometry.decimation import ENOUGH, decimated

SIDES = 512
"""The sides of round parts."""


def ball(radius: float) -> Manifold:
    return Manifold.sphere(radius, SIDES // 4)


@pytest.mark.parametrize("within", [1e-2])
def test_a_decimated_body_is_as_near_as_it_says(within: float) -> None:
    body = ball(8.0)
    coarse = decimated(body, within)
    assert coarse.body.num_tri() < body.num_tri() and 0 < coarse.far <= within
    points = np.asarray(coarse.body.to_mesh64().vert_properties)
    middles = points[np.asarray(coarse.body.to_mesh64().tri_verts).astype(int)].mean(axis=1)
    sunk = 8.0 - np.linalg.norm(middles, axis=1).min()
    assert sunk <= 3 * within, "the surface has not gone elsewhere"


def test_what_is_coarse_enough_stays_as_it_is() -> None:
    body = Manifold.sphere(8.0, 32)
    assert body.num_tri() <= ENOUGH
    assert decimated(body, 1.0).body is body


def test_a_tolerance_that_no_coarser_body_keeps_gives_the_body_itself() -> None:
    body = ball(8.0)
    coarse = decimated(body, 1e-9)
    assert coarse.far == 0.0 and coarse.body.num_tri() == body.num_tri()
