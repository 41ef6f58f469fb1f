"""Do the figures depend on the timestep, or on how stiff the welds are?"""

from __future__ import annotations

import os
from typing import Any

from factory.study.fidelity import study
from factory.study.fidelity.comparing import Case
from tests.fidelity.products import PAPER, REAL, layout
from tests.tables import table

UNITS = 4

SHOWN = (
    "cycle_time_s",
    "cycle_from_predicted_percent",
    "tracking_error_max_mm",
    "handoff_gap_max_mm",
    "handoff_energy_max_mJ_per_kg",
    "weld_residual_max_mm",
    "product_vertex_max_mm",
    "closest_approach_mm",
    "drive_work_J",
    "payload_acceleration_max_m_s2",
)
"""The figures in the table; all are in the kept results."""


def measure(quick: bool = False) -> dict[str, Any]:
    """The study of one seed of each product."""
    found = {}
    for name in (PAPER,) if quick else (PAPER, *REAL):
        factors = {"timesteps": (1.0, 0.5), "stiffnesses": (1.0, 0.5)} if quick else {}
        units = 1 if quick else UNITS
        studied = study(Case(layout(name), units), jobs=os.cpu_count() or 1, **factors)
        found[name] = studied.as_json()
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
