"""Parts in place: the input of planning, whatever file they come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from factory.geometry.meshes import Array, Indices
from factory.geometry.solids import Solid
from factory.problem.pag import PAG, AllowedOverlap, Assembly
from factory.support.errors import Diagnostic


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

    @property
    def pieces(self) -> tuple[Array, ...]:
        """The vertices (k, 3) [m] of the convex bodies that it is made of, in place."""
        return self.solid.pieces

    @property
    def colour(self) -> tuple[float, ...]:
        """Red, green, blue and opacity, each from 0 to 1."""
        return self.solid.rgba


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
