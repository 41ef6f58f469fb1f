"""Mean, spread and confidence of the figures of a sweep, from its database."""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from factory.study.sweep.grid import Value
from factory.study.sweep.store import reading
from factory.study.sweep.work import FIGURES

CONFIDENCE = 0.95

UNTOLD = ("wall_time_s", "physics_time_s", "supervisor_time_s", "refines_net")
"""Figures that do not depend on the factory."""

SUMMED = tuple(key for key, kind in FIGURES.items() if kind != "TEXT" and key not in UNTOLD)


@dataclass(frozen=True, slots=True)
class Statistic:
    """Of n values: mean, standard deviation (n - 1), and the ends of the interval that holds the
    true mean with 95 % confidence (Student's t); None where n is less than 2. Least, greatest."""

    n: int
    mean: float
    deviation: float | None
    confidence_low: float | None
    confidence_high: float | None
    least: float
    greatest: float


@dataclass(frozen=True, slots=True)
class Group:
    """The runs that differ in their seeds alone: what they share of the keys that vary, how many
    are done and failed, and a statistic of each figure of those that are done."""

    values: tuple[tuple[str, Value], ...]
    done: int
    failed: int
    figures: Mapping[str, Statistic]

    def as_json(self) -> dict[str, Any]:
        """Under the keys of `sweep --summary --json`."""
        figures = {key: asdict(statistic) for key, statistic in self.figures.items()}
        return {"values": dict(self.values), "done": self.done, "failed": self.failed} | {
            "figures": figures
        }


@dataclass(frozen=True, slots=True)
class Summary:
    """A sweep's groups, in the order of their values; `reasons`: why runs failed, with how many
    each; `columns`: the values of each figure in each group."""

    product: str
    varied: tuple[str, ...]
    groups: tuple[Group, ...]
    reasons: Mapping[str, int]
    columns: tuple[Mapping[str, Sequence[float]], ...]

    @property
    def done(self) -> int:
        """Runs that are done."""
        return sum(group.done for group in self.groups)

    @property
    def failed(self) -> int:
        """Runs that failed."""
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


class _Part:
    """The rows of one group."""

    def __init__(self) -> None:
        self.done = self.failed = 0
        self.columns = {key: array("d") for key in SUMMED}

    def add(self, row: Mapping[str, Any]) -> None:
        """One more row."""
        if row["status"] == "failed":
            self.failed += 1
            return
        self.done += 1
        for key, column in self.columns.items():
            if row[key] is not None:
                column.append(row[key])


def summarise(database: Path) -> Summary:
    """The summary of a database, also while a sweep still writes it. Raises InputError
    (BadFile)."""
    parts: defaultdict[tuple[Value, ...], _Part] = defaultdict(_Part)
    reasons: Counter[str] = Counter()
    with reading(database) as (identity, rows):
        varied = tuple(identity["varied"])
        shared = [key for key in varied if key != "seed"]
        for row in rows:
            parts[tuple(row[key] for key in shared)].add(row)
            if row["reason"]:
                reasons[row["reason"]] += 1
    places = sorted(parts, key=lambda place: [(isinstance(v, str), v) for v in place])
    columns = [{k: c for k, c in parts[place].columns.items() if c} for place in places]
    groups = [
        Group(
            tuple(zip(shared, place, strict=True)),
            parts[place].done,
            parts[place].failed,
            {key: statistic(column) for key, column in found.items()},
        )
        for place, found in zip(places, columns, strict=True)
    ]
    told = dict(reasons.most_common())
    return Summary(str(identity["product"]), varied, tuple(groups), told, tuple(columns))


def statistic(values: Sequence[float]) -> Statistic:
    """The statistic of one value or more."""
    n, mean = len(values), float(np.mean(values))
    least, greatest = float(min(values)), float(max(values))
    if n < 2:
        return Statistic(n, mean, None, None, None, least, greatest)
    deviation = float(np.std(values, ddof=1))
    half = float(stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * deviation / sqrt(n)
    return Statistic(n, mean, deviation, mean - half, mean + half, least, greatest)
