"""Many units of the paper's example in which joints fail and parts are lost, in both worlds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from benches.faults.trials import JITTER, Kept, Trial, is_good, tried_so_far
from benches.tables import table
from factory.apps.deviations import Deviation
from factory.engine.simulation.request import WorldName

UNITS = 300
"""Units of each run."""

REDONE, LOST = 0.05, 0.01
FAULTS = Deviation("bad_joint", rate=REDONE), Deviation("drop", rate=LOST)
ROWS: tuple[tuple[WorldName, float], ...] = (("ideal", 0.0), ("mujoco", 0.0), ("mujoco", 10.0))
"""The world, and how long what has fallen lies until it is taken away [s]."""


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Make them in both worlds."""
    units = 50 if quick else UNITS
    trials = [
        Trial(
            "paper",
            FAULTS,
            units,
            clear=clear,
            about=f"{clear:g}",
            world=world,
            max_time=1e5,
        )
        for world, clear in ROWS
    ]
    for rows in tried_so_far(trials, kept):
        for row in rows:
            if left := row.pop("dropoffs", None):
                row["interval_s"] = (left[-1] - left[0]) / (len(left) - 1)
        yield {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = sorted(results["rows"], key=lambda row: (row["world"], float(row["about"])))
    head = ("world", "cleared after [s]", "units made", "operations", "struck", "undone", "missed")
    more = ("false alarms", "contacts", "error [mm]", "without failures [s]", "interval [s]")
    return "\n\n".join(
        [
            "## Production with failures",
            f"The paper's example, jitter {JITTER:g}: {100 * REDONE:g} % of the joints of two"
            f" inputs slip, {100 * LOST:g} % of all that robots carry is dropped, at each"
            " operation. The ideal world has the same faults, and nothing that lies about.",
            table(
                (*head, *more, "passed"),
                [
                    (
                        {"ideal": "ideal", "mujoco": "MuJoCo"}[row["world"]],
                        row["about"],
                        f"{row['made']} of {row['asked']}",
                        row["operations"],
                        row["struck"],
                        row["undone"],
                        row["missed"],
                        row["false_alarms"],
                        row["contacts"],
                        row["error_mm"],
                        f"{row['predicted_s']:.3f}",
                        f"{row['interval_s']:.3f}",
                        is_good(row),
                    )
                    for row in rows
                ],
            ),
        ]
    )
