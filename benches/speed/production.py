"""How fast factories run: in steady production, and from the empty factory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from time import perf_counter
from typing import Any

from benches.speed.factories import (
    PATIENCE,
    Case,
    Steady,
    judge,
    produce,
    run_in,
    run_until,
)
from benches.speed.processes import fresh, interleaved, median, resident, serve, spread
from benches.tables import table
from factory.engine.simulation.simulation import Simulation

TIMESTEPS = (0.002, None)
"""The engine's timesteps [s]; None is the default."""

UNITS = 20
"""Units made from the empty factory, with the default timestep."""

LARGE = 1000
"""Robots of the largest factory, which is measured once, with two units let in at once."""

CASES: Sequence[tuple[Case, float | None]] = (
    *(
        case
        for robots, aims in ((40, (20.0, 50.0)), (300, (6.0, 18.0)))
        for case in (
            *((Case(robots, t, None, True), aim) for t, aim in zip(TIMESTEPS, aims, strict=True)),
            (Case(robots, None, None, True, UNITS), None),
        )
    ),
    (Case(LARGE, None, 2, True), 6.0),
)
"""What is measured, each with the multiple of real time that is aimed at."""

LEAST = 10.0
"""Simulated at least [s] in steady production, and at least one cycle."""

RUNS = 2
"""Processes a case: other load on the machine shows in single ones."""

MEMORY = 1500.0
"""The largest resident set aimed at, with 1,000 robots [MB]."""


def work(
    robots: int,
    timestep: float | None = None,
    wip: int | None = None,
    fuse: bool = False,
    units: int | None = None,
    example: str | None = None,
    window: float | None = None,
) -> dict[str, Any]:
    """A case: `units` from the empty factory, or in steady production a `window` [s], one cycle
    where None."""
    case = Case(robots, timestep, wip, fuse, units, example)
    layout = case.layout()
    simulation = case.simulation(layout)
    if units is not None:
        return measured(simulation, partial(produce, simulation, units))
    steady = Steady.of(layout, wip)
    end = run_in(simulation, steady) + (window or max(LEAST, steady.cycle))
    return measured(simulation, partial(run_until, simulation, end))


def measured(simulation: Simulation, go: Callable[[], None]) -> dict[str, Any]:
    """What a run does while it goes."""
    world, layout = simulation.physical, simulation.layout
    start, made, physics, begin = world.time, world.delivered(), world.physics_time, perf_counter()
    go()
    wall, engine = perf_counter() - begin, world.physics_time - physics
    judge(simulation)
    simulated, timestep = world.time - start, float(world.m.opt.timestep)
    return {
        "robots": len(layout.factory.robots),
        "bodies": world.model.bodies,
        "timestep_ms": 1e3 * timestep,
        "from_s": start,
        "to_s": world.time,
        "made": world.delivered() - made,
        "realtime": simulated / wall,
        "supervisor_percent": 100 * (wall - engine) / wall,
        "step_us": 1e6 * engine / (simulated / timestep),
        "memory_MB": resident(),
    }


def measure(quick: bool = False) -> dict[str, Any]:
    """Every case, in turns."""
    cases = CASES[:2] if quick else CASES
    window = 1.0 if quick else None
    jobs = [partial(fresh, work, **asdict(case), window=window) for case, _ in cases]
    small = sum(case.robots < LARGE for case, _ in cases)
    found = [*interleaved(jobs[:small], RUNS), *interleaved(jobs[small:], 1)]
    return {
        "runs": len(found[0]),
        "rows": [
            {**asdict(case), "aim": aim, "found": median(own), "spread": spread(own, "realtime")}
            for (case, aim), own in zip(cases, found, strict=True)
        ],
    }


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("robots", "timestep", "bodies", "let in", "window", "simulated", "times real time"),
        *("aim", "supervisor", "engine's step", "memory"),
    )
    rows = []
    for row in results["rows"]:
        found, aim = row["found"], row["aim"]
        rows.append(
            (
                found["robots"],
                timestep_of(row),
                f"{found['bodies']}, {'fused' if row['fuse'] else 'one a part'}",
                "any" if row["wip"] is None else f"`--wip {row['wip']}`",
                window_of(row),
                f"{found['from_s']:.1f}–{found['to_s']:.1f} s",
                f"**{found['realtime']:.2f}** ({row['spread']})",
                None if aim is None else f">= {aim:g}",
                f"{found['supervisor_percent']:.1f} %",
                f"{found['step_us']:.0f} µs",
                f"{found['memory_MB']:.0f} MB",
            )
        )
    return "\n\n".join(
        [
            "## Production",
            "A balanced tree of mates of parts without geometry, contact between payloads on,"
            " jitter 0, neither filmed nor logged. Each figure is the median (least–greatest) of"
            f" {results['runs']} interleaved processes, of one for the largest factory. *Units*"
            " are made from the empty factory, as most runs do. The *steady* window begins when"
            " production repeats itself: a cycle has gone by, after the second product, in which"
            f" no reference did anything new ({PATIENCE} cycles at most). It lasts one cycle of"
            " the ideal world under the same"
            f" net, and at least {LEAST:g} s (`--quick`: 1 s). The supervisor's share is all time"
            " in the run loop that is not the engine's `mj_step`; how far a run is from the bare"
            " engine is in the next section. Memory is the process's largest resident set, layout"
            f" included (aim with 1,000 robots: < {MEMORY:g} MB).",
            table(head, rows),
        ]
    )


def timestep_of(row: dict[str, Any]) -> str:
    """The engine's timestep of a case, in words."""
    if row["timestep"] is None:
        return f"default, {row['found']['timestep_ms']:g} ms"
    return f"{1000 * row['timestep']:g} ms"


def window_of(row: dict[str, Any]) -> str:
    """Which part of a run a case is, in words."""
    return "steady" if row["units"] is None else f"{row['units']} units"


if __name__ == "__main__":
    serve(work)
