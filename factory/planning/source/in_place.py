"""Whether parts are where they are in the finished product: not one inside another, as where each
was exported about its own origin, and not in groups that touch nothing, as on a print bed or in an
exploded display. Judged on the solids as drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.overlap import Common, common, drawn
from factory.geometry.solids import Solid
from factory.nets.verdict import listing
from factory.planning.parts import PlacedPart
from factory.support.errors import Diagnostic

SHARE, DEPTH, MOST = 0.01, 5e-4, 0.5
"""Parts are not in place that have more than the first share of the smaller in common and overlap
by more than so much [m], which is more than a press fit, or have more than the second share of it
in common."""

THIN = 0.25
"""Of a sheet less is too deep: this share of its thickness."""

NEAR, NEARLY = 1e-3, (0.05, 0.005)
"""Parts touch that are no further apart than this [m], or than the first share of the product's
diagonal where that is less, or than the second share where that is more."""

NAMED = 6
"""So many pairs, or groups, are named."""

HINT = "--in-place says that they are in place all the same"


def check_in_place(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """What shows that parts are not in place (NotInPlace), nothing if they are."""
    solids = [part.solid for part in parts]
    bodies = [drawn(solid) for solid in solids]
    faults = _inside(solids, bodies)
    return faults or _groups(solids, bodies)


def _pairs(solids: Sequence[Solid], gap: float) -> Array:
    """The pairs (n, 2) of solids whose boxes are no further apart than a gap [m]."""
    low = np.array([solid.low for solid in solids])
    high = np.array([solid.high for solid in solids])
    found = [np.zeros((0, 2), np.int64)]
    for one in range(len(solids)):
        near = (low[one] <= high[one + 1 :] + gap) & (low[one + 1 :] <= high[one] + gap)
        others = one + 1 + np.flatnonzero(near.all(axis=1))
        found.append(np.column_stack([np.full(len(others), one), others]))
    return np.concatenate(found)


def _inside(solids: Sequence[Solid], bodies: Sequence[Any]) -> list[Diagnostic]:
    """Parts that are one inside another."""
    found: list[tuple[float, str, str, Common]] = []
    for one, other in _pairs(solids, -DEPTH):
        if bodies[one] is None or bodies[other] is None:
            continue
        small, large = sorted((one, other), key=lambda n: float(bodies[n].volume()))
        shared = common(bodies[small], bodies[large])
        share = shared.volume / float(bodies[small].volume())
        thinner = min(2 * bodies[n].volume() / bodies[n].surface_area() for n in (one, other))
        if share > MOST or (share > SHARE and shared.depth > min(DEPTH, THIN * thinner)):
            found.append((share, solids[small].label, solids[large].label, shared))
    if not found:
        return []
    found.sort(key=lambda pair: -pair[0])
    named = [
        f"{share:.0%} of '{small}' is in '{large}' ({1e3 * shared.depth:.1f} mm deep)"
        for share, small, large, shared in found
    ]
    pairs = (
        "a pair of parts overlaps" if len(found) == 1 else f"{len(found)} pairs of parts overlap"
    )
    message = f"these parts are not in place: {pairs}: {listing(named, NAMED)}"
    hint = f"export each where it is in the finished product, not about its own origin; {HINT}"
    return [Diagnostic("NotInPlace", message, None, hint)]


def _groups(solids: Sequence[Solid], bodies: Sequence[Any]) -> list[Diagnostic]:
    """Groups of parts that touch none of the others."""
    low = np.min([solid.low for solid in solids], axis=0)
    high = np.max([solid.high for solid in solids], axis=0)
    size = float(np.linalg.norm(high - low))
    reach = max(min(NEAR, NEARLY[0] * size), NEARLY[1] * size)
    group = list(range(len(solids)))
    for one, other in _pairs(solids, reach).tolist():
        if group[one] != group[other] and _gap(solids, bodies, one, other, reach) < reach:
            group = [group[one] if g == group[other] else g for g in group]
    sizes = Counter(group).most_common()
    if len(sizes) == 1:
        return []
    named = []
    for first, count in sizes:
        label = solids[group.index(first)].label
        named.append(f"'{label}'" + (f" and {count - 1} more" if count > 1 else ""))
    message = (
        f"these parts are not in place: they are {len(sizes)} groups that touch none of the others "
        f"({1e3 * reach:.1f} mm at least between them): {listing(named, NAMED)}"
    )
    hint = f"a print bed, an exploded view, or a part that is missing? {HINT}"
    return [Diagnostic("NotInPlace", message, None, hint)]


def _gap(
    solids: Sequence[Solid], bodies: Sequence[Any], one: int, other: int, reach: float
) -> float:
    """How far two parts are apart [m], `reach` for that and more; 0 where the hull of one reaches
    into that of the other, as of links of a chain. An open mesh is its hull."""
    from manifold3d import Manifold

    hulls = [Manifold.hull_points(solids[n].corners) for n in (one, other)]
    if (hulls[0] ^ hulls[1]).volume() > 0:
        return 0.0
    pair = [bodies[n] or hull for n, hull in zip((one, other), hulls, strict=True)]
    return float(pair[0].min_gap(pair[1], reach))
