"""Faults of parts in place: too few, two in one place, one far away, one in another unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from factory.geometry.meshes import Array
from factory.lang.source import quoted
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

MOST_PARTS = 5000
"""A plan has tables of all pairs of parts: of so many they take a gigabyte."""

EQUAL = 1e-4
"""Vertices of two parts are in one place that are nearer than this share of their size."""


def check_count(path: Path, labels: Sequence[str], what: str = "parts") -> None:
    """Raises InputError for a source with no part, or one (TooFewParts), or with more than can be
    planned (TooLarge)."""
    if len(labels) > MOST_PARTS:
        message = f"{quoted(path.name)} has {len(labels)} {what}; at most {MOST_PARTS} are planned"
        raise InputError(Diagnostic("TooLarge", message, None, "plan sub-assemblies of it"))
    if len(labels) > 1:
        return
    if labels:
        message = f"{quoted(path.name)} has one part, '{labels[0]}': there is nothing to assemble"
        hint = "export each part as a mesh of its own, or as a body with a name, where it is"
    else:
        message = f"{quoted(path.name)} has no {what}"
        hint = "a folder of .obj, .stl, .ply, .off, .glb, .3mf or .step files, a part each"
    raise InputError(Diagnostic("TooFewParts", message, None, hint))


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
    import networkx as nx

    low, high = (np.array([getattr(p.solid, end) for p in parts]) for end in ("low", "high"))
    size = np.linalg.norm(high - low, axis=1)
    near: nx.Graph = nx.Graph()
    near.add_nodes_from(range(len(parts)))
    for index in range(len(parts)):
        gaps = gap(low[index], high[index], low, high)
        close = np.flatnonzero(gaps <= AWAY * np.maximum(size[index], size))
        near.add_edges_from((index, int(other)) for other in close if other > index)
    groups = sorted(nx.connected_components(near), key=lambda g: (-len(g), min(g)))
    main = sorted(groups[0])
    within = float(np.linalg.norm(high[main].max(axis=0) - low[main].min(axis=0)))
    faults = []
    for group in groups[1:]:
        index = min(group)
        away = float(gap(low[index], high[index], low[main], high[main]).min())
        more = f" and {len(group) - 1} more by it" if len(group) > 1 else ""
        message = (
            f"'{parts[index].label}'{more}: {away:.4g} m away from the other parts, "
            f"which are within {within:.4g} m"
        )
        hint = "parts are where they are in the finished product: move it there, or remove it"
        faults.append(Diagnostic("FarAway", message, parts[index].node.position, hint))
    return faults


def gap(low: Array, high: Array, lows: Array, highs: Array) -> Array:
    """The distances (n,) between a box and others."""
    return np.asarray(np.linalg.norm(np.maximum(0.0, np.maximum(lows - high, low - highs)), axis=1))
