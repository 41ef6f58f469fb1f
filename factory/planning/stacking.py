"""The simplest plan: parts are joined from the lowest to the highest."""

from __future__ import annotations

from factory.planning.parts import InPlace
from factory.planning.writing import Tree


def stacked(source: InPlace) -> Tree:
    """A single mate of all units of a source, the lowest first."""
    low = {
        label: (min(float(p.solid.low[2]) for p in parts), index)
        for index, (label, parts) in enumerate(source.units())
    }
    return tuple(sorted(low, key=lambda label: low[label]))
