"""Do the figures depend on the timestep, or on how stiff the welds are?"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from benches.fidelity.products import PAPER, REAL, layout
from benches.tables import table
from factory.apps.fidelity import QUANTITIES
from factory.apps.fidelity.comparing import Case, over_cases
from factory.apps.fidelity.record import Figures
from factory.engine.mjcf.timestep import timed
from factory.support.engine import mujoco

UNITS = 4

SHOWN = (
    "cycle_time_s",
    "cycle_from_predicted_percent",
    "tracking_error_max_mm",
    "handoff_gap_max_mm",
    "weld_residual_max_mm",
    "product_error_max_mm",
    "drive_work_J",
)
"""The figures in the table; all are in the kept results."""

SERIES = {"timestep": (2.0, 1.0, 0.5, 0.25), "weld time constant": (2.0, 1.0, 0.5)}
"""Factors on a setting, the finest last. Time constants are varied at half the timestep: one below
two timesteps is raised to those by the engine."""

RELATIVE, ABSOLUTE = 0.05, {"%": 0.1, "s": 0.002, "mm": 0.002, "deg": 0.002, "J": 1e-3, "kg": 1e-9}
"""A figure has converged if its last change is at most this share of its last value, or at most
this, by its unit. Counts must not change."""


def converged(key: str, figures: Sequence[Figures]) -> bool:
    """Whether a figure hardly changes between the two finest settings."""
    one, other = (of.get(key) for of in figures[-2:])
    if one is None or other is None:
        return one is other
    return abs(other - one) <= max(RELATIVE * abs(other), ABSOLUTE.get(QUANTITIES[key].unit, 0.0))


def altered(case: Case, setting: str, factor: float) -> Case:
    """A case with a setting multiplied; its tick stays as near as whole steps allow."""
    settings = timed(case.settings, case.layout, jitter=case.jitter)
    finer = factor if setting == "timestep" else 0.5
    substeps = max(1, round(settings.steps / finer))
    other = replace(settings, timestep=settings.step * finer, substeps=substeps)
    alter = None if setting == "timestep" else partial(soften, factor=factor)
    return replace(case, settings=other, alter=alter)


def soften(m: mujoco.MjModel, factor: float) -> None:
    """Multiply the time constants of all welds by a factor."""
    m.eq_solref[:, 0] *= factor


def study(case: Case, quick: bool) -> dict[str, Any]:
    """All series of seed 0, and the figures that do not converge in some of them."""
    made = []
    for setting, factors in SERIES.items():
        chosen = (1.0, 0.5) if quick else factors
        cases = [(altered(case, setting, factor), 0) for factor in chosen]
        figures = [record.figures for record in over_cases(cases, os.cpu_count() or 1)]
        kept = {
            key: {"values": [of[key] for of in figures], "converged": converged(key, figures)}
            for key in QUANTITIES
        }
        made.append({"setting": setting, "factors": list(chosen), "figures": kept})
    unsettled = [k for k in QUANTITIES if not all(s["figures"][k]["converged"] for s in made)]
    return {"seed": 0, "not_converged": unsettled, "series": made}


def measure(quick: bool = False) -> dict[str, Any]:
    """The study of one seed of each product."""
    found = {}
    for name in (PAPER,) if quick else (PAPER, *REAL):
        found[name] = study(Case(layout(name), 1 if quick else UNITS), quick)
    return {"units": 1 if quick else UNITS, "products": found}


def section(results: dict[str, Any]) -> str:
    """The report."""
    parts = [
        "## Convergence",
        f"Seed 0 at jitter 0.3, {results['units']} units, with the timestep and then the time"
        " constant of the welds (at half the timestep) multiplied by the factors. A figure has"
        " converged if it changes by at most 5 %, or by less than is noticeable, between the two"
        " finest. The welds' time constant is kept at two timesteps, the least the engine allows,"
        " so figures that depend on the compliance of welds depend on the timestep.",
    ]
    for name, studied in results["products"].items():
        for series in studied["series"]:
            head = (f"`{name}`", *(f"x {f:g}" for f in series["factors"]), "converged")
            rows = [
                (key.replace("_", " "), *figure["values"], figure["converged"])
                for key, figure in series["figures"].items()
                if key in SHOWN
            ]
            parts += [f"By the {series['setting']}:", table(head, rows)]
        said = ", ".join(f"`{key}`" for key in studied["not_converged"]) or "none"
        parts.append(f"Not converged in `{name}`: {said}.")
    return "\n\n".join(parts)
