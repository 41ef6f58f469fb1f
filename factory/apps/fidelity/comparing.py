"""Comparison of the two worlds over the same seeds, in one process or several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import chain
from statistics import fmean

from factory.api import (
    Diagnostic,
    Factory,
    Layout,
    Model,
    Run,
    RunError,
    RunRequest,
    Settings,
    Simulation,
    Timing,
)
from factory.apps.analyze.measured import operation_times
from factory.apps.analyze.timed import steady_units
from factory.apps.fidelity.measuring import Measurement
from factory.apps.fidelity.record import QUANTITIES, Fidelity, SeedRecord
from factory.apps.sweep.workers import over_workers
from factory.support.engine import mujoco

WORST = 10
"""Number of penetrations that are listed for each seed."""

Alter = Callable[[mujoco.MjModel], None]
"""A change of the engine's model before a run."""


@dataclass(frozen=True)
class Case:
    """A layout and the conditions of its runs. Without `units` each seed makes as many as its net
    needs to show its cycle time. `alter` must be picklable where several processes are used."""

    layout: Layout
    units: int | None = None
    jitter: float = 0.3
    settings: Settings = field(default_factory=Settings)
    max_time: float | None = None
    alter: Alter | None = None


def measure(
    layout: Layout,
    seeds: Sequence[int] = range(5),
    units: int | None = None,
    jitter: float = 0.3,
    settings: Settings | None = None,
    jobs: int = 1,
    done: Callable[[int], None] | None = None,
    max_time: float | None = None,
    on: str | None = None,
) -> Fidelity:
    """Compare the worlds over `seeds`. With `jobs` > 1 so many processes share the seeds (a script
    then needs `if __name__ == "__main__"`), or the workers of a Dask scheduler whose address is
    given (`on`); the figures are the same. `done` is called with the number of finished seeds."""
    case = Case(layout, units, jitter, settings or Settings(), max_time)
    records = over_cases([(case, seed) for seed in seeds], jobs, done, on)
    factory = layout.factory
    return Fidelity(Model.product_name(factory), len(factory.robots), jitter, tuple(records))


def over_cases(
    work: Sequence[tuple[Case, int]],
    jobs: int = 1,
    done: Callable[[int], None] | None = None,
    on: str | None = None,
) -> list[SeedRecord]:
    """`measure_seed` of every case and seed, in their order."""
    records: dict[int, SeedRecord] = {}
    for number, record in _worked(work, jobs, on):
        records[number] = record
        if done is not None:
            done(len(records))
    return [records[number] for number in range(len(work))]


def _worked(
    work: Sequence[tuple[Case, int]], jobs: int, on: str | None
) -> Iterator[tuple[int, SeedRecord]]:
    if on is None and min(jobs, len(work)) <= 1:
        for number, (case, seed) in enumerate(work):
            yield number, measure_seed(case, seed)
        return
    with closing(over_workers(_measured, work, jobs, on=on)) as results:
        for worked in results:
            if worked.result is None:
                seed = work[worked.number][1]
                message = f"the process of seed {seed} died in all {worked.tries} tries"
                hint = "use fewer --jobs, or more memory"
                raise RunError(Diagnostic("Killed", message, None, hint))
            yield worked.number, worked.result


def _measured(item: tuple[Case, int]) -> SeedRecord:
    return measure_seed(*item)


def measure_seed(case: Case, seed: int) -> SeedRecord:
    """Run one seed in both worlds and measure it."""
    layout = case.layout
    units = case.units or steady_units(Timing(layout, case.settings, "mujoco", seed, case.jitter))
    request = RunRequest("mujoco", units, seed, case.jitter, case.settings)
    physical = Simulation(layout, request)
    ideal = Simulation(layout, replace(request, world="ideal"))
    if case.alter is not None:
        case.alter(physical.physical.m)
    measurement = Measurement(physical)
    ideal_run, run = ideal.run(max_time=case.max_time), measurement.run(case.max_time)
    figures = _compared(layout.factory, ideal_run, run) | measurement.figures()
    return SeedRecord(
        seed,
        run.units,
        {key: figures.get(key) for key in QUANTITIES},
        measurement.hidden.found()[:WORST],
        run.physics.contacts if run.physics else (),
        (*ideal_run.verdict.failures, *run.verdict.failures),
    )


def _compared(factory: Factory, ideal: Run, run: Run) -> dict[str, float | None]:
    """The figures that need both runs."""
    return {
        "illegal_records": (not ideal.refines_net) + (not run.refines_net),
        "monitor_violations": len(run.monitor.violations) if run.monitor else None,
        "cycle_time_s": run.cycle_time_s,
        "cycle_from_ideal_percent": _over(run.cycle_time_s, ideal.cycle_time_s),
        "cycle_from_predicted_percent": _over(run.cycle_time_s, run.predicted_cycle_time_s),
        "duration_difference_mean_s": _later(factory, ideal, run),
    }


def _later(factory: Factory, ideal: Run, physical: Run) -> float | None:
    """Mean duration of operations in the second run less that in the first [s]. The n-th time of an
    operation is compared with the n-th; None if no operation ends in both."""
    number = factory.net.threaded.net.transition_index
    one, other = (
        operation_times(factory, ((number[e.transition], e.t) for e in run.lasting))
        for run in (ideal, physical)
    )
    both = chain(*(zip(*times, strict=False) for times in zip(one, other, strict=True)))
    pairs = [late - early for early, late in both]
    return fmean(pairs) if pairs else None


def _over(value: float | None, reference: float | None) -> float | None:
    """Relative excess of a value over a reference [%]."""
    return None if value is None or not reference else 100 * (value / reference - 1)
