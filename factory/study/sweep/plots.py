"""Plots of a sweep's summary as PNG. They need matplotlib, an optional package."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import Any

from factory.study.sweep.summary import Group, Summary
from factory.support.plotting import BLUE, STYLE, figure_and_axes, png, require_matplotlib

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

MOST = 10
"""Upper bound on the lines or histograms of a plot."""


def plots(summary: Summary) -> dict[str, bytes]:
    """The plots by file name, FIGURE.png each. Raises MissingError where there is no
    matplotlib."""
    require_matplotlib("a plot", "-o REPORT.json for figures alone")
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
        for group in groups[:MOST]:
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
        if number == MOST:
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
