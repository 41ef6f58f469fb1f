"""What it costs that a sub-tree that stays as it is is made along an axis of the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from factory.compiler.expanding import expand
from factory.compiler.mating.mating import matings
from factory.geometry.meshes import Array
from factory.geometry.product import product_geometry
from factory.planning.parts import InPlace, Kept
from factory.planning.stance import ROOT_AXIS, Stance
from factory.planning.subsets import BLOCKED
from factory.planning.writing import planned_product
from factory.problem.pag import PAG
from factory.problem.template import Template


class KeptPrices:
    """The prices of the units of a source by stance: those of kept sub-trees have operations that
    are blocked where they are made along one axis, or lie on one side, and not on another."""

    def __init__(self, source: InPlace, templates: Mapping[str, Template]) -> None:
        self.source, self.templates = source, templates
        self._known: dict[tuple[str, Stance], float] = {}

    def __call__(self, stance: Stance) -> Array:
        """The prices (2, n) if the inputs of each come along x, or y, of the floor."""
        found = np.zeros((2, len(self.source.units())))
        kept = {keep.label: keep for keep in self.source.kept}
        x, y, z = stance.axes
        turned = Stance((y, x, z), stance.up)
        for number, (label, _) in enumerate(self.source.units()):
            if label in kept:
                found[ROOT_AXIS, number] = self._price(kept[label], stance)
                found[1 - ROOT_AXIS, number] = self._price(kept[label], turned)
        return found

    def _price(self, keep: Kept, stance: Stance) -> float:
        """That of one whose inputs come along y."""
        if (keep.label, stance) not in self._known:
            parts = tuple(part for part in self.source.parts if part.label in keep.parts)
            alone = replace(self.source, parts=parts, kept=(keep,))
            nodes = planned_product(alone, keep.label, stance.rotation).pag.nodes
            pag = PAG(keep.label, nodes)
            found = matings(expand(pag, self.templates), product_geometry(pag, self.source.files))
            self._known[keep.label, stance] = BLOCKED * len(found.of_kind("blocked"))
        return self._known[keep.label, stance]
