"""Sweeps of many short runs, on one core and on two."""

from __future__ import annotations

import json
import os
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from benches.speed.processes import FACTORY, ROOT, interleaved, median, ratio, run, spread
from benches.tables import table

RUNS, JOBS = 120, (1, 2)

AIM, OVERHEAD = 1.8, 10.0
"""Times one core's rate; percent of a run's time."""


def swept(runs: int, jobs: int) -> dict[str, Any]:
    """One sweep, a whole process."""
    with tempfile.TemporaryDirectory() as folder:
        vary = ("--vary", f"seed=0:{runs}", "--jitter", "0.3")
        where = ("--jobs", jobs, "-o", Path(folder) / "sweep.db", "--json", "-q")
        process = run([*FACTORY, "sweep", ROOT / "examples" / "paper.pag", *vary, *where])
    said = json.loads(process.text)
    return {
        "runs_per_s": float(said["runs_per_s"]),
        "overhead_percent": float(said["overhead_percent"]),
        "process_s": process.seconds,
    }


def measure(quick: bool = False) -> dict[str, Any]:
    """Both, in turns."""
    runs = 20 if quick else RUNS
    found = interleaved([partial(swept, runs, jobs) for jobs in JOBS], 1 if quick else 2)
    one, two = found
    return {
        "runs": runs,
        "times": len(one),
        "cores": os.cpu_count(),
        "rows": [
            {"jobs": jobs, **median(own), "spread": spread(own, "runs_per_s")}
            for jobs, own in zip(JOBS, found, strict=True)
        ],
        "ratio": ratio(two, one, "runs_per_s"),
    }


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = [
        (
            row["jobs"],
            f"{row['runs_per_s']:.2f} ({row['spread']})",
            f"{row['overhead_percent']:.1f} %",
            f"{row['process_s']:.1f} s",
        )
        for row in results["rows"]
    ]
    return "\n\n".join(
        [
            "## Sweeps",
            f"`factory sweep examples/paper.pag --vary seed=0:{results['runs']} --jitter 0.3 --jobs"
            " N`: in MuJoCo at 2 ms, contact between payloads on, one body per part, 4 units a run"
            " from the empty factory on. Overhead is what a run costs besides simulating (aim:"
            f" < {OVERHEAD:g} %), as the sweep itself counts it. Median (least–greatest) of"
            f" {results['times']}, in turns, on {results['cores']} cores.",
            table(("jobs", "runs a second", "overhead per run", "whole process"), rows),
            f"Two jobs make **{results['ratio']:.2f}** times the runs of one (aim: >= {AIM:g}).",
        ]
    )
