"""Summary of a sweep, from its database: mean, standard deviation and confidence interval of each
figure, and plots of them (with matplotlib, an optional package)."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import groupby
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from factory.study.sweep.grid import Value
from factory.study.sweep.store import reading
from factory.study.sweep.work import FAILING_FIGURES, FIGURES
from factory.support.plotting import BLUE, STYLE, figure_and_axes, png, require_matplotlib

CONFIDENCE = 0.95

UNTOLD = ("wall_time_s", "physics_time_s", "supervisor_time_s", "refines_net")
"""Figures that do not depend on the factory: left out of a summary."""

SUMMED = (
    *(key for key, kind in FIGURES.items() if kind != "TEXT" and key not in UNTOLD),
    *FAILING_FIGURES,
)
"""Figures that are summarised."""

PLOTTED = (
    "cycle_time_s",
    "sim_time_s",
    "product_error_max_mm",
    "handoff_gap_max_mm",
    "weld_residual_max_mm",
)
"""Figures with a plot each, where a sweep has them."""

UNITS = {
    "speed": "m/s",
    "acceleration": "m/s²",
    "outfeed": "m/s",
    "timestep": "s",
    "settle": "s",
    "clearance": "m",
    "eps": "m",
}
"""Of the keys that vary."""

LINES = 10
"""Upper bound on the lines or histograms of a plot."""


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

    def as_json(self) -> dict[str, Any]:
        """Under the keys of `sweep --summary --json`."""
        figures = {key: asdict(statistic) for key, statistic in self.figures.items()}
        return {"values": dict(self.values), "done": self.done, "failed": self.failed} | {
            "figures": figures
        }


@dataclass(frozen=True, slots=True)
class Summary:
    """The groups of a sweep, in the order of their values; `reasons`: why runs failed, with the
    number of each."""

    product: str
    varied: tuple[str, ...]
    groups: tuple[Group, ...]
    reasons: Mapping[str, int]

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


def check_plots() -> None:
    """Raises MissingError without matplotlib."""
    require_matplotlib("a plot", "leave out --plots")


def plots(summary: Summary) -> dict[str, bytes]:
    """The plots by file name, FIGURE.png each. Raises MissingError without matplotlib."""
    check_plots()
    import matplotlib

    with matplotlib.rc_context(STYLE):
        return {
            f"{key}.png": png(_plot(summary, key))
            for key in PLOTTED
            if any(key in group.figures for group in summary.groups)
        }


def _plot(summary: Summary, key: str) -> Any:
    """A figure against the first number that varies, with confidence intervals; its histogram
    where only seeds, or words, vary."""
    groups = [group for group in summary.groups if key in group.figures]
    words = {k for group in groups for k, v in group.values if isinstance(v, str)}
    numbers = [k for k, _ in groups[0].values if k not in words]
    across = next((k for k in numbers if len({dict(g.values)[k] for g in groups}) > 1), None)
    figure, ((axes,),) = figure_and_axes()
    if across is None:
        for group in groups[:LINES]:
            color, label = None if group.values else BLUE, _words(group.values)
            axes.hist(group.columns[key], bins=40, color=color, alpha=0.7, label=label)
        axes.set_xlabel(_label(key))
        axes.set_ylabel("runs")
    else:
        _lines(axes, groups, key, across)
        axes.set_xlabel(f"{across} [{UNITS[across]}]" if across in UNITS else across)
        axes.set_ylabel(_label(key))
    runs = sum(group.figures[key].n for group in groups)
    axes.set_title(f"{summary.product}: {_label(key)}, {runs} runs")
    if any(axes.get_legend_handles_labels()[1]):
        axes.legend(fontsize=8)
    return figure


def _lines(axes: Any, groups: Sequence[Group], key: str, across: str) -> None:
    """Means with their confidence intervals, a line for each choice of the other keys."""

    def others(group: Group) -> tuple[Any, ...]:
        return tuple(item for item in group.values if item[0] != across)

    def place(group: Group) -> Any:
        return dict(group.values)[across]

    parted = groupby(sorted(groups, key=others), key=others)
    for number, (rest, members) in enumerate(parted):
        if number == LINES:
            break
        line = sorted(members, key=place)
        statistics = [group.figures[key] for group in line]
        spread = [
            0.0 if s.confidence_low is None else s.mean - s.confidence_low for s in statistics
        ]
        axes.errorbar(
            [place(group) for group in line],
            [s.mean for s in statistics],
            spread,
            fmt="-o",
            markersize=3,
            linewidth=1,
            capsize=2,
            color=None if rest else BLUE,
            label=_words(rest),
        )


def _words(values: Sequence[tuple[str, Any]]) -> str | None:
    return ", ".join(f"{key} {value}" for key, value in values) or None


def _label(key: str) -> str:
    """`cycle_time_s` as `cycle time [s]`."""
    words, _, unit = key.rpartition("_")
    return f"{words.replace('_', ' ')} [{unit}]"
