"""Results of a comparison of the worlds: frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from factory.study.fidelity.quantities import QUANTITIES
from factory.support.errors import Diagnostic

Figures = Mapping[str, float | None]
"""Values by the key of their quantity; None where there is nothing to measure."""


@dataclass(frozen=True, slots=True)
class Penetration:
    """The deepest penetration of two geoms, over all their copies: their names, depth [mm], the
    time at which it was first reached [s], and whether one can move against the other."""

    geoms: tuple[str, str]
    depth_mm: float
    time_s: float
    moves: bool = True

    def __str__(self) -> str:
        return f"{self.depth_mm:.3f} mm: {' - '.join(self.geoms)}, at {self.time_s:.2f} s"


@dataclass(frozen=True, slots=True)
class SeedRecord:
    """One seed: the figures of its runs in both worlds, the deepest `hidden` penetrations, the
    unintended contacts, and the `trouble` for which a run did not succeed."""

    seed: int
    units: int
    figures: Figures
    hidden: tuple[Penetration, ...] = ()
    contacts: tuple[str, ...] = ()
    trouble: tuple[Diagnostic, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether both runs succeeded."""
        return not self.trouble

    def as_json(self) -> dict[str, Any]:
        """The record as `fidelity --json` lists it."""
        return {
            "seed": self.seed,
            "units": self.units,
            "passed": self.passed,
            "figures": dict(self.figures),
            "hidden_penetrations": [asdict(p) for p in self.hidden],
            "contacts": list(self.contacts),
            "errors": [d.as_json() for d in self.trouble],
        }


@dataclass(frozen=True)
class Fidelity:
    """A product's comparison over seeds."""

    product: str
    robots: int
    jitter: float
    seeds: tuple[SeedRecord, ...]

    @property
    def passed(self) -> bool:
        """Whether every seed passed."""
        return all(record.passed for record in self.seeds)

    @property
    def units(self) -> int:
        """The number of products of the longest run."""
        return max(record.units for record in self.seeds)

    @property
    def runs(self) -> str:
        """Seeds and products in words: `50 seeds, 4 units` or `4 to 61 units`."""
        least, most = min(record.units for record in self.seeds), self.units
        return f"{len(self.seeds)} seeds, {least if least == most else f'{least} to {most}'} units"

    def values(self, key: str) -> list[float]:
        """A figure over the seeds that have it."""
        values = (record.figures.get(key) for record in self.seeds)
        return [value for value in values if value is not None]

    def worst(self) -> Figures:
        """Every figure at the worst seed."""
        return {key: quantity.worst(self.values(key)) for key, quantity in QUANTITIES.items()}

    def mean(self) -> Figures:
        """Every figure's mean over the seeds."""
        return {k: sum(v) / len(v) if (v := self.values(k)) else None for k in QUANTITIES}

    def as_json(self) -> dict[str, Any]:
        """The document of `fidelity --json`."""
        worst, mean = self.worst(), self.mean()
        return {
            "schema": 1,
            "product": self.product,
            "robots": self.robots,
            "units": self.units,
            "jitter": self.jitter,
            "passed": self.passed,
            "figures": {
                key: {**q.as_json(), "worst": worst[key], "mean": mean[key]}
                for key, q in QUANTITIES.items()
            },
            "seeds": [record.as_json() for record in self.seeds],
        }
