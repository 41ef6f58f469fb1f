"""How far a run is from the bare engine doing the same."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

from tests.bench.factories import Case, Steady, laid_out, robots_at_least
from tests.bench.processes import fresh, interleaved, median, serve, spread
from tests.bench.replaying import measure_floor
from tests.tables import table

CASES = (
    Case(40, 0.002),
    Case(300, 0.004),
    Case(300, 0.002, None, True),
    Case(1000, 0.004, 2),
    Case(1000, 0.002, 2, True),
)

WINDOW, MANY = 5.0, 160
"""Simulated with so many robots and more [s]; fewer are faster, and watched longer for that."""

AIM = 10.0
"""Percent."""


def work(
    robots: int, timestep: float, wip: int | None, fuse: bool, window: float
) -> dict[str, Any]:
    """The same window as a run, and replayed."""
    case = Case(robots, timestep, wip, fuse)
    layout = laid_out(robots_at_least(robots))
    floor = measure_floor(lambda: case.simulation(layout), Steady.of(layout, wip), window)
    return {
        "robots": len(layout.factory.robots),
        "from_s": floor.since,
        "to_s": floor.since + window,
        "run": window / floor.run,
        "bare": window / floor.bare,
        "step_us": 1e6 * floor.bare / (window / timestep),
        "distance_percent": 100 * (floor.run / floor.bare - 1),
    }


def window(case: Case) -> float:
    """How long a factory is watched [s]."""
    return WINDOW * max(1, MANY // case.robots)


def measure(quick: bool = False) -> dict[str, Any]:
    """Every case, in turns."""
    cases = CASES[:1] if quick else CASES
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
        *("robots", "timestep", "pool", "bodies", "contact", "window", "run", "bare engine"),
        *("bare step", "distance", "aim"),
    )
    rows = []
    for row in results["rows"]:
        found, wip = row["found"], row["wip"]
        rows.append(
            (
                found["robots"],
                f"{1000 * row['timestep']:g} ms",
                "whole" if wip is None else f"`--wip {wip}`",
                "fused" if row["fuse"] else "one a part",
                "on",
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
            " the same state to the last bit. The window begins when production repeats itself, as"
            " above. Run and bare engine in times real time; the distance is how much longer the"
            " run takes, both timed in one process, the median"
            f" (least–greatest) of {results['runs']} processes.",
            table(head, rows),
        ]
    )


if __name__ == "__main__":
    serve(work)
