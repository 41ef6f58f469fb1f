"""Limits on a product's geometry: what is refused, what gets a warning, and the positions of the
numbers."""

from __future__ import annotations

import numpy as np

from factory.floor.geometry.solids import Solid
from factory.support.arrays import Array
from factory.support.errors import Diagnostic, Position
from factory.theory.problem.pag import PAG, SHAPES, Assembly

SMALLEST, FURTHEST, HEAVIEST = 5e-9, 1e4, 1e12
"""Parts with a smaller half length, or beyond this distance [m] or mass [kg], are refused: the
engine cannot compute with them."""

LONGEST, SHORTEST = 5.0, 0.005
"""A product outside these lengths [m] gets a warning."""

METRES = "lengths are in metres, unless the text says otherwise: unit = mm;"


def beyond(node: Assembly, solid: Solid) -> Diagnostic | None:
    """The fault of a part whose numbers, each valid by itself, exceed a limit together."""
    reach = float(np.max(np.abs([solid.low, solid.high])))
    if not reach <= FURTHEST:
        is_away = not 2 * float(np.max(np.abs(solid.position))) < reach
        return too_far(node, *(("pos",) if is_away else ()), "scale", *SHAPES)
    if not (0 < solid.mass <= HEAVIEST and np.isfinite(solid.inertia).all()):
        position = value_position(node, "mass", "density", "scale", *SHAPES)
        message = f"'{node.label}' weighs {solid.mass:g} kg"
        hint = f"more than 0 and at most {HEAVIEST:g} kg: check mass, density and shape"
        return Diagnostic("BadValue", message, position, hint)
    return None


def too_far(node: Assembly, *names: str) -> Diagnostic:
    """The fault of a part that is out of reach because of the first of these parameters that it
    has."""
    message = f"'{node.label}' reaches further than {FURTHEST:g} m from the origin"
    hint = f"{METRES}: check pos, scale and the shape"
    return Diagnostic("BadValue", message, value_position(node, *names), hint)


def value_position(node: Assembly, *names: str) -> Position | None:
    """The position of the first of these parameters that the part has; otherwise that of its
    label."""
    positions = {p.name: p.position for p in node.parameters}
    return next((positions[name] for name in names if name in positions), node.position)


def size_warnings(pag: PAG, low: Array, high: Array) -> list[Diagnostic]:
    """The warning about a product that is implausibly long or short."""
    longest = float((high - low).max())
    if SHORTEST <= longest <= LONGEST:
        return []
    hint = METRES
    if any(node.parameter("mesh") is not None for node in pag.parts()):
        hint += ": check scale, and --unit of `factory import`"
        if longest > LONGEST:
            hint = "is a mesh in millimetres? then write unit = mm; or import with --unit mm"
    message = f"the product is {longest:g} m long"
    return [Diagnostic("Size", message, pag[pag.root].position, hint)]
