"""How the inputs of a product's operations come together, as `check` tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from factory.support.console import say

if TYPE_CHECKING:
    from factory.compiler.mating.mating import Mating, Matings

LEVELS = ("none", "left_out", "no_deeper", "strict")
"""The names of the levels, see `factory.compiler.mating.mating`."""

NAMED = 3
"""So many pairs of parts are named in a line for people."""


def approaches_json(matings: Matings | None) -> dict[str, Any] | None:
    """The key `approaches` of `check --json`."""
    if matings is None:
        return None
    from factory.compiler.mating.overlaps import TOLERANCE

    return {
        "operations": len(matings.all),
        **{kind: len(matings.of_kind(kind)) for kind in ("slide", "lower", "blocked")},
        **{name: matings.count(level) for level, name in enumerate(LEVELS) if level},
        "tolerance_mm": TOLERANCE * 1e3,
        "list": [_approach_json(mating) for mating in matings.all],
    }


def _approach_json(mating: Mating) -> dict[str, Any]:
    approach = mating.approach
    return {
        "label": mating.label,
        "inputs": list(mating.inputs),
        "kind": approach.kind,
        "axis": "xy"[approach.axis],
        "sides": list(approach.sides),
        "lowered": approach.lowered or None,
        "stroke_m": approach.stroke,
        "level": LEVELS[mating.level],
        "slides": LEVELS[mating.slide],
        "excluded": [len(pairs) for pairs in approach.excluded],
    }


def clashes_json(matings: Matings | None) -> list[dict[str, Any]]:
    """The key `clashes` of `check --json`: the pairs that block operations."""
    blocked = () if matings is None else matings.of_kind("blocked")
    return [
        {
            "label": mating.label,
            "parts": list(clash.parts),
            "depth_mm": round(clash.depth * 1e3, 4),
            "finished_mm": round(clash.finished * 1e3, 4),
            "shift_mm": round(clash.shift * 1e3, 4),
            "side": mating.approach.sides[0],
            "file": mating.position.file if mating.position else None,
            "line": mating.position.line if mating.position else None,
            "col": mating.position.column if mating.position else None,
        }
        for mating in blocked
        for clash in mating.clashes
    ]


def describe_approaches(matings: Matings, most: int | None) -> None:
    """For people: the figures in a line, and a line for each blocked operation, at most so many."""
    strict, no_deeper, left_out = (matings.count(level) for level in (3, 2, 1))
    lowered, blocked = len(matings.of_kind("lower")), matings.of_kind("blocked")
    say(
        f"approach: {left_out} of {len(matings.all)} operations clean with finished overlaps left"
        f" out, {no_deeper} with paths no deeper, {strict} strictly; {lowered} lowered,"
        f" {len(blocked)} blocked"
    )
    for mating in blocked[:most]:
        say(f"  {_line(mating)}")
    if most is not None and len(blocked) > most:
        say(f"  ... and {len(blocked) - most} more (-v shows all)")
    if blocked:
        say("  --clashes DIR draws each of them")


def _line(mating: Mating) -> str:
    """Where, what is blocked and by what."""
    named = [
        f"{c.parts[0]} and {c.parts[1]} {c.depth * 1e3:.2f} mm" for c in mating.clashes[:NAMED]
    ]
    more = len(mating.clashes) - len(named)
    pairs = ", ".join(named) + (f", and {more} more" if more else "")
    where = f"{mating.position}: " if mating.position else ""
    return f"{where}Blocked warning: {mating.inputs[-1]} cannot come to {mating.label}: {pairs}"
