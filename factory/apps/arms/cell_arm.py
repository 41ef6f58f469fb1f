"""An arm of a cell as it is asked for; read without the engine."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CellArm:
    """An arm of a cell.

    Attributes:
        name: what messages call it.
        labels: what it places; without any, what no other arm is said to place, by turns.
    """

    name: str = ""
    labels: tuple[str, ...] = ()
