"""Cycle times over many seeds of products that take too long to be watched for so many units: the
physical run alone, by `factory sweep`, against the time that the net predicts before it.

The other figures of the same seeds are those of `seeds`, over one unit.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from benches.fidelity.products import PAPER, file_of, is_here
from benches.fidelity.seeds import JITTER, LIMITS
from benches.tables import table

PLANS = (("5935-1-IslandHopper", 50, 4),)
"""Products, seeds, and units of each: so many that the last come in the pace of the factory."""

QUICK = ((PAPER, 2, 6),)

COLUMNS = {
    "robots": "max(robots)",
    "seeds": "count(*)",
    "units": "min(products)",
    "done": "sum(status = 'done')",
    "refines_net": "sum(refines_net)",
    "cycle_least_s": "min(cycle_time_s)",
    "cycle_most_s": "max(cycle_time_s)",
    "off_least_percent": "min(100 * (cycle_time_s / predicted_cycle_time_s - 1))",
    "off_most_percent": "max(100 * (cycle_time_s / predicted_cycle_time_s - 1))",
    "handoff_gap_max_mm": "max(handoff_gap_max_mm)",
    "product_error_max_mm": "max(product_error_max_mm)",
    "unintended_contacts": "sum(unintended_contacts)",
}
"""Figures of a sweep, as its database tells them."""

LIMIT = LIMITS["cycle_from_predicted_percent"]


def swept(product: str, seeds: int, units: int, database: Path) -> None:
    """Run what is not in the database yet."""
    vary = ("--vary", f"seed=0:{seeds}", "--jitter", f"{JITTER:g}", "--units", str(units))
    files = (str(file_of(product)), "-o", str(database))
    jobs = ("--jobs", str(os.cpu_count() or 1), "--quiet")
    subprocess.run([sys.executable, "-m", "factory", "sweep", *files, *vary, *jobs], check=True)


def figures(product: str, database: Path) -> dict[str, Any]:
    """Of all runs in a database."""
    query = f"select {', '.join(COLUMNS.values())} from runs"
    with closing(sqlite3.connect(database)) as connection:
        row = connection.execute(query).fetchone()
    return {"product": product, **dict(zip(COLUMNS, row, strict=True))}


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Product after product, with all that is known by then."""
    found: list[dict[str, Any]] = []
    for product, seeds, units in QUICK if quick else PLANS:
        if is_here(product):
            with tempfile.TemporaryDirectory() as folder:
                database = Path(folder) / "paces.db"
                swept(product, seeds, units, database)
                found.append(figures(product, database))
            yield {"jitter": JITTER, "products": found}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = [
        (
            *(p[key] for key in ("product", "robots", "seeds", "units")),
            f"{p['refines_net']} of {p['seeds']}",
            f"{p['cycle_least_s']:.2f} to {p['cycle_most_s']:.2f}",
            f"{p['off_least_percent']:+.3f} to {p['off_most_percent']:+.3f}",
            *(p[key] for key in ("handoff_gap_max_mm", "product_error_max_mm")),
            p["unintended_contacts"],
        )
        for p in results["products"]
    ]
    return "\n\n".join(
        [
            "## Paces",
            "The cycle times of a product that takes too long for both worlds with so many units"
            f" and seeds: jitter {results['jitter']:g}, the physical run alone, by `factory sweep`."
            " The prediction is made from the net before each run, with the speeds that are drawn"
            f" for it; at most {LIMIT:g} % is accepted.",
            table(
                (
                    *("product", "robots", "seeds", "units", "refine the net", "cycle times [s]"),
                    *("from predicted [%]", "hand-off gap [mm]", "product error [mm]"),
                    "unintended contacts",
                ),
                rows,
            ),
        ]
    )
