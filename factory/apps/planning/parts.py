"""Parts in place: the input of planning, whatever file they come from; and what convex hulls hide
where they stand for meshes that bound no volume: a part in a cavity of another seems to be drawn
into it, so it seems to get no deeper on any way out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from factory.api import (
    PAG,
    AllowedOverlap,
    Assembly,
    Diagnostic,
    DrawnSolids,
    InputError,
    Mesh,
    Product,
    Solid,
)
from factory.floor.geometry.overlapping import Overlapping
from factory.support.arrays import Array, Indices
from factory.support.errors import listing
from factory.support.meshes.triangles import is_closed

EXTRA = "pip install 'klavins-factory[decompose]'"

CLOSE = "close these meshes, or accept their hulls with --hulls: paths may then lead through walls"

NAMED = 12
"""The most parts that a message names, the deepest overlap first."""


def hull_stands(mesh: Mesh | None) -> bool:
    """Whether a closed mesh that is notably smaller than its hull is represented by the hull."""
    if mesh is None or mesh.pieces or not is_closed(mesh.faces):
        return False
    return 0 < mesh.share < mesh.FULL


def refuse_hidden(source: InPlace, pairs: Sequence[Overlapping]) -> None:
    """Raises InputError (Hulls) if there are pairs that overlap in the finished product according
    to the hull of one of them, with a diagnostic for each part that is represented by its hull. A
    product with a tree only gets warnings, as from `check`."""
    if not pairs or source.tree is not None:
        return
    faults = []
    for part in source.parts:
        others = [
            f"'{pair.other if pair.one == part.label else pair.one}' by {1e3 * pair.depth:.1f} mm"
            for pair in pairs
            if part.label in (pair.one, pair.other)
        ]
        if others and DrawnSolids.body(part.solid) is None:
            mesh = part.solid.mesh
            is_open = mesh is not None and not is_closed(mesh.faces)
            state = "is open" if is_open else "bounds no volume"
            message = f"'{part.label}' {state}, and its hull overlaps {listing(others, NAMED)}"
            faults.append(Diagnostic("Hulls", message))
    raise InputError([*faults[:-1], replace(faults[-1], hint=CLOSE)])


@dataclass(frozen=True, slots=True)
class PlacedPart:
    """A part at its place in the finished product.

    `vertices` (n, 3) [m] and `faces` (m, 3), oriented outwards, are in the frame of the product.
    Parts of one `kind` have the same shape up to a rigid motion; mirror images are two kinds.
    `solid` has its mass, its box and its convex pieces, in place too; `node` is its PAG node:
    `atomic` with its mesh or shape, its place, its colour.
    """

    label: str
    vertices: Array = field(repr=False)
    faces: Indices = field(repr=False)
    kind: str
    solid: Solid = field(repr=False)
    node: Assembly = field(repr=False)


@dataclass(frozen=True, slots=True)
class Kept:
    """A sub-tree that is kept as the user wrote it: its `label`, the labels of its `parts`, and its
    nodes, inputs first, including parts. The planner treats it as one body."""

    label: str
    parts: tuple[str, ...]
    nodes: tuple[Assembly, ...] = field(repr=False)


@dataclass(frozen=True)
class InPlace:
    """The parts of a product in place, in the order of the source.

    `notes` describes what was read; `warnings` what may be wrong. `files` are the mesh files that
    the nodes of the parts name, by path in the output folder. `tree` is the tree of the source,
    None if it has none: a plan may be compared with it. `allowed`: overlaps of parts that are
    intended.
    """

    name: str
    parts: tuple[PlacedPart, ...]
    notes: tuple[str, ...] = ()
    kept: tuple[Kept, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    tree: PAG | None = field(default=None, repr=False)
    warnings: tuple[Diagnostic, ...] = field(default=(), repr=False)
    allowed: tuple[AllowedOverlap, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "files", MappingProxyType(dict(self.files)))

    @cached_property
    def product(self) -> Product:
        """Its parts as a product, unit by unit."""
        solids = {part.label: part.solid for _, members in self.units() for part in members}
        low = np.min([solid.low for solid in solids.values()], axis=0)
        high = np.max([solid.high for solid in solids.values()], axis=0)
        return Product(solids, low, high)

    def units(self) -> tuple[tuple[str, tuple[PlacedPart, ...]], ...]:
        """The units of planning, each with its parts: kept sub-trees and all other parts."""
        by_label = {part.label: part for part in self.parts}
        kept = {label: keep for keep in self.kept for label in keep.parts}
        units: dict[str, tuple[PlacedPart, ...]] = {}
        for part in self.parts:
            keep = kept.get(part.label)
            if keep is None:
                units[part.label] = (part,)
            else:
                units.setdefault(keep.label, tuple(by_label[label] for label in keep.parts))
        return tuple(units.items())
