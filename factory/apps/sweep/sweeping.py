"""A sweep: run the points that its database lacks, and write every outcome as it comes."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from factory.api import InputError
from factory.apps.sweep.grid import GridAxis, Point, check_value, points
from factory.apps.sweep.recipe import Recipe, name_of
from factory.apps.sweep.store import Store
from factory.apps.sweep.work import Outcome, Runner, failed
from factory.apps.sweep.workers import over_workers
from factory.support.interruption import Interruption
from factory.support.progress import StepBar

Outcomes = Generator[Outcome, None, None]

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables set to 1 for the processes, of which there is one for each core."""


@dataclass(slots=True)
class Tally:
    """Counts of a sweep: `runs` in its grid, those already `there`, how many of these had failed,
    runs done and failed now; the wall time, the sum of the workers' times, and that of their run
    loops [s]."""

    runs: int
    there: int
    there_failed: int = 0
    done: int = 0
    failed: int = 0
    wall_time_s: float = 0.0
    rows_time_s: float = 0.0
    loops_time_s: float = 0.0

    @property
    def overhead(self) -> float | None:
        """Share of the workers' time outside run loops."""
        return 1 - self.loops_time_s / self.rows_time_s if self.rows_time_s else None

    @property
    def rate(self) -> float:
        """Runs per second, from the start of the first worker."""
        return (self.done + self.failed) / self.wall_time_s if self.wall_time_s else 0.0

    def __str__(self) -> str:
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.rate:.1f} runs/s{failed}"

    def as_json(self) -> dict[str, Any]:
        """The figures, with the rate and the overhead."""
        overhead = self.overhead
        return {
            "runs": self.runs,
            "there": self.there,
            "there_failed": self.there_failed,
            "done": self.done,
            "failed": self.failed,
            "wall_time_s": self.wall_time_s,
            "runs_per_s": self.rate,
            "loops_time_s": self.loops_time_s,
            "rows_time_s": self.rows_time_s,
            "overhead_percent": None if overhead is None else 100 * overhead,
        }

    def count(self, outcome: Outcome) -> None:
        """Count an outcome."""
        self.done += not outcome.reason
        self.failed += bool(outcome.reason)
        loop = outcome.figures.get("wall_time_s")
        if loop is not None:
            self.rows_time_s += outcome.row_time_s
            self.loops_time_s += loop


def sweep(
    recipe: Recipe,
    axes: Sequence[GridAxis],
    database: Path,
    jobs: int = 1,
    retry: bool = False,
    quiet: bool = True,
    on: str | None = None,
) -> Tally:
    """Run every point of a grid without a row in the database; with `retry`, also those that
    failed, in `jobs` processes or `on` the Dask scheduler at an address.

    After KeyboardInterrupt, or if this process is killed, all rows stay, and the same call resumes.
    Raises InputError if a fixed value is out of range (BadValue), or if the database holds another
    sweep or is damaged (BadFile).
    """
    fixed = recipe.at(()).items()
    faults = [fault for key, value in fixed if (fault := check_value(key, value))]
    if faults:
        raise InputError(faults)
    grid = {name_of(point): point for point in points(axes)}
    with Store(database, recipe.identity(axes)) as store:
        failures = set() if retry else store.points("failed")
        there = store.points("done") | failures
        wanted = [point for name, point in grid.items() if name not in there]
        tally = Tally(len(grid), len(grid) - len(wanted), len(grid.keys() & failures))
        if not wanted:
            return tally
        begin = perf_counter()
        with (
            StepBar("running", quiet) as bar,
            closing(outcomes_of(recipe, wanted, jobs, on)) as outcomes,
        ):
            for outcome in outcomes:
                with Interruption() as interruption:
                    store.add(outcome, recipe.at(outcome.point))
                tally.count(outcome)
                tally.wall_time_s = perf_counter() - begin
                bar.show("running", tally.there + tally.done + tally.failed, len(grid), f"{tally}")
                interruption.observe()
    return tally


def outcomes_of(
    recipe: Recipe, points: Sequence[Point], jobs: int, on: str | None = None
) -> Outcomes:
    """The outcomes of all points as they come, from `jobs` processes, or `on` a scheduler. Closing
    the iterator ends the work. Raises RunError if processes die as they start, or the scheduler is
    lost."""
    variables = dict.fromkeys(THREADS, "1")
    with closing(over_workers(Runner(recipe), points, jobs, variables, on)) as done:
        for run in done:
            if run.result is None:
                status = f" (exit status {run.status})" if run.status is not None else ""
                reason = f"Killed the process died in {run.tries} tries{status}"
                yield failed(points[run.number], reason, run.tries)
            else:
                yield replace(run.result, tries=run.tries)
