"""Hulls that stand for meshes which bound no volume, and what they hide: a part in a hollow of
another seems to be drawn into it, so whatever way it takes out, it seems to get no deeper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from factory.geometry.decomposition import FULL
from factory.geometry.meshes import Mesh, is_closed
from factory.geometry.overlap import drawn
from factory.nets.verdict import listing
from factory.planning.parts import InPlace
from factory.support.errors import Diagnostic, InputError

EXTRA = "pip install 'klavins-factory[decompose]'"

CLOSE = "close these meshes; --hulls plans with hulls all the same: ways may lead through walls"

NAMED = 12
"""So many parts that a hull overlaps, the deepest first, are named."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Two parts that overlap in the finished product, as far as a hull of one of them shows, by
    their labels, and how deep [m]."""

    one: str
    other: str
    depth: float


def hull_stands(mesh: Mesh | None) -> bool:
    """Whether a hull stands for a closed mesh that is notably less than it."""
    if mesh is None or mesh.pieces or not is_closed(mesh.faces):
        return False
    return 0 < mesh.share < FULL


def refuse_hidden(source: InPlace, pairs: Sequence[Drawn]) -> None:
    """Raises InputError (Hulls) if there are such pairs, with a diagnostic for each part that is
    known by its hull alone. A product with a tree is left to its warnings: so `check` takes it."""
    if not pairs or source.tree is not None:
        return
    faults = []
    for part in source.parts:
        others = [
            f"'{pair.other if pair.one == part.label else pair.one}' by {1e3 * pair.depth:.1f} mm"
            for pair in pairs
            if part.label in (pair.one, pair.other)
        ]
        if others and drawn(part.solid) is None:
            mesh = part.solid.mesh
            is_open = mesh is not None and not is_closed(mesh.faces)
            state = "is open" if is_open else "bounds no volume"
            message = f"'{part.label}' {state}, and its hull overlaps {listing(others, NAMED)}"
            faults.append(Diagnostic("Hulls", message))
    raise InputError([*faults[:-1], replace(faults[-1], hint=CLOSE)])
