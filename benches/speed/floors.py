"""How far a run is from the bare engine doing the same."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

from benches.speed.factories import Case
from benches.speed.processes import fresh, interleaved, median, serve, spread
from benches.speed.production import timestep_of, window_of
from benches.speed.replaying import measure_floor
from benches.tables import table

MADE = 5
"""Units made from the empty factory."""

CASES = tuple(
    Case(robots, None, None, True, units, example)
    for robots, example in ((6, "paper"), (23, "truck"), (40, None), (300, None))
    for units in (None, MADE)
)

WINDOW, MANY = 5.0, 160
"""Simulated in steady production with so many robots and more [s]; fewer are faster, and watched
longer for that."""


def work(
    robots: int,
    timestep: float | None = None,
    wip: int | None = None,
    fuse: bool = False,
    units: int | None = None,
    example: str | None = None,
    window: float = WINDOW,
) -> dict[str, Any]:
    """The same as a run, and replayed: `units` from the empty factory, or in steady production a
    window [s]."""
    case = Case(robots, timestep, wip, fuse, units, example)
    layout = case.layout()
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
    found = interleaved(jobs, 2)
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
        *("product", "robots", "timestep", "window", "simulated", "run", "bare engine"),
        *("bare step", "distance"),
    )
    rows = []
    for row in results["rows"]:
        found = row["found"]
        rows.append(
            (
                row["example"] or "balanced",
                found["robots"],
                timestep_of(row),
                window_of(row),
                f"{found['from_s']:.1f}–{found['to_s']:.1f} s",
                f"{found['run']:.2f}",
                f"{found['bare']:.2f}",
                f"{found['step_us']:.0f} µs",
                f"**{found['distance_percent']:.0f} %** ({row['spread']})",
            )
        )
    return "\n\n".join(
        [
            "## Distance to the bare engine",
            "Everything a run writes into the engine between two steps is recorded, and the same"
            " model is stepped through the same writes with nothing else in the loop; both end in"
            " the same state to the last bit. Examples, and balanced products as above, at the"
            " default timestep, parts joined for good being one body, any number of units let in."
            f" The windows begin as above; *steady* ones last {WINDOW:g} s or longer. Run and bare"
            " engine in simulated time per processor time; the distance is how much longer the run"
            f" takes, the median (least–greatest) of {results['runs']} processes.",
            table(head, rows),
        ]
    )


if __name__ == "__main__":
    serve(work)
