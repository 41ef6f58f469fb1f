"""Hulls that stand for closed meshes, and what they hide: a part in a hollow of another seems to be
drawn into it, so whatever way it takes out, it seems to get no deeper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from factory.geometry.decomposition import FULL
from factory.geometry.meshes import Mesh, is_closed
from factory.nets.verdict import listing
from factory.planning.parts import InPlace
from factory.support.errors import Diagnostic, InputError
from factory.support.version import release

EXTRA = "pip install 'klavins-factory[decompose]'"

NAMED = 12
"""So many parts that a hull overlaps, the deepest first, are named."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Two parts that overlap in the finished product, by their labels, and how deep [m]."""

    one: str
    other: str
    depth: float


def hull_stands(mesh: Mesh | None) -> bool:
    """Whether a hull stands for a closed mesh that is notably less than it."""
    if mesh is None or mesh.pieces or not is_closed(mesh.faces):
        return False
    return mesh.share < FULL


def hidden(source: InPlace, drawn: Sequence[Drawn]) -> tuple[Drawn, ...]:
    """The pairs that overlap, though their meshes may not: those with a part for which its hull
    stands, the deepest first."""
    hulls = {part.label for part in source.parts if hull_stands(part.solid.mesh)}
    found = [pair for pair in drawn if pair.one in hulls or pair.other in hulls]
    return tuple(sorted(found, key=lambda pair: -pair.depth))


def refuse_hidden(source: InPlace, pairs: Sequence[Drawn]) -> None:
    """Raises InputError (Hulls) if there are such pairs, with a diagnostic for each part whose hull
    stands for it. A product with a tree and meshes that are open is left to its warnings: these
    have nothing but their hulls, here as in `check`."""
    meshes = [(part.label, part.solid.mesh) for part in source.parts]
    kept = any(mesh and not mesh.pieces and not is_closed(mesh.faces) for _, mesh in meshes)
    if not pairs or (source.tree is not None and kept):
        return
    faults = []
    for label, mesh in meshes:
        others = [
            f"'{pair.other if pair.one == label else pair.one}' by {1e3 * pair.depth:.1f} mm"
            for pair in pairs
            if label in (pair.one, pair.other)
        ]
        if mesh is not None and others and hull_stands(mesh):
            filled = f"'{label}' fills {mesh.share:.0%} of its hull"
            message = f"{filled}, which overlaps {listing(others, NAMED)}"
            faults.append(Diagnostic("Hulls", message))
    raise InputError([*faults[:-1], replace(faults[-1], hint=_help())])


def _help() -> str:
    decompose = "" if release("coacd") else f"{EXTRA} makes convex bodies of these; "
    return f"{decompose}--hulls plans with hulls all the same: then ways may lead through walls"
