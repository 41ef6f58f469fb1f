"""Many units of the paper's example in which joints fail and parts are lost, beside what a timed
net with the same failures predicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from random import Random
from statistics import mean
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

UNITS, RUNS = 2000, 8
"""Units of each run, and runs of the timed net, of which the mean is told."""

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


def struck_at(failed: Sequence[tuple[int, int, Sequence[str]]]) -> Chance:
    """The mishaps of a run: those attempts fail that failed there."""
    planned = {(number, attempt): Mishap((*lost,)) for number, attempt, lost in failed}
    tried = Counter[int]()

    def chance(operation: Operation, _: int) -> Mishap | None:
        tried[operation.index] += 1
        return planned.get((operation.index, tried[operation.index] - 1))

    return chance


def predicted(world: WorldName, clear: float, units: int, chances: Sequence[Chance]) -> float:
    """The mean interval between products that the timed net predicts [s], over some runs of it."""
    made = project("paper")
    timing = Timing(made.layout, made.settings, world, 0, JITTER)
    subject = failing_net(timing, timed_net(timing), clear)
    runs = [failing_run(subject, chance, units).dates for chance in chances]
    return mean((dates[-1] - dates[0]) / (len(dates) - 1) for dates in runs)


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Make them in both worlds, and predict each."""
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
            tells=True,
        )
        for world, clear in ROWS
    ]
    for rows in tried_so_far(trials, kept):
        for row in rows:
            if left := row.pop("dropoffs", None):
                row["interval_s"] = (left[-1] - left[0]) / (len(left) - 1)
                what = row["world"], float(row["about"]), units
                draws = [struck_alike(seed) for seed in range(1, RUNS + 1)]
                row["with_failures_s"] = predicted(*what, draws)
                row["same_failures_s"] = predicted(*what, [struck_at(row.pop("failed"))])
        yield {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = sorted(results["rows"], key=lambda row: (row["world"], float(row["about"])))
    head = ("world", "cleared after [s]", "units made", "operations", "struck", "undone", "missed")
    more = ("false alarms", "contacts", "error [mm]", "without failures [s]", "interval [s]")
    last = ("predicted [s]", "off by", "for these [s]", "off by")
    return "\n\n".join(
        [
            "## Production with failures",
            f"The paper's example, jitter {JITTER:g}: {100 * REDONE:g} % of the joints of two"
            f" inputs slip, {100 * LOST:g} % of all that robots carry is dropped, at each"
            " operation. *Predicted*: by a timed net in which the same happens at the same rates,"
            " and the same robots stand while things lie (`factory/timing/failing.py`), the mean"
            f" of {RUNS} runs of it; *for these*: where the attempts fail that failed in the run.",
            table(
                (*head, *more, *last, "all as it should be"),
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
                        _off(row, "with_failures_s"),
                        f"{row['same_failures_s']:.3f}",
                        _off(row, "same_failures_s"),
                        is_good(row),
                    )
                    for row in rows
                ],
            ),
        ]
    )


def _off(row: dict[str, Any], key: str) -> str:
    return f"{100 * (row['interval_s'] / row[key] - 1):+.1f} %"
