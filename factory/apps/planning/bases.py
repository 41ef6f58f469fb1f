"""The base of a product: the part onto which an engineer puts all others."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from factory.api import Array
from factory.apps.planning.blocking import Blocking

LIKELY = 3
"""So many parts are tried as the base, the likeliest first."""

EQUAL = 1.05
"""Cycle times within this factor are equal where sense decides."""


def worth(graphs: Blocking, masses: Array, fasteners: Collection[int] = ()) -> Array:
    """How much each unit is like a base (n,), from its mass (n,) [kg]: how many others are near it,
    and rest on it, as shares of the most, and its share of the greatest mass. Fasteners are none,
    and do not count."""
    others = np.ones(len(graphs), bool)
    others[list(fasteners)] = False
    near = graphs.near & others & others[:, None]
    share = masses / max(float(masses[others].max()), 1e-12)
    for count in (near.sum(axis=1) - others, (graphs.rests & near & ~graphs.rests.T).sum(axis=0)):
        share = share + count / max(int(count.max()), 1)
    return np.where(others, share, -1.0)


def likely(graphs: Blocking) -> list[int]:
    """The units that may be the base, the likeliest first."""
    order = np.argsort(-graphs.worth, kind="stable")[:LIKELY].tolist()
    return [unit for unit in order if graphs.worth[unit] >= 0]
