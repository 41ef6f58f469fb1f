"""Results of a comparison of the worlds: frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from factory.study.fidelity.quantities import QUANTITIES
from factory.support.errors import Diagnostic

Figures = Mapping[str, float | None]
"""Values by the key of their quantity; None where there is nothing to measure."""


@dataclass(frozen=True, slots=True)
class HandOff:
    """One hand-off: its time, the new carrier, number and mass of the parts; figures as defined in
    `quantities`."""

    time_s: float
    carrier: str
    parts: int
    mass_kg: float
    gap_mm: float
    speed_step_mm_s: float
    impulse_mNs: float = 0.0
    energy_mJ_per_kg: float = 0.0


@dataclass(frozen=True, slots=True)
class Misplaced:
    """Largest deviation of a part from its place in a finished product."""

    part: str
    position_mm: float
    angle_deg: float
    vertex_mm: float


@dataclass(frozen=True, slots=True)
class ClosestApproach:
    """The least distance between bodies of two kinds within the detection distance, the certified
    distance, and the two bodies."""

    kinds: str
    certified_mm: float
    least_mm: float
    bodies: tuple[str, str]


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
    """One seed: the figures of its runs in both worlds.

    `differences` [s]: time in MuJoCo less time in the ideal world of every firing; `durations`:
    likewise of every operation. `trouble`: why a run did not succeed.
    """

    seed: int
    units: int
    figures: Figures
    handoffs: tuple[HandOff, ...] = ()
    misplaced: tuple[Misplaced, ...] = ()
    approaches: tuple[ClosestApproach, ...] = ()
    hidden: tuple[Penetration, ...] = ()
    differences: tuple[float, ...] = field(default=(), repr=False)
    durations: tuple[float, ...] = field(default=(), repr=False)
    contacts: tuple[str, ...] = ()
    trouble: tuple[Diagnostic, ...] = ()
    run_s: float = 0.0
    measuring_s: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether both runs succeeded."""
        return not self.trouble

    def as_json(self) -> dict[str, Any]:
        """The record as the report lists it."""
        return {
            "seed": self.seed,
            "units": self.units,
            "passed": self.passed,
            "figures": dict(self.figures),
            "handoffs": [asdict(h) for h in self.handoffs],
            "misplaced": [asdict(m) for m in self.misplaced],
            "approaches": [asdict(a) for a in self.approaches],
            "hidden_penetrations": [asdict(p) for p in self.hidden],
            "firing_differences_s": list(self.differences),
            "duration_differences_s": list(self.durations),
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
        """The document of `fidelity --json`, without the convergence study."""
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
