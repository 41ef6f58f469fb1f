"""How the inputs of each operation can come together, from the PAG and the meshes alone."""

from __future__ import annotations

from factory.compiler.mating.mating import (
    BLOCKED,
    LEFT_OUT,
    NO_DEEPER,
    STRICT,
    Clash,
    Mating,
    Matings,
    judged,
    matings,
    shaped,
)
from factory.compiler.mating.overlaps import TOLERANCE

__all__ = [
    "BLOCKED",
    "LEFT_OUT",
    "NO_DEEPER",
    "STRICT",
    "TOLERANCE",
    "Clash",
    "Mating",
    "Matings",
    "judged",
    "matings",
    "shaped",
]
