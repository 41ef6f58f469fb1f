"""Each robot dies once: a spare takes its place, and the pace afterwards is as predicted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from benches.faults.campaigns import PRODUCTS
from benches.faults.trials import JITTER, Kept, Trial, is_good, project, tried_so_far
from benches.tables import table
from factory.apps.deviations import Deviation
from factory.engine.simulation.request import WorldName

UNITS, SWAP = 14, 10.0
WORLDS: tuple[WorldName, ...] = ("ideal", "mujoco")
TIMES = {"paper": (5.0, 6.0, 7.0), "truck": (13.0, 15.0, 17.0), "chest": (14.0, 16.0, 18.0)}
"""From when on a robot dies as it begins its next operation [s]: about two cycles after the start,
a third of a cycle apart."""

LAST = 4
"""So many intervals between the last products are looked at: after a stop a few come sooner, while
what has been made in advance lasts."""


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Let die each robot in both worlds, one after the other at the three times."""
    products = PRODUCTS[:1] if quick else PRODUCTS
    trials = [
        Trial(
            product,
            (Deviation("dead", robot=robot.name, at=TIMES[product][turn]),),
            UNITS,
            turn,
            f"{world} {robot.name} {TIMES[product][turn]:g}",
            1,
            SWAP,
            world=world,
        )
        for product in products
        for world in WORLDS
        for robot in project(product).factory.robots
        for turn in [robot.index % len(TIMES[product])]
    ]
    for rows in tried_so_far(trials, kept):
        yield {"rows": rows}


def interval(row: dict[str, Any]) -> float | None:
    """The mean of the last intervals between products [s]; None where these did not begin after a
    spare came."""
    left = row["dropoffs"][-1 - LAST :]
    after = row["spares"] and left[0] > row["ended_s"] + SWAP
    return (left[-1] - left[0]) / LAST if after else None


def section(results: dict[str, Any]) -> str:
    """The report."""
    groups = [
        (
            product,
            world,
            [
                row
                for row in results["rows"]
                if row["product"] == product and row["about"].startswith(world)
            ],
        )
        for product in PRODUCTS
        for world in WORLDS
    ]
    head = (
        "product",
        "world",
        "runs",
        "robots",
        "replaced",
        "units made",
        "error [mm]",
        "contacts",
    )
    more = ("missed", "false alarms", "interval [s]", "predicted [s]", "off by", "as they should")
    return "\n\n".join(
        [
            "## Each robot dies",
            f"A robot dies as it begins its next operation after a time of about two cycles, of"
            f" {UNITS} units at jitter {JITTER:g}; nothing tells the supervisor but that the robot"
            f" does not move. A spare comes {SWAP:g} s after that was found. Each robot dies in"
            " a run of its own, at one of three times. A tool that has come to its station stays"
            " there, so its death is often of no consequence: nothing was to be found then."
            f" *Interval*: mean of the last {LAST} between products, where a spare came; *off by*:"
            " from the prediction for the factory, at most.",
            table((*head, *more), [_row(*group) for group in groups if group[2]]),
        ]
    )


def _row(product: str, world: str, group: list[dict[str, Any]]) -> tuple[object, ...]:
    def total(key: str) -> int:
        return sum(int(row[key]) for row in group)

    found = [(t, row["predicted_s"]) for row in group if (t := interval(row)) is not None]
    off = [100 * abs(t / predicted - 1) for t, predicted in found]
    return (
        product,
        {"ideal": "ideal", "mujoco": "MuJoCo"}[world],
        len(group),
        len({row["about"].split()[1] for row in group}),
        total("spares"),
        f"{total('made')} of {total('asked')}",
        None if world == "ideal" else max(row["error_mm"] or 0.0 for row in group),
        total("contacts"),
        total("missed"),
        total("false_alarms"),
        f"{min(t for t, _ in found):.3f}–{max(t for t, _ in found):.3f}" if found else None,
        f"{min(p for _, p in found):.3f}–{max(p for _, p in found):.3f}" if found else None,
        f"{max(off):.1f} %" if off else None,
        f"{sum(map(is_good, group))} of {len(group)}",
    )
