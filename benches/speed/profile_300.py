"""Where the time of a large run goes."""

from __future__ import annotations

import cProfile
import pstats
from pathlib import Path
from typing import Any

from benches.speed.factories import (
    Case,
    Steady,
    judge,
    laid_out,
    robots_at_least,
    run_in,
    run_until,
)
from benches.speed.processes import ROOT, fresh, serve
from benches.tables import table

AIM, TOP, WINDOW = 85.0, 8, 5.0
"""Percent of the time in the engine's step; functions shown; simulated [s]."""


def work(robots: int, timestep: float, window: float) -> dict[str, Any]:
    """The functions of a window of steady production that take the most time of their own."""
    layout = laid_out(robots_at_least(robots))
    simulation = Case(robots, timestep).simulation(layout)
    since = run_in(simulation, Steady.of(layout, None))
    profile = cProfile.Profile()
    profile.runcall(run_until, simulation, since + window)
    judge(simulation)
    stats = pstats.Stats(profile)
    taken: Any = stats.stats  # type: ignore[attr-defined]
    most = sorted(taken.items(), key=lambda item: -item[1][2])[:TOP]
    total = sum(own for _, _, own, *_ in taken.values())
    return {
        "robots": len(layout.factory.robots),
        "timestep": timestep,
        "from_s": since,
        "to_s": since + window,
        "rows": [[named(*where), 100 * found[2] / total, found[0]] for where, found in most],
    }


def named(file: str, line: int, function: str) -> str:
    """A function as people know it."""
    path = Path(file)
    inside = path.is_absolute() and path.is_relative_to(ROOT)
    module = path.relative_to(ROOT) if inside else path.name
    return f"{module}: {function}" if line else function.strip("<>")


def measure(quick: bool = False) -> dict[str, Any]:
    """One profile."""
    robots, window = (40, 1.0) if quick else (300, WINDOW)
    return fresh(work, robots=robots, timestep=0.004, window=window)


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = [(f"`{name}`", f"{share:.1f} %", calls) for name, share, calls in results["rows"]]
    return "\n\n".join(
        [
            "## Profile",
            f"`cProfile` of {results['robots']} robots in steady production at"
            f" {1000 * results['timestep']:g} ms, one body per part, the whole pool, contact"
            f" between payloads on, {results['from_s']:.1f}–{results['to_s']:.1f} s: time of"
            " their own. The profiler slows Python down and not the engine, so the engine's share"
            f" is a lower bound (aim: > {AIM:g} %).",
            table(("function", "of the time", "calls"), rows),
        ]
    )


if __name__ == "__main__":
    serve(work)
