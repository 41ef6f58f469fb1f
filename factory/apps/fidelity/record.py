"""Results of a comparison of the worlds, and its quantities, each with its unit and definition.

Those that a run measures itself have the name and the value of `run --json`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any

from factory.api import Diagnostic, RunVerdict
from factory.apps.drawing.tables import Tabular


@dataclass(frozen=True, slots=True)
class Quantity:
    """A figure of one run (or of the two runs of a seed): its key, unit and definition, and the
    largest size in a good factory, None for no bound."""

    key: str
    unit: str
    definition: str
    limit: float | None = None

    def worst(self, values: Iterable[float | None]) -> float | None:
        """The largest value by size; None without values."""
        return max((value for value in values if value is not None), key=abs, default=None)

    def exceeded(self, value: float | None) -> bool:
        """Whether a value is beyond the limit."""
        return value is not None and self.limit is not None and abs(value) > self.limit

    def as_json(self) -> dict[str, object]:
        """The definition as `fidelity --json` lists it."""
        return {"unit": self.unit, "definition": self.definition, "limit": self.limit}


_ALL = (
    Quantity(
        "illegal_records",
        "records",
        "How many of the two records an independent replay refuses as runs of the net.",
        0,
    ),
    Quantity(
        "monitor_violations",
        "violations",
        "Observations of the independent monitor, which sees only the engine, that contradict the "
        "net.",
        0,
    ),
    Quantity(
        "cycle_time_s",
        "s",
        "Mean interval between dropoffs in MuJoCo over the last half of the units; none below 4.",
    ),
    Quantity(
        "cycle_from_ideal_percent",
        "%",
        "Cycle time in MuJoCo over that in the ideal world, less 1.",
    ),
    Quantity(
        "cycle_from_predicted_percent",
        "%",
        "Cycle time in MuJoCo over the one predicted for it before the run, less 1.",
        2,
    ),
    Quantity(
        "duration_difference_mean_s",
        "s",
        "Mean over all operations of (X_e - X_s in MuJoCo) - (X_e - X_s in the ideal world): what "
        "acceleration and settling add to one operation.",
    ),
    Quantity(
        "tracking_error_max_mm",
        "mm",
        "Largest |measured - reference position| of any axis (robots, lifts, the tray) at the end "
        "of any tick.",
        1,
    ),
    Quantity(
        "handoffs",
        "switches",
        "Grips and holds of a part switched on as another carrier releases it.",
    ),
    Quantity(
        "handoff_gap_max_mm",
        "mm",
        "Largest distance between the two frames a weld joins, just before it is switched on.",
    ),
    Quantity("handoff_angle_max_deg", "deg", "Largest angle between them, likewise."),
    Quantity(
        "weld_residual_max_mm",
        "mm",
        "Largest distance, along an axis, between the frames joined by an active, awake weld.",
        1,
    ),
    Quantity(
        "product_error_max_mm",
        "mm",
        "Largest displacement of any vertex of any part from its place in the product, when it is "
        "dropped off, after a rigid fit on the first part.",
    ),
    Quantity("product_angle_max_deg", "deg", "Largest angle of a part from its place."),
    Quantity(
        "hidden_penetration_max_mm",
        "mm",
        "Deepest penetration between any two things that are drawn, with all of them solid, every "
        "20 ms: no contact is left out except between things fixed to each other. Of parts that "
        "overlap in the finished product, only the penetration beyond that overlap.",
        0.1,
    ),
    Quantity(
        "grip_gap_max_mm",
        "mm",
        "Largest distance between the pads of a robot, a feeder or the tray and the nearest of the "
        "bodies that it takes, when it takes its first.",
    ),
    Quantity(
        "grip_strength_share_max",
        "",
        "Largest share of the strength of a hand's tips used by the force and moment of its load, "
        "measured several times a second; none if no robot has a hand. "
        "Above 1 the hand lets go (Dropped).",
        1,
    ),
    Quantity(
        "force_saturated_percent",
        "%",
        "Share of timesteps in which a drive's force is at least 99.9 % of its limit; the worst "
        "drive.",
        1,
    ),
    Quantity("force_peak_percent", "%", "Largest force of a drive over its limit.", 100),
    Quantity("drive_work_J", "J", "Work of all drives: the integral of |force x speed|."),
    Quantity("moved_mass_kg", "kg", "Mass of everything that can move: carriages, tray, parts."),
    Quantity("unintended_contacts", "onsets", "Onsets of unintended contact."),
    Quantity("engine_warnings", "warnings", "Warnings of the engine."),
)

QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {q.key: replace(q, limit=RunVerdict.MOST.get(q.key, q.limit)) for q in _ALL}
)
"""Every quantity by its key, in the order of the reports, with the limits of a run's verdict."""


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
class Fidelity(Tabular):
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

    def records(self) -> list[dict[str, object]]:
        """A row for each seed, with its figures."""
        return [
            {"seed": one.seed, "units": one.units, "passed": one.passed, **one.figures}
            for one in self.seeds
        ]

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
