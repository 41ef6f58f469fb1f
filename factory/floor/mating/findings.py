"""Findings on how the inputs of a product's operations can come together.

Three levels say how strictly. At a *strict* one no two parts ever overlap, nor scrape along each
other; at one that goes *no deeper* they overlap on the way by no more than in the finished product,
neither in depth nor in volume; at the third, pairs that overlap in the finished product are *left
out*. All of it up to TOLERANCE.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, get_args

from factory.floor.mating.paths import TOLERANCE
from factory.support.errors import Diagnostic, Position
from factory.theory.plant.approaches import Approach, Clash, Kind
from factory.theory.problem.pag import AllowedOverlap


class Level(IntEnum):
    """How freely inputs come together, the strictest last."""

    BLOCKED = 0
    LEFT_OUT = 1
    NO_DEEPER = 2
    STRICT = 3


LEVELS = ("none", "left_out", "no_deeper", "strict")
"""The names of the levels in documents."""


@dataclass(frozen=True, slots=True)
class Mating:
    """The judgement of one operation: its approach, and the best levels at which its inputs slide
    or one is lowered."""

    label: str
    inputs: tuple[str, ...]
    approach: Approach
    slide: int
    lower: int
    position: Position | None = field(default=None, compare=False)

    @property
    def level(self) -> int:
        """The best level of all."""
        return max(self.slide, self.lower)

    def as_json(self) -> dict[str, Any]:
        """The approach and its levels."""
        approach = self.approach
        return {
            "label": self.label,
            "inputs": list(self.inputs),
            "kind": approach.kind,
            "axis": "xy"[approach.axis],
            "sides": list(approach.sides),
            "lowered": approach.lowered or None,
            "stroke_m": approach.stroke,
            "level": LEVELS[self.level],
            "slides": LEVELS[self.slide],
            "excluded": [len(overlaps) for overlaps in approach.overlaps],
        }

    @property
    def clashes(self) -> tuple[Clash, ...]:
        """The pairs that pass through each other, the deepest first (`Approach`)."""
        return self.approach.clashes

    def clashes_as_json(self) -> dict[str, Any]:
        """The pairs that clash."""
        return {
            "label": self.label,
            "side": self.approach.sides[0],
            "file": self.position.file if self.position else None,
            "line": self.position.line if self.position else None,
            "col": self.position.column if self.position else None,
            "pairs": [
                {
                    "parts": list(clash.parts),
                    "depth_mm": round(clash.depth * 1e3, 4),
                    "finished_mm": round(clash.finished * 1e3, 4),
                    "shift_mm": round(clash.shift * 1e3, 4),
                }
                for clash in self.clashes
            ],
        }


def together(several: Iterable[Matings]) -> Matings:
    """The judgements of all products of a mix, each operation of several only once."""
    every = [*several]
    made = {mating.label: mating for one in reversed(every) for mating in one.all}
    order = dict.fromkeys(mating.label for one in every for mating in one.all)
    parts = {label: parts for one in every for label, parts in one.parts.items()}
    return Matings(tuple(made[label] for label in order), parts)


@dataclass(frozen=True)
class Matings:
    """The judgements of a product's operations, how their inputs come together.

    Attributes:
        all: of each operation, inputs before the operations that take them.
        parts: of each input of a blocked operation.
    """

    LEVEL: ClassVar[type[Level]] = Level

    all: tuple[Mating, ...]
    parts: Mapping[str, tuple[str, ...]] = field(repr=False)

    @cached_property
    def approaches(self) -> Mapping[str, Approach]:
        """The approach of each operation, by its label."""
        return MappingProxyType({mating.label: mating.approach for mating in self.all})

    def count(self, level: int) -> int:
        """How many operations attain a level, by sliding or lowering."""
        return sum(mating.level >= level for mating in self.all)

    def of_kind(self, kind: Kind) -> tuple[Mating, ...]:
        """The operations whose approach is of a kind."""
        return tuple(mating for mating in self.all if mating.approach.kind == kind)

    def faults(self, allowed: Sequence[AllowedOverlap]) -> tuple[Diagnostic, ...]:
        """The warnings of blocked operations, except those whose clashes are all allowed."""
        faults = (m.approach.fault(m.label, m.inputs[-1], m.position, allowed) for m in self.all)
        return tuple(fault for fault in faults if fault is not None)

    def notes(self, allowed: Sequence[AllowedOverlap]) -> list[str]:
        """A note on the clashes that are allowed."""
        used = [c for m in self.all for c in m.clashes if c.is_allowed(allowed)]
        if not used:
            return []
        pairs = "a pair of parts passes" if len(used) == 1 else f"{len(used)} pairs of parts pass"
        deepest = f"{1e3 * max(clash.depth for clash in used):.2f} mm"
        return [f"{pairs} through each other on the way by up to {deepest}, which is allowed"]

    def as_json(self) -> dict[str, Any]:
        """How many operations are of each kind and attain each level, and all approaches."""
        return {
            "operations": len(self.all),
            **{kind: len(self.of_kind(kind)) for kind in get_args(Kind)},
            **{name: self.count(level) for level, name in enumerate(LEVELS) if level},
            "tolerance_mm": TOLERANCE * 1e3,
            "list": [mating.as_json() for mating in self.all],
        }
