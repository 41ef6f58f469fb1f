"""How far a run is from the bare engine doing the same."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

from benches.speed.factories import Case, laid_out, robots_at_least
from benches.speed.processes import fresh, interleaved, median, serve, spread
from benches.speed.production import FACTORIES, TIMESTEPS, timestep_of, window_of
from benches.speed.replaying import measure_floor
from benches.tables import table

MADE = 5
"""Units made from the empty factory."""

CASES = tuple(
    case
    for robots, wip, _ in FACTORIES
    for timestep in TIMESTEPS
    for case in (Case(robots, timestep, wip, True), Case(robots, timestep, None, True, MADE))
)

WINDOW, MANY = 5.0, 160
"""Simulated in steady production with so many robots and more [s]; fewer are faster, and watched
longer for that."""

AIM = 10.0
"""Percent."""


def work(
    robots: int,
    timestep: float | None = None,
    wip: int | None = None,
    fuse: bool = False,
    units: int | None = None,
    window: float = WINDOW,
) -> dict[str, Any]:
    """The same as a run, and replayed: `units` from the empty factory, or in steady production a
    window [s]."""
    case, layout = Case(robots, timestep, wip, fuse, units), laid_out(robots_at_least(robots))
    floor = measure_floor(case, layout, window)
    simulated = floor.until - floor.since
    return {
        "robots": len(layout.factory.robots),
        "timestep_ms": 1e3 * floor.timestep,
        "from_s": floor.since,
        "to_s": floor.until,
        "run": simulated / floor.run,
        "bare": simulated / floor.bare,
        "step_us": 1e6 * floor.bare / (simulated / floor.timestep),
        "distance_percent": 100 * (floor.run / floor.bare - 1),
    }


def window(case: Case) -> float:
    """How long a factory in steady production is watched [s]."""
    return WINDOW * max(1, MANY // case.robots)


def measure(quick: bool = False) -> dict[str, Any]:
    """Every case, in turns."""
    cases = CASES[:2] if quick else CASES
    jobs = [
        partial(fresh, work, **asdict(case), window=1.0 if quick else window(case))
        for case in cases
    ]
    found = interleaved(jobs, 2 if quick else 3)
    return {
        "runs": len(found[0]),
        "rows": [
            {**asdict(case), "found": median(own), "spread": spread(own, "distance_percent")}
            for case, own in zip(cases, found, strict=True)
        ],
    }


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("robots", "timestep", "bodies", "let in", "window", "simulated", "run", "bare engine"),
        *("bare step", "distance", "aim"),
    )
    rows = []
    for row in results["rows"]:
        found, wip = row["found"], row["wip"]
        rows.append(
            (
                found["robots"],
                timestep_of(row),
                "fused" if row["fuse"] else "one a part",
                "any" if wip is None else f"`--wip {wip}`",
                window_of(row),
                f"{found['from_s']:.1f}–{found['to_s']:.1f} s",
                f"{found['run']:.2f}",
                f"{found['bare']:.2f}",
                f"{found['step_us']:.0f} µs",
                f"**{found['distance_percent']:.1f} %** ({row['spread']})",
                f"< {AIM:g} %",
            )
        )
    return "\n\n".join(
        [
            "## Distance to the bare engine",
            "Everything a run writes into the engine between two steps is recorded, and the same"
            " model is stepped through the same writes with nothing else in the loop; both end in"
            " the same state to the last bit. The windows begin as above; *steady* ones last"
            f" {WINDOW:g} s or longer. Run and bare engine in times real time; the distance is how"
            " much longer the run takes, both timed in one process, the median (least–greatest) of"
            f" {results['runs']} processes.",
            table(head, rows),
        ]
    )


if __name__ == "__main__":
    serve(work)
