"""Misses and false alarms in all the runs of the sections before, and with worse sensors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from benches.faults.production import FAULTS
from benches.faults.trials import JITTER, Trial, all_tried
from benches.reporting import DOCS
from benches.tables import table
from factory.apps.deviations import Sensors

BEFORE = {
    "campaigns": "each kind of fault",
    "deaths": "each robot dies",
    "production": "production with failures",
}
TIMES, UNITS = (2, 3, 4, 6), 50
"""So many times the usual noise, in runs of so many units."""


def measure(quick: bool = False) -> dict[str, Any]:
    """Add up what is kept of MuJoCo, and make noise."""
    rows = []
    for name, words in BEFORE.items():
        file = DOCS / "faults" / f"{name}.json"
        kept = json.loads(file.read_text())["results"]["rows"] if file.is_file() else []
        if runs := [row for row in kept if row["world"] == "mujoco"]:
            rows.append(_added(words, 1, runs))
    trials = [
        Trial(
            "paper",
            FAULTS,
            10 if quick else UNITS,
            about=str(n),
            clear=0.0,
            noise=n * Sensors().noise,
            max_time=1e5,
        )
        for n in TIMES
    ]
    for run in sorted(all_tried(trials), key=lambda run: int(run["about"])):
        rows.append(_added("production with failures", int(run["about"]), [run]))
    return {"rows": rows}


def _added(words: str, times: int, runs: list[Mapping[str, Any]]) -> dict[str, Any]:
    keys = ("operations", "struck", "found", "missed", "false_alarms")
    sums = {key: sum(run[key] for run in runs) for key in keys}
    return {"what": words, "times": times, "runs": len(runs), **sums}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = results["rows"]
    usual = [row for row in rows if row["times"] == 1]
    every = {
        key: sum(row[key] for row in usual) for key in usual[0] if key not in ("what", "times")
    }
    shown = [*usual, {"what": "**all at the usual noise**", "times": 1, **every}]
    head = ("runs of", "noise [µm]", "runs", "operations", "struck", "found")
    more = ("missed", "false alarms", "missed per 1,000 operations", "false alarms per 1,000")
    noise = Sensors().noise * 1e6
    return "\n\n".join(
        [
            "## Sensors",
            "Faults that no test told of, and failures that nothing caused, in the runs in MuJoCo"
            " of the sections above; then with more noise than is usual, in the paper's example as"
            f" in the production above (jitter {JITTER:g}), so that it is seen what noise does."
            " They are counted by kind in each run, so a miss and a false alarm of the same test in"
            " one run would hide each other. *Found* has no blackouts, robots that stand for a"
            " while or empty feeders, for which nothing looks, and more than one failure for one"
            " fault where something that fell knocks against others, or where a robot that is dead"
            " was to go back first.",
            table(
                (*head, *more),
                [
                    (
                        row["what"],
                        f"{row['times'] * noise:g}",
                        row["runs"],
                        row["operations"],
                        row["struck"],
                        row["found"],
                        row["missed"],
                        row["false_alarms"],
                        1000 * row["missed"] / row["operations"],
                        1000 * row["false_alarms"] / row["operations"],
                    )
                    for row in (*shown, *(row for row in rows if row["times"] > 1))
                ],
            ),
        ]
    )
