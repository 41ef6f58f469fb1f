"""Faults of parts in place: two in one place, one in another unit, one far away; parts that are not
in place.

Parts are not in place if one is inside another, as where each was exported about its own origin, or
if they are in groups that touch nothing, as on a print bed or in an exploded view. This is judged
on the solids as drawn.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.overlap import Common, common, drawn
from factory.geometry.overlapping import near_pairs
from factory.geometry.solids import Solid
from factory.geometry.touching import connected
from factory.nets.verdict import listing
from factory.planning.parts import PlacedPart
from factory.support.errors import Diagnostic, InputError

LARGER = 50.0
"""A part that is more than this many times as large as the largest other one, or as much smaller
than the smallest, may be in another unit."""

UNIT, SPREAD = 1000.0, 4.0
"""It is taken to be, where a thousandth, or a thousand times its size, is among the sizes of the
others, give or take this factor."""

AWAY = 2.0
"""Parts are away from each other that have so many times the larger one's size between them."""

EQUAL = 1e-4
"""Vertices of two parts are in one place that are nearer than this share of their size."""


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


def check_places(
    parts: Sequence[PlacedPart], has_tree: bool, unit_is_given: bool
) -> list[Diagnostic]:
    """Raises InputError (UsedTwice, Size, FarAway) with every fault. A unit that is given is taken
    to be that of all parts. Of a product that has a tree, so that someone has made it, two parts in
    one place are no fault, but a warning, which is given back."""
    twice = _twice(parts)
    faults = ([] if has_tree else twice) + ([] if unit_is_given else _units(parts))
    raise_if_any(faults or _far(parts))
    return twice


def raise_if_any(faults: Sequence[Diagnostic]) -> None:
    """Raises one InputError with all faults, if there is any."""
    if faults:
        raise InputError(faults)


def _twice(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """Parts of one kind in one place."""
    from scipy.spatial import cKDTree

    seen: dict[str, list[PlacedPart]] = {}
    faults = []
    for part in parts:
        same = seen.setdefault(part.kind, [])
        reach = EQUAL * float(np.linalg.norm(part.solid.high - part.solid.low))
        for other in same:
            if np.abs(other.solid.low - part.solid.low).max() > reach:
                continue
            if np.abs(other.solid.high - part.solid.high).max() > reach:
                continue
            if cKDTree(other.vertices).query(part.vertices)[0].max() <= reach:
                message = f"'{part.label}' is where '{other.label}' is already, the same shape"
                hint = "remove one of the two, or move it to where it belongs"
                faults.append(Diagnostic("UsedTwice", message, part.node.position, hint))
                break
        else:
            same.append(part)
    return faults


def _units(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """A part whose size is that of the others in another unit."""
    sizes = np.array([np.linalg.norm(p.solid.high - p.solid.low) for p in parts])
    faults = []
    for index, part in enumerate(parts if len(parts) > 2 else ()):
        size, others = sizes[index], np.delete(sizes, index)
        low, high = others.min() / SPREAD, others.max() * SPREAD
        if size > LARGER * others.max() and low <= size / UNIT <= high:
            much, way = size / others.max(), "in millimetres, and the others in metres"
            than = f"{much:.0f} times as large as the largest"
        elif size * LARGER < others.min() and low <= size * UNIT <= high:
            much, way = others.min() / size, "in metres, and the others in millimetres"
            than = f"{much:.0f} times as small as the smallest"
        else:
            continue
        message = f"'{part.label}' is {than} of the other parts: it may be {way}"
        hint = "export it in the unit of the others; --unit says that all are in the same"
        faults.append(Diagnostic("Size", message, part.node.position, hint))
    return faults


def _far(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """Parts that are away from all others."""
    low, high = (np.array([getattr(p.solid, end) for p in parts]) for end in ("low", "high"))
    size = np.linalg.norm(high - low, axis=1)
    pairs = [np.zeros((0, 2), np.int64)]
    for index in range(len(parts)):
        gaps = _gaps(low[index], high[index], low, high)
        close = np.flatnonzero(gaps <= AWAY * np.maximum(size[index], size))
        pairs.append(np.column_stack([np.full(len(close), index), close]))
    number = connected(np.concatenate(pairs), len(parts))
    groups = [np.flatnonzero(number == group) for group in range(number.max() + 1)]
    main, *others = sorted(groups, key=lambda group: (-len(group), group[0]))
    within = float(np.linalg.norm(high[main].max(axis=0) - low[main].min(axis=0)))
    faults = []
    for group in others:
        index = int(group[0])
        away = float(_gaps(low[index], high[index], low[main], high[main]).min())
        more = f" and {len(group) - 1} more by it" if len(group) > 1 else ""
        message = (
            f"'{parts[index].label}'{more}: {away:.4g} m away from the other parts, "
            f"which are within {within:.4g} m"
        )
        hint = "parts are where they are in the finished product: move it there, or remove it"
        faults.append(Diagnostic("FarAway", message, parts[index].node.position, hint))
    return faults


def _gaps(low: Array, high: Array, lows: Array, highs: Array) -> Array:
    """The distances (n,) between a box and others."""
    return np.asarray(np.linalg.norm(np.maximum(0.0, np.maximum(lows - high, low - highs)), axis=1))


def check_in_place(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """What shows that parts are not in place (NotInPlace), nothing if they are."""
    solids = [part.solid for part in parts]
    bodies = [drawn(solid) for solid in solids]
    faults = _inside(solids, bodies)
    return faults or _groups(solids, bodies)


def _inside(solids: Sequence[Solid], bodies: Sequence[Any]) -> list[Diagnostic]:
    """Parts that are one inside another."""
    found: list[tuple[float, str, str, Common]] = []
    for one, other in near_pairs(solids, -DEPTH).tolist():
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
    for one, other in near_pairs(solids, reach).tolist():
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
