"""Convex hulls used in place of meshes that bound no volume, and the overlaps that they hide: a
part in a cavity of another seems to be drawn into it, so it seems to get no deeper on any way
out."""

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

CLOSE = "close these meshes, or accept their hulls with --hulls: paths may then lead through walls"

NAMED = 12
"""The most parts that a message names, the deepest overlap first."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """The labels of two parts that overlap in the finished product according to the hull of one of
    them, and the depth [m]."""

    one: str
    other: str
    depth: float


def hull_stands(mesh: Mesh | None) -> bool:
    """Whether a closed mesh that is notably smaller than its hull is represented by the hull."""
    if mesh is None or mesh.pieces or not is_closed(mesh.faces):
        return False
    return 0 < mesh.share < FULL


def refuse_hidden(source: InPlace, pairs: Sequence[Drawn]) -> None:
    """Raises InputError (Hulls) if there are such pairs, with a diagnostic for each part that is
    represented by its hull. A product with a tree only gets warnings, as from `check`."""
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
