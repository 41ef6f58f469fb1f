"""Every figure of `factory fidelity` over seeds at jitter 0.3, for the paper's example, our own
products and the LDraw products, with the independent monitor beside every run.

What must hold: it refines the net every time, nothing touches that should not, product error at
most 0.1 mm, hand-off gap at most 0.2 mm, cycle time within 1 %
of the predicted one, nothing that is drawn more than 0.1 mm inside anything, pads within 0.5 mm of
what they take, and every hand within its strength.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from benches.tables import table
from factory.apps.fidelity import measure as compared
from factory.engine.mjcf.insets import insets_of
from factory.support.settings import Settings

from .products import PAPER, REAL, is_here, layout

JITTER = 0.3

LIMITS = {
    "illegal_records": 0.0,
    "monitor_violations": 0.0,
    "unintended_contacts": 0.0,
    "engine_warnings": 0.0,
    "product_error_max_mm": 0.1,
    "handoff_gap_max_mm": 0.2,
    "cycle_from_predicted_percent": 1.0,
    "hidden_penetration_max_mm": 0.1,
    "grip_gap_max_mm": 0.5,
    "grip_strength_share_max": 1.0,
}
"""The largest value of a figure, by size, that is accepted."""


ALSO = (
    "weld_residual_max_mm",
    "tracking_error_max_mm",
    "force_saturated_percent",
    "product_angle_max_deg",
)
"""Further figures of the table."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A product, how many seeds, and how many units where the net does not choose them: what it
    takes to see the cycle time."""

    product: str
    seeds: int = 4
    units: int | None = None


PLANS = (
    Plan(PAPER, 20),
    *(Plan(name) for name in (*REAL, "chest")),
    Plan("30023-1-Lighthouse"),
    Plan("889-1-RadarTruck"),
    Plan("6966-1-JediStarfighter-Mini", 2),
    Plan("4494-1-Imperial_Shuttle-Mini", 2),
)
"""So many that all take about six minutes. (203 bricks alone take as long.)"""

QUICK = (Plan(PAPER, 2), Plan("gearbox", 1, 2))


def measured(plan: Plan) -> dict[str, Any]:
    """The worst figures of one product, and how many seeds passed."""
    found = compared(
        layout(plan.product), range(plan.seeds), plan.units, JITTER, jobs=os.cpu_count() or 1
    )
    worst = {key: found.worst()[key] for key in (*LIMITS, *ALSO)}
    return {
        "product": plan.product,
        "robots": found.robots,
        "seeds": plan.seeds,
        "units": found.units,
        "passed": sum(record.passed for record in found.seeds),
        "worst": worst,
        "excluded": len(insets_of(layout(plan.product), Settings().overlap).excluded),
        "troubles": [str(t) for record in found.seeds for t in record.trouble][:5],
        "contacts": sorted({c for record in found.seeds for c in record.contacts})[:5],
        "missed": [key for key, most in LIMITS.items() if abs(worst[key] or 0.0) > most],
    }


def measure(
    quick: bool = False, only: Sequence[str] = (), kept: Mapping[str, Any] | None = None
) -> Iterator[dict[str, Any]]:
    """Product after product, with all that is known by then; with `only`, these products, and the
    others as they were `kept`."""
    products = [p for p in (kept or {}).get("products", []) if p["product"] not in only]
    order = [(plan.product, plan.seeds) for plan in PLANS]
    for plan in QUICK if quick else PLANS:
        if is_here(plan.product) and (not only or plan.product in only):
            products.append({**measured(plan), "date": datetime.now(UTC).strftime("%Y-%m-%d")})
            if not quick:
                products.sort(key=lambda p: order.index((p["product"], p["seeds"])))
            yield {"jitter": JITTER, "products": products}


def section(results: dict[str, Any]) -> str:
    """The report: what was asked for, and the rest."""
    products = results["products"]
    asked = [
        (
            p["product"],
            p["robots"],
            p["seeds"],
            p["units"],
            f"{p['passed']} of {p['seeds']}",
            *(p["worst"].get(key) for key in LIMITS),
            "; ".join([*p["missed"], *p["troubles"], *p["contacts"]]) or "all hold",
            p["date"],
        )
        for p in products
    ]
    rest = [(p["product"], p["excluded"], *(p["worst"][key] for key in ALSO)) for p in products]
    limits = ", ".join(f"`{key}` {most:g}" for key, most in LIMITS.items())
    return "\n\n".join(
        [
            "## Over the seeds",
            f"Both worlds over the same seeds at jitter {results['jitter']:g}: every robot with a"
            " speed and a gain of its own within 30 %. Contact is on for all parts but the excluded"
            " pairs. The worst of all seeds; a seed passes if both records are runs of the net, the"
            " monitor, which sees the engine alone, explains the run, and nothing touches. Limits:"
            f" {limits}. What each figure means is listed by `factory fidelity --json`.",
            table(
                (
                    "product",
                    "robots",
                    "seeds",
                    "units",
                    "passed",
                    *(key.replace("_", " ") for key in LIMITS),
                    "limits",
                    "measured",
                ),
                asked,
            ),
            table(
                ("product", "pairs excluded", *(key.replace("_", " ") for key in ALSO)),
                rest,
            ),
        ]
    )
