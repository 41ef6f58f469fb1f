"""Overlaps of the parts of a finished product as drawn, and whether they are allowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil

import numpy as np

from factory.floor.geometry.decomposition import collides_as_hull
from factory.floor.geometry.facets import sagitta
from factory.floor.geometry.overlap import drawn, overlap_of
from factory.floor.geometry.solids import Product, Solid
from factory.support.arrays import Indices
from factory.support.errors import Diagnostic
from factory.theory.problem.pag import ROUNDING, AllowedOverlap, most_allowed

SILENT = 2e-5
"""Smaller overlaps are rounding, or the accuracy of a drawing [m]."""

INSIDE = 0.999
"""A part lies inside another if they have more than this share of its volume in common."""


Insides = tuple[frozenset[str], ...]
"""The parts of each of several products."""

NAMED = 6
"""The most allowed pairs that are named."""


@dataclass(frozen=True, slots=True)
class Overlapping:
    """Two parts, in the order of the product, the depth of their overlap, the `sagitta` of the
    facets by which round surfaces are drawn where they overlap [m]: an overlap that is not deeper
    may be these facets alone; `inner`: the one of them that lies inside the other, "" for
    neither."""

    one: str
    other: str
    depth: float
    sagitta: float = 0.0
    inner: str = ""

    def __str__(self) -> str:
        if self.inner:
            outer = self.one if self.inner == self.other else self.other
            return f"{self.inner} lies inside {outer} when finished"
        words = f"{self.one} and {self.other} overlap by {1e3 * self.depth:.2f} mm when finished"
        if self.depth <= self.sagitta:
            return f"{words}, which may be their facets (sagitta {1e3 * self.sagitta:.3f} mm)"
        return words

    def fault(self, allowed: Sequence[AllowedOverlap]) -> Diagnostic | None:
        """The fault (Overlap), unless the overlap is allowed."""
        most = most_allowed(allowed, self.one, self.other)
        if self.depth <= most + ROUNDING:
            return None
        words = f"{self}, and {1e3 * most:.2f} mm is allowed" if most else str(self)
        option = f"--allow {self.one}:{self.other}"
        hint = f"correct the drawing or, if the overlap is intended, allow it: {option}"
        if self.inner:
            hint = f"move '{self.inner}' to its place, remove it, or give the other part its recess"
        elif self.depth <= self.sagitta:
            option = f"{option}:{ceil(1e5 * self.sagitta) / 100:g}mm"
            hint = f"export round surfaces with more facets, or allow these: {option}"
        return Diagnostic("Overlap", words, None, hint)


@dataclass(frozen=True, slots=True)
class DrawnOverlaps:
    """The `pairs` of parts that overlap, the deepest first, and the parts that are `open`: their
    meshes bound no volume, so their overlaps are unknown."""

    pairs: tuple[Overlapping, ...] = ()
    open: tuple[str, ...] = ()

    def faults(self, allowed: Sequence[AllowedOverlap]) -> tuple[Diagnostic, ...]:
        """The faults of the pairs that are not allowed."""
        faults = (pair.fault(allowed) for pair in self.pairs)
        return tuple(fault for fault in faults if fault is not None)

    def notes(self, allowed: Sequence[AllowedOverlap]) -> list[str]:
        """Notes on allowed overlaps: pairs that are allowed by name one by one, all others
        together."""
        named_pairs, other_pairs = list[Overlapping](), list[Overlapping]()
        for pair in self.pairs:
            if pair.fault(allowed) is None:
                named = any(a.parts and a.covers(pair.one, pair.other) for a in allowed)
                (named_pairs if named else other_pairs).append(pair)
        words = [f"{pair}, which is allowed" for pair in named_pairs[:NAMED]]
        if more := len(named_pairs[NAMED:]):
            words.append(f"{more} more pairs of parts overlap, which is allowed")
        if other_pairs:
            most = max(a.depth for a in allowed if not a.parts)
            count = "a pair of parts overlaps"
            if len(other_pairs) > 1:
                count = f"{len(other_pairs)} pairs of parts overlap"
            deepest = f"{1e3 * other_pairs[0].depth:.2f} mm when finished"
            words.append(f"{count} by up to {deepest}; {1e3 * most:g} mm is allowed everywhere")
        if self.open:
            parts = "a part has" if len(self.open) == 1 else f"{len(self.open)} parts have"
            words.append(f"{parts} an open mesh: overlaps with it are not checked")
        return words


def overlaps_of(product: Product, *insides: frozenset[str]) -> DrawnOverlaps:
    """The overlaps of all parts of a product, computed once; `insides`: of the parts of each of
    several products, whose parts are together in it."""
    return product.kept(_found, insides)


def _found(product: Product, insides: Insides) -> DrawnOverlaps:
    twin = product.twin[0] if product.twin is not None else product  # a turn changes no overlap
    measured = twin if twin.solids.keys() == product.solids.keys() else product
    solids = {
        label: measured.solids[label]
        for label in product.solids
        if not insides or any(label in inside for inside in insides)
    }
    labels, bodies = [*solids], [drawn(solid) for solid in solids.values()]
    pairs = []
    for one, other in near_pairs([*solids.values()], -SILENT).tolist():
        both = {labels[one], labels[other]}
        if insides and not any(both <= inside for inside in insides):
            continue
        if bodies[one] is not None and bodies[other] is not None:
            shared = overlap_of(solids[labels[one]], solids[labels[other]])
            if shared.depth > SILENT:
                off = max(sagitta(bodies[n], *shared.box) for n in (one, other))
                small = min((one, other), key=lambda n: float(bodies[n].volume()))
                whole = shared.volume > INSIDE * bodies[small].volume()
                inner = labels[small] if whole else ""
                pairs.append(Overlapping(labels[one], labels[other], shared.depth, off, inner))
    pairs.sort(key=lambda pair: -pair.depth)
    left = (label for label, body in zip(labels, bodies, strict=True) if body is None)
    return DrawnOverlaps(tuple(pairs), tuple(left))


def stood_in(solids: Sequence[Solid]) -> frozenset[str]:
    """The parts that collide as their hulls although another part stands in a hole or a hollow of
    theirs: it is in the hull by more than it is in the part as drawn."""
    pairs = near_pairs(solids, -SILENT).tolist()
    near = [solids[number] for number in sorted({number for pair in pairs for number in pair})]
    hulls = {solid.label for solid in near if solid.mesh and collides_as_hull(solid.mesh)}
    if not hulls:
        return frozenset()
    from manifold3d import Manifold

    labels, hull = set[str](), cache(lambda number: Manifold.hull_points(solids[number].corners))
    for pair in pairs:
        for one, two in (pair, pair[::-1]):
            solid, other = solids[one], drawn(solids[two])
            body = drawn(solid) if solid.label in hulls - labels else None
            if body is not None and other is not None:
                inside = hull(one) ^ other
                beyond = inside.volume() - SILENT * inside.surface_area()
                if beyond > 0.0 and beyond > (body ^ other).volume():
                    labels.add(solid.label)
    return frozenset(labels)


def near_pairs(solids: Sequence[Solid], gap: float) -> Indices:
    """The pairs (n, 2) of solids, by number, whose boxes are at most a gap apart [m]; with a
    negative gap, whose boxes overlap by at least as much."""
    low = np.array([solid.low for solid in solids])
    high = np.array([solid.high for solid in solids])
    pairs = [np.zeros((0, 2), np.int64)]
    for one in range(len(solids)):
        near = (low[one] <= high[one + 1 :] + gap) & (low[one + 1 :] <= high[one] + gap)
        others = one + 1 + np.flatnonzero(near.all(axis=1))
        pairs.append(np.column_stack([np.full(len(others), one), others]))
    return np.concatenate(pairs)
