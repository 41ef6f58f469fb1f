"""Coarser meshes of the same bodies, and how far they are from them.

Edges are collapsed, so the vertices that are left are some of the body's, and a body with a hole
keeps it. How far the surfaces are apart is measured, not assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from factory.floor.geometry.distances import distances_to
from factory.floor.geometry.overlap import merged

ENOUGH = 2000
"""A body of so many triangles is coarse enough."""

STEPS = 16.0, 8.0, 4.0, 2.0, 1.0
"""Collapses are tried up to these fractions of the tolerance, the finest first."""

SAMPLES = 1200
"""The most vertices at which the distance is measured."""


@dataclass(frozen=True, slots=True)
class Coarse:
    """A body, a `manifold3d.Manifold`, and how `far` its surface is from that of the body it was
    made of [m], 0 for the same body."""

    body: Any = field(repr=False)
    far: float = 0.0


def decimated(body: Any, within: float, enough: int = ENOUGH) -> Coarse:
    """The body with no more than `enough` triangles or, if there is none `within` a distance [m] of
    it, the one with fewest triangles."""
    if body.num_tri() <= enough:
        return Coarse(body)
    tried = []
    for share in STEPS:
        tried.append(body.simplify(within / share))
        if tried[-1].num_tri() <= enough:
            break
    for one in tried[::-1]:
        if one.num_tri() < body.num_tri() and one.volume() > 0:
            far = _apart(body, one)
            if far <= within:
                return Coarse(one, far)
    return Coarse(body)


def _apart(fine: Any, coarse: Any) -> float:
    """How far vertices that a body has lost are from the surface of one made of it [m]."""
    from scipy.spatial import cKDTree

    (vertices, faces), (left, coarser) = merged(fine.to_mesh64()), merged(coarse.to_mesh64())
    used = vertices[np.unique(faces)]
    lost = used[cKDTree(left).query(used)[0] > 0]
    return float(distances_to(lost[:: -(-len(lost) // SAMPLES)], left[coarser]).max(initial=0.0))
