"""Summary of a sweep, from its database: mean, standard deviation and confidence interval of each
figure."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from factory.apps.drawing.tables import Tabular, titled
from factory.apps.sweep.grid import Value
from factory.apps.sweep.store import reading
from factory.apps.sweep.work import FAILING_FIGURES, FIGURES

CONFIDENCE = 0.95

UNTOLD = ("wall_time_s", "physics_time_s", "supervisor_time_s", "realtime_factor", "refines_net")
"""Figures that depend on the machine, or on nothing: left out of a summary."""

FIRST = ("cycle_time_s", "predicted_cycle_time_s")
"""The figures with which a summary begins."""

SUMMED = (
    *FIRST,
    *(k for k, kind in FIGURES.items() if kind != "TEXT" and k not in (*FIRST, *UNTOLD)),
    *FAILING_FIGURES,
)
"""Figures that are summarised."""


@dataclass(frozen=True, slots=True)
class Statistic:
    """Statistic of n values: mean, standard deviation (n - 1), the 95 % confidence interval of the
    mean (Student's t), None for n < 2; the least and the greatest value."""

    n: int
    mean: float
    deviation: float | None
    confidence_low: float | None
    confidence_high: float | None
    least: float
    greatest: float


@dataclass
class Group:
    """The runs that differ only in their seeds: the `values` of the other keys that vary, the
    numbers of runs done and failed, and the values of each figure of those done."""

    values: tuple[tuple[str, Value], ...]
    done: int = 0
    failed: int = 0
    columns: dict[str, array[float]] = field(default_factory=dict, repr=False)

    def add(self, row: Mapping[str, Any]) -> None:
        """Add a run."""
        if row["status"] == "failed":
            self.failed += 1
            return
        self.done += 1
        kept = row.keys()
        for key in SUMMED:
            if key in kept and row[key] is not None:
                self.columns.setdefault(key, array("d")).append(row[key])

    @cached_property
    def figures(self) -> Mapping[str, Statistic]:
        """The statistic of each figure, after all runs are added."""
        return {key: statistic(self.columns[key]) for key in SUMMED if key in self.columns}

    @property
    def pace(self) -> tuple[float | None, float | None]:
        """The mean of the cycle time and its standard deviation [s], where it was measured."""
        cycle = self.figures.get(FIRST[0])
        return (cycle.mean, cycle.deviation) if cycle else (None, None)

    def record(self) -> dict[str, object]:
        """The group as a row of a table."""
        row: dict[str, object] = {**dict(self.values), "done": self.done, "failed": self.failed}
        for key, one in self.figures.items():
            row |= {key: one.mean, f"{key}_deviation": one.deviation}
            row |= {f"{key}_low": one.confidence_low, f"{key}_high": one.confidence_high}
        return row

    def as_json(self) -> dict[str, Any]:
        """Under the keys of `sweep --summary --json`."""
        figures = {key: asdict(statistic) for key, statistic in self.figures.items()}
        return {"values": dict(self.values), "done": self.done, "failed": self.failed} | {
            "figures": figures
        }


@dataclass(frozen=True, slots=True)
class Summary(Tabular):
    """The groups of a sweep, in the order of their values; `reasons`: why runs failed, with the
    number of each."""

    product: str
    varied: tuple[str, ...]
    groups: tuple[Group, ...]
    reasons: Mapping[str, int]

    def __repr__(self) -> str:
        varied = ", ".join(self.varied)
        counts = f"{self.done} runs done, {self.failed} failed"
        groups = f"{len(self.groups)} group{'s' * (len(self.groups) != 1)}"
        return f"<Summary of {self.product}: {counts}; {groups}, varied: {varied}>"

    def _repr_html_(self) -> str:
        names = [key for key, _ in self.groups[0].values] if self.groups else []
        rows = (
            (*(value for _, value in group.values), group.done, group.failed, *group.pace)
            for group in self.groups
        )
        figures = ("done", "failed", "cycle time [s]", "deviation [s]")
        return titled(repr(self), (*names, *figures), rows)

    def records(self) -> list[dict[str, object]]:
        """A row for each group: what varies, the numbers of runs done and failed, and the mean of
        each figure with its `_deviation` and the 95 % confidence interval, from `_low` to
        `_high`."""
        return [group.record() for group in self.groups]

    @property
    def done(self) -> int:
        """Number of runs done."""
        return sum(group.done for group in self.groups)

    @property
    def failed(self) -> int:
        """Number of runs failed."""
        return sum(group.failed for group in self.groups)

    def as_json(self) -> dict[str, Any]:
        """Under the keys of `sweep --summary --json`."""
        return {
            "product": self.product,
            "varied": list(self.varied),
            "done": self.done,
            "failed": self.failed,
            "reasons": dict(self.reasons),
            "confidence": CONFIDENCE,
            "groups": [group.as_json() for group in self.groups],
        }


def summarise(database: Path) -> Summary:
    """The summary of a database, also while a sweep still writes it. Raises InputError
    (BadFile)."""
    groups: dict[tuple[tuple[str, Value], ...], Group] = {}
    reasons: Counter[str] = Counter()
    with reading(database) as (identity, rows):
        varied = tuple(identity["varied"])
        shared = [key for key in varied if key != "seed"]
        for row in rows:
            values = tuple((key, row[key]) for key in shared)
            if values not in groups:
                groups[values] = Group(values)
            groups[values].add(row)
            if row["reason"]:
                reasons[row["reason"]] += 1
        places = sorted(groups, key=lambda values: [(isinstance(v, str), v) for _, v in values])
    ordered = tuple(groups[values] for values in places)
    return Summary(str(identity["product"]), varied, ordered, dict(reasons.most_common()))


def statistic(values: Sequence[float]) -> Statistic:
    """The statistic of one value or more."""
    n, mean = len(values), float(np.mean(values))
    least, greatest = float(min(values)), float(max(values))
    if n < 2:
        return Statistic(n, mean, None, None, None, least, greatest)
    deviation = float(np.std(values, ddof=1))
    half = float(stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * deviation / sqrt(n)
    return Statistic(n, mean, deviation, mean - half, mean + half, least, greatest)
