"""How the inputs of each operation can come together, from the PAG and the meshes alone."""

from __future__ import annotations

from collections.abc import Mapping

from factory.compiler.mating.contacts import TOLERANCE
from factory.compiler.mating.mating import (
    BLOCKED,
    LEFT_OUT,
    NO_DEEPER,
    STRICT,
    Clash,
    Mating,
    Matings,
    matings,
    shaped,
)
from factory.geometry.solids import Product
from factory.plant.approaches import Approach
from factory.problem.pag import PAG
from factory.problem.template import Template


def approaches(
    pag: PAG, templates: Mapping[str, Template], product: Product
) -> Mapping[str, Approach]:
    """The approach of each operation with two inputs or more, by its label as in `expand`."""
    return matings(pag, templates, product).approaches


__all__ = [
    "BLOCKED",
    "LEFT_OUT",
    "NO_DEEPER",
    "STRICT",
    "TOLERANCE",
    "Clash",
    "Mating",
    "Matings",
    "approaches",
    "matings",
    "shaped",
]
