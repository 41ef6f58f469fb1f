"""Runs of real products."""

from __future__ import annotations

import json
from typing import Any

from benches.fidelity.products import BRICKS, EXAMPLES
from benches.speed.processes import FACTORY, run
from benches.tables import table

UNITS = {"paper": 20, "lamp": 10, "stool": 10, "shelf": 10, "balanced": 10}
"""Units of each example."""

LARGE = 12_000
"""Size of a PAG of which one unit is enough [bytes]."""


def measure(quick: bool = False) -> dict[str, Any]:
    """One run of each."""
    wanted = [(EXAMPLES / f"{name}.pag", units) for name, units in UNITS.items()]
    wanted += [(p, 1 if p.stat().st_size > LARGE else 2) for p in sorted(BRICKS.glob("*.pag"))]
    rows = []
    for file, units in wanted[:1] if quick else wanted:
        said = json.loads(run([*FACTORY, "run", file, "--units", units, "--json", "-q"]).text)
        rows.append({"product": file.stem, "units": units, "run": said})
        print(".", end="", flush=True)
    print()
    keys = (
        *("robots", "cycle_time_s", "predicted_cycle_time_s", "realtime_factor"),
        *("supervisor_time_s", "wall_time_s", "handoff_gap_max_mm", "product_error_max_mm"),
        *("unintended_contacts", "fused"),
    )
    return {"rows": [{**row, "run": {key: row["run"][key] for key in keys}} for row in rows]}


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("product", "robots", "bodies", "units", "cycle [s]", "predicted [s]", "times real time"),
        *("supervisor", "gap [mm]", "product error [mm]", "contacts"),
    )
    rows = []
    for row in results["rows"]:
        found = row["run"]
        cycle = found["cycle_time_s"]
        rows.append(
            (
                row["product"],
                found["robots"],
                "fused" if found["fused"] else "one a part",
                row["units"],
                None if cycle is None else f"{cycle:.3f}",
                f"{found['predicted_cycle_time_s']:.3f}",
                f"{found['realtime_factor']:.1f}",
                f"{100 * found['supervisor_time_s'] / found['wall_time_s']:.0f} %",
                f"{found['handoff_gap_max_mm']:.3f}",
                f"{found['product_error_max_mm']:.4f}",
                found["unintended_contacts"],
            )
        )
    return "\n\n".join(
        [
            "## Products",
            "`factory run`, once each, from the empty factory until the last unit is delivered: no"
            " steady window. MuJoCo at the timestep that `run` chooses, contact between payloads"
            " on, bodies as `run` chooses, a pool for the units asked for, jitter 0.",
            table(head, rows),
        ]
    )
