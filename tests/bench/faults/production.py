"""Many units of the paper's example in which joints fail and parts are lost, beside what a timed
net with the same failures predicts."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Any

from factory.plant.factory import Operation
from factory.problem.pag import NOPART
from factory.simulation.recovery import WorldFault
from factory.simulation.request import WorldName
from factory.study.analysis.failing import failing_net
from factory.study.analysis.timed import timed_net
from factory.study.analysis.timing import Timing
from factory.timing.failing import Chance, Mishap, failing_run
from tests.bench.faults.trials import JITTER, Kept, Trial, is_good, project, tried_so_far
from tests.tables import table

UNITS = 2000
REDONE, LOST = 0.05, 0.01
FAULTS = WorldFault("bad_joint", rate=REDONE), WorldFault("drop", rate=LOST)
ROWS: tuple[tuple[WorldName, float], ...] = (("ideal", 0.0), ("mujoco", 0.0), ("mujoco", 10.0))
"""The world, and how long what has fallen lies until it is taken away [s]."""


def struck_alike(seed: int) -> Chance:
    """Mishaps as the faults strike: a joint of several inputs is bad, a robot drops what it
    carries."""
    draw = Random(seed)

    def chance(operation: Operation, _: int) -> Mishap | None:
        for label in operation.before:
            if label != NOPART and draw.random() < LOST:
                return Mishap((label,))
        return Mishap() if len(operation.inputs) > 1 and draw.random() < REDONE else None

    return chance


def predicted(world: WorldName, units: int) -> float:
    """The mean interval between products that the timed net predicts [s]."""
    made = project("paper")
    timing = Timing(made.layout, made.settings, world, 0, JITTER)
    dates = failing_run(failing_net(timing, timed_net(timing)), struck_alike(1), units).dates
    return (dates[-1] - dates[0]) / (len(dates) - 1)


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Make them in both worlds, and predict each."""
    units = 50 if quick else UNITS
    trials = [
        Trial("paper", FAULTS, units, clear=clear, about=f"{clear:g}", world=world, max_time=1e5)
        for world, clear in ROWS
    ]
    for rows in tried_so_far(trials, kept):
        for row in rows:
            if left := row.pop("dropoffs", None):
                row["interval_s"] = (left[-1] - left[0]) / (len(left) - 1)
                row["with_failures_s"] = predicted(row["world"], units)
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
            " operation. *Predicted*: by a timed net in which the same happens, and things are gone"
            " as they fall (`factory/timing/failing.py`); it does not know of robots that stand"
            " while what fell lies in their way, so its prediction is for 0 s.",
            table(
                (*head, *more, "predicted [s]", "off by", "all as it should be"),
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
                        f"{row['with_failures_s']:.3f}",
                        f"{100 * (row['interval_s'] / row['with_failures_s'] - 1):+.1f} %",
                        is_good(row),
                    )
                    for row in rows
                ],
            ),
        ]
    )
