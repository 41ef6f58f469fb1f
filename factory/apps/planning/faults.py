"""Faults of parts in place: two in one place, one in another unit, one far away; parts that are not
in place.

Parts are not in place if one is inside another, as where each was exported about its own origin, or
if they are in groups that touch nothing, as on a print bed or in an exploded view. This is judged
on the solids as drawn.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from factory.api import Diagnostic, DrawnSolids, InputError
from factory.apps.planning.parts import PlacedPart
from factory.support.arrays import Array
from factory.support.errors import listing
from factory.support.meshes.bodies import connected

LARGER = 50.0
"""A part that is more than this many times larger than the largest other part, or smaller than the
smallest, may be in another unit."""

UNIT, SPREAD = 1000.0, 4.0
"""It is in another unit if its size times, or divided by, UNIT is among the sizes of the others,
within a factor of SPREAD."""

AWAY = 2.0
"""Parts are far away if their distance exceeds this multiple of the larger one's size."""

EQUAL = 1e-4
"""The tolerance for vertices in one place, as a share of the part's size."""


SHARE, DEPTH, MOST = 0.01, 5e-4, 0.5
"""Parts are not in place if their common volume exceeds the share MOST of the smaller part, or if
it exceeds SHARE and they overlap by more than DEPTH [m], which is more than a press fit."""

THIN = 0.25
"""In a sheet, this share of its thickness is too deep, if that is less."""

NAMED = 6
"""The most pairs that a message names."""

HINT = "--in-place skips this check"


def check_places(
    parts: Sequence[PlacedPart], has_tree: bool, unit_is_given: bool
) -> list[Diagnostic]:
    """Raises InputError (UsedTwice, Size, FarAway) with every fault. If the user gave a unit, it is
    that of all parts. In a product with a tree, two parts in one place are not a fault but a
    warning, which is returned."""
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
            off = other.solid.low - part.solid.low, other.solid.high - part.solid.high
            if np.abs(off).max() > reach:
                continue
            if cKDTree(other.vertices).query(part.vertices)[0].max() <= reach:
                message = f"'{part.label}' has the shape and the place of '{other.label}'"
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
            than = f"{much:.0f} times larger than the largest"
        elif size * LARGER < others.min() and low <= size * UNIT <= high:
            much, way = others.min() / size, "in metres, and the others in millimetres"
            than = f"{much:.0f} times smaller than the smallest"
        else:
            continue
        message = f"'{part.label}' is {than} of the other parts: it may be {way}"
        hint = "export it in the unit of the others; --unit sets one unit for all"
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
        more = f" and {len(group) - 1} more near it" if len(group) > 1 else ""
        message = (
            f"'{parts[index].label}'{more}: {away:.4g} m away from the other parts, "
            f"which span {within:.4g} m"
        )
        hint = "move it to its place in the finished product, or remove it"
        faults.append(Diagnostic("FarAway", message, parts[index].node.position, hint))
    return faults


def _gaps(low: Array, high: Array, lows: Array, highs: Array) -> Array:
    """The distances (n,) between a box and others."""
    return np.asarray(np.linalg.norm(np.maximum(0.0, np.maximum(lows - high, low - highs)), axis=1))


def check_in_place(parts: Sequence[PlacedPart], screws: Collection[str] = ()) -> list[Diagnostic]:
    """The faults of parts that are not in place (NotInPlace); empty if they are. What a screw, and
    a part that is none, have in common is a thread, no fault."""
    there = DrawnSolids([part.solid for part in parts])
    return _inside(there, screws) or _groups(there)


def _inside(there: DrawnSolids, screws: Collection[str]) -> list[Diagnostic]:
    """Parts that are inside one another."""
    solids, bodies = there.solids, there.bodies
    overlaps: list[tuple[float, str, str, float]] = []
    for one, other in there.near(-DEPTH).tolist():
        threaded = (solids[one].label in screws) != (solids[other].label in screws)
        if threaded or bodies[one] is None or bodies[other] is None:
            continue
        small, large = sorted((one, other), key=lambda n: float(bodies[n].volume()))
        shared = there.common(small, large)
        share = shared.volume / float(bodies[small].volume())
        thinner = min(2 * bodies[n].volume() / bodies[n].surface_area() for n in (one, other))
        if share > MOST or (share > SHARE and shared.depth > min(DEPTH, THIN * thinner)):
            overlaps.append((share, solids[small].label, solids[large].label, shared.depth))
    if not overlaps:
        return []
    overlaps.sort(key=lambda pair: -pair[0])
    named = [
        f"{share:.0%} of '{small}' is in '{large}' ({1e3 * depth:.1f} mm deep)"
        for share, small, large, depth in overlaps
    ]
    pairs = (
        "a pair of parts overlaps"
        if len(overlaps) == 1
        else f"{len(overlaps)} pairs of parts overlap"
    )
    message = f"these parts are not in place: {pairs}: {listing(named, NAMED)}"
    hint = f"export each where it is in the finished product, not about its own origin; {HINT}"
    return [Diagnostic("NotInPlace", message, None, hint)]


def _groups(there: DrawnSolids) -> list[Diagnostic]:
    """Groups of parts that do not touch each other."""
    groups = there.groups
    if len(groups.firsts) == 1:
        return []
    message = f"these parts are not in place: they are {groups}"
    hint = f"a print bed, an exploded view, or a part that is missing? {HINT}"
    return [Diagnostic("NotInPlace", message, None, hint)]
