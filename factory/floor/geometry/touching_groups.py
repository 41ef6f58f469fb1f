"""Groups of parts of a finished product that touch each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from factory.floor.geometry.overlap import drawn
from factory.floor.geometry.overlapping import near_pairs
from factory.floor.geometry.solids import Product, Solid
from factory.support.errors import Diagnostic

NEAR, NEARLY = 1e-3, (0.05, 0.005)
"""The largest gap between parts that touch [m], at most the first and at least the second share of
the product's diagonal."""

NAMED = 6
"""The most groups that a message names."""


@dataclass(frozen=True, slots=True)
class TouchingGroups:
    """The groups of parts that touch each other, the largest first, each by the label of its first
    part and the number of its parts; no two are nearer to each other than `reach` [m]."""

    firsts: tuple[tuple[str, int], ...]
    reach: float

    def __str__(self) -> str:
        named = [
            f"'{label}'" + (f" and {count - 1} more" if count > 1 else "")
            for label, count in self.firsts[:NAMED]
        ]
        more = len(self.firsts) - len(named)
        listed = ", ".join(named) + (f", and {more} more" if more else "")
        return (
            f"{len(self.firsts)} groups that do not touch each other "
            f"({1e3 * self.reach:.1f} mm at least between them): {listed}"
        )


def groups_of(solids: Sequence[Solid]) -> TouchingGroups:
    """The groups of some solids in place."""
    low = np.min([solid.low for solid in solids], axis=0)
    high = np.max([solid.high for solid in solids], axis=0)
    size = float(np.linalg.norm(high - low))
    reach = max(min(NEAR, NEARLY[0] * size), NEARLY[1] * size)
    group = np.arange(len(solids))
    for one, other in near_pairs(solids, reach).tolist():
        if group[one] != group[other] and _gap(solids[one], solids[other], reach) < reach:
            group[group == group[other]] = group[one]
    counts = Counter(group.tolist())
    firsts = {number: solids[int(np.argmax(group == number))].label for number in counts}
    return TouchingGroups(tuple((firsts[n], count) for n, count in counts.most_common()), reach)


def _gap(one: Solid, other: Solid, reach: float) -> float:
    """The distance of two parts [m], at most `reach`; 0 if the hull of one overlaps that of the
    other, as with links of a chain. An open mesh is represented by its hull."""
    from manifold3d import Manifold

    bodies = [drawn(solid) for solid in (one, other)]
    hulls: list[Any] = [
        body.hull() if body else Manifold.hull_points(solid.corners)
        for body, solid in zip(bodies, (one, other), strict=True)
    ]
    if (hulls[0] ^ hulls[1]).volume() > 0:
        return 0.0
    pair = [body or hull for body, hull in zip(bodies, hulls, strict=True)]
    return float(pair[0].min_gap(pair[1], reach))


def apart_in(product: Product, *insides: frozenset[str]) -> tuple[Diagnostic, ...]:
    """A warning (Apart) for each product whose parts are in several groups, computed once;
    `insides`: the parts of each of several products, none for one."""
    return product.kept(_warnings, insides)


def _warnings(product: Product, insides: tuple[frozenset[str], ...]) -> tuple[Diagnostic, ...]:
    warnings = []
    for inside in insides or (frozenset(product.solids),):
        solids = [solid for label, solid in product.solids.items() if label in inside]
        groups = groups_of(solids) if len(solids) > 1 else None
        if groups and len(groups.firsts) > 1:
            hint = "move them to their places, or add the parts that are missing between them"
            warnings.append(Diagnostic("Apart", f"the parts are {groups}", None, hint))
    return tuple(warnings)
