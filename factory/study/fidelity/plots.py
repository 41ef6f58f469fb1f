"""Plots of a comparison as PNG. They need matplotlib, an optional package."""

from __future__ import annotations

from typing import Any

import numpy as np

from factory.study.fidelity.convergence import Series, Study
from factory.study.fidelity.quantities import QUANTITIES
from factory.study.fidelity.record import ClosestApproach, Fidelity
from factory.support.plotting import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    STYLE,
    figure_and_axes,
    png,
    require_matplotlib,
)

MOST = 40
"""Upper bound on the parts with a bar each, the worst of more."""

LEAST = 1e-5
"""Smaller energies are drawn as this [mJ/kg]."""


def check_plots() -> None:
    """Raises MissingError where there is no matplotlib."""
    require_matplotlib("a plot", "-o REPORT.json for figures alone")


def plots(fidelity: Fidelity, study: Study | None = None) -> dict[str, bytes]:
    """The plots by file name. Raises MissingError where there is no matplotlib."""
    check_plots()
    import matplotlib

    with matplotlib.rc_context(STYLE):
        made = {
            "limits.png": _limits(fidelity),
            "times.png": _times(fidelity),
            "handoffs.png": _handoffs(fidelity),
            "product.png": _product(fidelity),
            "approach.png": _approach(fidelity),
        }
        if study is not None:
            made["convergence.png"] = _convergence(study)
        return {name: png(figure) for name, figure in made.items() if figure is not None}


def _words(key: str) -> str:
    """A figure's key as words, without its unit."""
    unit = QUANTITIES[key].unit
    for ending in (unit, unit.replace("/", "_per_"), unit.replace("/", "_"), unit.replace(" ", "")):
        key = key.removesuffix("_" + ending.replace("^", ""))
    return key.removesuffix("_percent").replace("_", " ")


def _limits(fidelity: Fidelity) -> Any:
    """Every figure that has a limit other than 0, as a share of it."""
    worst = fidelity.worst()
    rows = [
        (f"{_words(k)}  ({value:.3g} of {q.limit:g} {q.unit})", abs(value / q.limit))
        for k, q in QUANTITIES.items()
        if q.limit and (value := worst[k]) is not None and not (q.least and value > 0)
    ]
    figure, ((axes,),) = figure_and_axes(height=0.6 + 0.27 * len(rows))
    labels, shares = [row[0] for row in rows][::-1], [100 * row[1] for row in rows][::-1]
    axes.barh(labels, shares, color=[RED if s > 100 else BLUE for s in shares], height=0.6)
    axes.axvline(100, color=RED, linewidth=1)
    axes.set_xlabel("worst of all seeds, share of its limit [%]")
    axes.grid(axis="y", visible=False)
    return figure


def _times(fidelity: Fidelity) -> Any:
    """Distributions of differences in firing times and durations."""
    figure, ((left, right),) = figure_and_axes(2)
    cycle = np.mean(fidelity.values("ideal_cycle_time_s") or [np.nan])
    apart = np.concatenate([np.array(r.differences) for r in fidelity.seeds])
    spent = np.concatenate([np.array(r.durations) for r in fidelity.seeds])
    for axes, values, title in (
        (left, apart, "firing times, MuJoCo less ideal"),
        (right, spent, "durations of operations, MuJoCo less ideal"),
    ):
        if len(values):
            axes.hist(values, bins=40, color=BLUE)
        axes.set_title(title)
        axes.set_xlabel("difference [s]")
    left.set_ylabel("firings")
    right.set_ylabel("operations")
    if np.isfinite(cycle):
        below = left.secondary_xaxis(
            -0.28, functions=(lambda s: 100 * s / cycle, lambda p: p * cycle / 100)
        )
        below.set_xlabel("difference [% of the ideal cycle time]")
    return figure


def _handoffs(fidelity: Fidelity) -> Any:
    """Injected energy against the gap and against the speed step."""
    handoffs = [h for record in fidelity.seeds for h in record.handoffs]
    if not handoffs:
        return None
    figure, ((left, right),) = figure_and_axes(2)
    energy = [max(h.energy_mJ_per_kg, LEAST) for h in handoffs]
    limit = QUANTITIES["handoff_energy_max_mJ_per_kg"].limit or 0.0
    for axes, values, words in (
        (left, [h.gap_mm for h in handoffs], "gap [mm]"),
        (right, [h.speed_step_mm_s for h in handoffs], "speed step [mm/s]"),
    ):
        axes.scatter(values, energy, s=10, color=BLUE, alpha=0.5, linewidths=0)
        axes.axhline(limit, color=RED, linewidth=1)
        axes.set_yscale("log")
        axes.set_xlabel(words)
        axes.set_xlim(left=0)
    left.set_ylabel("injected energy [mJ/kg]")
    left.set_title(f"{len(handoffs)} hand-offs; line: limit")
    return figure


def _product(fidelity: Fidelity) -> Any:
    """Position, vertex and angle of every part, at its worst over the seeds."""
    parts: dict[str, list[Any]] = {}
    for record in fidelity.seeds:
        for misplaced in record.misplaced:
            parts.setdefault(misplaced.part, []).append(misplaced)
    if not parts:
        return None
    rows = [
        (
            part,
            *(max(getattr(m, k) for m in seen) for k in ("position_mm", "vertex_mm", "angle_deg")),
        )
        for part, seen in parts.items()
    ]
    if len(rows) > MOST:
        rows = sorted(rows, key=lambda row: -row[2])[:MOST]
    figure, ((above,), (below,)) = figure_and_axes(rows=2, height=4.6)
    at = np.arange(len(rows))
    above.bar(at - 0.2, [1e3 * r[1] for r in rows], 0.4, color=BLUE, label="centre of mass")
    above.bar(at + 0.2, [1e3 * r[2] for r in rows], 0.4, color=ORANGE, label="worst vertex")
    above.set_ylabel("displacement [µm]")
    above.legend(loc="upper left", bbox_to_anchor=(0, 1.25), ncols=2)
    below.bar(at, [r[3] for r in rows], 0.6, color=BLUE)
    below.set_ylabel("angle [deg]")
    above.set_ylim(0, max(1e-3, 1.1e3 * max(r[2] for r in rows)))
    below.set_ylim(0, max(1e-5, 1.1 * max(r[3] for r in rows)))
    above.set_xticks(at, [""] * len(rows))
    below.set_xticks(at, [r[0] for r in rows], rotation=90 if len(rows) > 8 else 0)
    for axes in (above, below):
        axes.grid(axis="x", visible=False)
    return figure


def _approach(fidelity: Fidelity) -> Any:
    """Least distances by kinds of bodies, and those certified."""
    least: dict[str, ClosestApproach] = {}
    for record in fidelity.seeds:
        for approach in record.approaches:
            kept = least.get(approach.kinds)
            if kept is None or approach.least_mm < kept.least_mm:
                least[approach.kinds] = approach
    if not least:
        return None
    rows = [least[kinds] for kinds in sorted(least, reverse=True)]
    figure, ((axes,),) = figure_and_axes(height=0.8 + 0.4 * len(rows))
    at = np.arange(len(rows))
    axes.barh(at, [r.least_mm for r in rows], 0.5, color=BLUE, label="closest approach")
    axes.plot([r.certified_mm for r in rows], at, "|", ms=18, mew=2, color=RED, label="certified")
    axes.set_yticks(at, [f"{r.kinds}\n{' – '.join(r.bodies)}" for r in rows], fontsize=8)
    axes.set_xlabel("distance [mm]")
    axes.grid(axis="y", visible=False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def _convergence(study: Study) -> Any:
    """Every figure relative to its value at the finest setting, coloured if it does not
    converge."""
    import matplotlib

    unsettled = study.unsettled()
    hues = matplotlib.colormaps["turbo"](np.linspace(0.05, 0.95, max(1, len(unsettled))))
    figure, (row,) = figure_and_axes(len(study.series), height=4.6 + 0.08 * len(unsettled))
    for axes, series in zip(row, study.series, strict=True):
        _one_series(axes, series, dict(zip(unsettled, hues, strict=False)))
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=7.5, ncols=2)
    row[0].set_ylabel("figure over its value at the finest setting")
    return figure


def _one_series(axes: Any, series: Series, hues: dict[str, Any]) -> None:
    chosen = [k for k in QUANTITIES if series.figures[-1].get(k) and series.noticeable(k)]
    axes.plot([], [], "-o", ms=3, linewidth=0.8, color=GREY, label="converged")
    for key in sorted(chosen, key=series.converged, reverse=True):
        last = series.figures[-1][key] or 1.0
        values = [np.nan if (v := f.get(key)) is None else v / last for f in series.figures]
        settled = series.converged(key)
        axes.plot(
            series.factors,
            values,
            "-o",
            ms=3,
            linewidth=0.8 if settled else 1.4,
            color=GREY if settled else hues[key],
            label=None if settled else _words(key),
        )
    axes.set_xscale("log", base=2)
    axes.set_xticks(series.factors, [f"×{factor:g}" for factor in series.factors])
    axes.invert_xaxis()
    axes.set_yscale("log")
    axes.set_ylim(0.08, 12)
    axes.set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
    axes.minorticks_off()
    axes.set_title(series.setting)
