"""The base of a product: the part onto which an engineer puts all others."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from factory.apps.planning.blocking import Blocking, closure
from factory.support.arrays import Array

LIKELY = 3
"""So many parts are tried as the base, the likeliest first."""

EQUAL = 1.05
"""Cycle times within this factor are equal where sense decides."""


def worth(graphs: Blocking, masses: Array, fasteners: Collection[int] = ()) -> Array:
    """How much each unit is like a base (n,), from its mass (n,) [kg]: how many others are near it,
    how many rest on it, also through others, its mass, and the volume of its box, as shares of the
    most, less the mass of what it rests on. Fasteners are none, and do not count."""
    others = np.ones(len(graphs), bool)
    others[list(fasteners)] = False
    near = graphs.near & others & others[:, None]
    rests = closure(graphs.rests & near)
    rests &= ~rests.T
    box = np.prod(graphs.high - graphs.low, axis=1)
    share = -(rests @ masses) / max(float(masses[others].max()), 1e-12)
    for table in (near.sum(axis=1) - others, rests.sum(axis=0), masses, box):
        share = share + table / max(float(table[others].max()), 1e-12)
    return np.where(others, share, -np.inf)


def likely(graphs: Blocking) -> list[int]:
    """The units that may be the base, the likeliest first."""
    order = np.argsort(-graphs.worth, kind="stable")[:LIKELY].tolist()
    return [unit for unit in order if np.isfinite(graphs.worth[unit])]
