"""How fast factories run in steady production."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from time import perf_counter
from typing import Any, Literal

from factory.simulation.simulation import Simulation
from factory.support.settings import AUTO
from tests.bench.factories import (
    PATIENCE,
    Case,
    Steady,
    laid_out,
    robots_at_least,
    run_in,
    run_until,
)
from tests.bench.processes import fresh, interleaved, median, resident, serve, spread
from tests.tables import table

AIMS: Sequence[tuple[Case, float, float]] = (
    (Case(40, 0.002), 20.0, 10.0),
    (Case(40, 0.002, None, True), 20.0, 10.0),
    (Case(40, AUTO, None, True), 50.0, 25.0),
    (Case(300, 0.004), 3.5, 5.0),
    (Case(300, 0.002, None, True), 6.0, 5.0),
    (Case(300, AUTO, None, True), 18.0, 15.0),
    (Case(1000, 0.004, 2), 0.7, 5.0),
    (Case(1000, 0.002, 2, True), 2.0, 5.0),
    (Case(1000, AUTO, 2, True), 6.0, 15.0),
)
"""What is measured, with the least multiple of real time and the greatest share of the supervisor
in percent that are aimed at."""

LEAST = 10.0
"""Simulated at least [s], and at least one cycle."""

RUNS = 5
"""Processes a case: what a machine's other tenants do to a share shows in single ones."""

MEMORY = 1500.0
"""The largest resident set aimed at, with 1,000 robots [MB]."""


class Upkeep:
    """Counts the `seconds` that a world spends on its engine beside stepping it: choosing what the
    broad phase looks at, keeping a state to go back to, and measuring residuals."""

    def __init__(self, world: Any) -> None:
        self.seconds = 0.0
        for holder, name in (
            (world.vicinity, "look"),
            (world.vicinity, "notice"),
            (world.vicinity, "holds"),
            (world._begin, "save"),
            (world.inspection, "welds"),
        ):
            setattr(holder, name, self._timed(getattr(holder, name)))

    def _timed(self, act: Callable[[], Any]) -> Callable[[], Any]:
        def timed() -> Any:
            begin = perf_counter()
            found = act()
            self.seconds += perf_counter() - begin
            return found

        return timed


def work(
    robots: int,
    timestep: float | Literal["auto"],
    wip: int | None = None,
    fuse: bool = False,
    window: float | None = None,
) -> dict[str, Any]:
    """One run of a factory, warmed up, over a window [s]; None: one cycle, and at least LEAST. What
    is the supervisor's own is measured over another after it: clocks in a loop of 0.3 ms count."""
    case = Case(robots, timestep, wip, fuse)
    layout = laid_out(robots_at_least(robots))
    steady = Steady.of(layout, wip)
    span = max(LEAST, steady.cycle) if window is None else window
    simulation = case.simulation(layout)
    world = simulation.world
    run_in(simulation, steady)
    start, made = world.time, world.delivered()
    wall, engine = timed(simulation, span)
    simulated, made = world.time - start, world.delivered() - made
    upkeep = Upkeep(world)
    again, physics = timed(simulation, span)
    return {
        "robots": len(layout.factory.robots),
        "bodies": world.model.bodies,
        "from_s": start,
        "to_s": start + simulated,
        "cycle_s": steady.cycle,
        "made": made,
        "realtime": simulated / wall,
        "supervisor_percent": 100 * (wall - engine) / wall,
        "own_percent": 100 * (again - physics - upkeep.seconds) / again,
        "timestep_s": simulation.settings.step,
        "step_us": 1e6 * engine / (simulated / simulation.settings.step),
        "memory_MB": resident(),
    }


def timed(simulation: Simulation, span: float) -> tuple[float, float]:
    """Run for so long [s]; gives the wall time, and the engine's part of it [s]."""
    world = simulation.world
    until, physics, begin = world.time + span, world.physics_time, perf_counter()
    run_until(simulation, until)
    return perf_counter() - begin, world.physics_time - physics


def measure(quick: bool = False) -> dict[str, Any]:
    """Every case, in turns."""
    cases = AIMS[:1] if quick else AIMS
    window = 1.0 if quick else None
    jobs = [partial(fresh, work, **asdict(case), window=window) for case, *_ in cases]
    found = interleaved(jobs, 2 if quick else RUNS)
    return {
        "runs": len(found[0]),
        "rows": [
            {
                **asdict(case),
                "aim": aim,
                "share": share,
                "found": median(own),
                "spread": spread(own, "realtime"),
            }
            for (case, aim, share), own in zip(cases, found, strict=True)
        ],
    }


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("robots", "timestep", "bodies", "pool", "contact", "window", "times real time", "aim"),
        *("supervisor", "aim", "its own", "engine's step", "memory"),
    )
    rows = []
    for row in results["rows"]:
        found = row["found"]
        wip, kind = row["wip"], "fused" if row["fuse"] else "one a part"
        rows.append(
            (
                found["robots"],
                _timestep(row["timestep"], found),
                f"{found['bodies']}, {kind}",
                "whole" if wip is None else f"`--wip {wip}`",
                "on",
                f"{found['from_s']:.1f}–{found['to_s']:.1f} s",
                f"**{found['realtime']:.2f}** ({row['spread']})",
                f">= {row['aim']:g}",
                f"{found['supervisor_percent']:.1f} %",
                f"< {row['share']:g} %",
                f"{found['own_percent']:.1f} %",
                f"{found['step_us']:.0f} µs",
                f"{found['memory_MB']:.0f} MB",
            )
        )
    return "\n\n".join(
        [
            "## Steady production",
            "A balanced tree of mates of parts without geometry, contact between payloads on,"
            " jitter 0, neither filmed nor logged. Each figure is the median (least–greatest) of"
            f" {results['runs']} processes, which took turns. The window begins when production"
            " repeats itself: a cycle has gone by, after the second product, in which no reference"
            f" did anything new ({PATIENCE} cycles at most). It lasts one cycle of the ideal world"
            f" under the same net, and at least {LEAST:g} s (`--quick`: 1 s). Memory is the"
            " process's largest resident set, layout included (aim with 1,000 robots:"
            f" < {MEMORY:g} MB). The supervisor's share is all time in the run loop that is not the"
            " engine's `mj_step`; its own is what is left of that without what spares and measures"
            " the engine's work: choosing what the broad phase looks at, keeping a state to go back"
            " to when something touches, and reading the residuals of welds.",
            table(head, rows),
        ]
    )


def _timestep(asked: float | str, found: Mapping[str, Any]) -> str:
    """The timestep of a row, and whether it was chosen by the factory."""
    if asked == AUTO:
        return f"{1000 * found['timestep_s']:g} ms, by default"
    return f"{1000 * float(asked):g} ms"


if __name__ == "__main__":
    serve(work)
