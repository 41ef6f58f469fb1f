"""Each kind of fault, one a unit, at places that a seed draws: nothing is lost, nothing stalls."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from benches.faults.trials import JITTER, Kept, Trial, is_good, project, tried_so_far
from benches.tables import table
from factory.apps.deviations import Deviation
from factory.theory.plant.factory import Factory

PRODUCTS = ("paper", "truck", "chest")
KINDS = {
    "bad_part": "bad part",
    "misplaced": "flipped part",
    "drop": "dropped",
    "no_part": "missing part",
    "blackout": "blackout",
    "down": "robot down",
    "bad_joint": "bad joint",
}
"""The list of the Agile Robotics for Industrial Automation Competition, and bad joints."""

UNITS, SEEDS = 3, 3


def fault(kind: str, factory: Factory, unit: int, draw: random.Random) -> Deviation:
    """One of a kind, of a robot or label that is drawn."""
    if kind == "down":
        return Deviation(kind, robot=draw.choice(factory.robots).name, unit=unit)
    known = [*factory.making]
    if kind in ("bad_part", "misplaced", "no_part"):
        known = [*factory.leaves]
    if kind == "bad_joint":
        known = [operation for operation in known if len(operation.inputs) > 1]
    label = draw.choice(known).label
    turned = {"degrees": 180.0} if kind == "misplaced" else {}
    return Deviation(kind, label=label, unit=unit, **turned)


def trial(product: str, kind: str, seed: int) -> Trial:
    """A fault of a kind in each of some units."""
    draw, factory = random.Random(f"{product}{kind}{seed}"), project(product).factory
    faults = tuple(fault(kind, factory, unit, draw) for unit in range(1, UNITS + 1))
    return Trial(product, faults, UNITS, seed, kind)


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Run all, and tell after each what has been found so far."""
    products, seeds = (PRODUCTS[:1], 1) if quick else (PRODUCTS, SEEDS)
    trials = [trial(p, k, seed) for seed in range(seeds) for p in products for k in KINDS]
    for rows in tried_so_far(trials, kept):
        yield {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = results["rows"]
    seeds = 1 + max(row["seed"] for row in rows)
    groups = [
        [row for row in rows if (row["product"], row["about"]) == (product, kind)]
        for product in PRODUCTS
        for kind in KINDS
    ]
    head = ("product", "fault", "runs", "struck", "units made", "stalled", "error [mm]", "contacts")
    more = ("missed", "false alarms", "undone", "longest [s]", "passed")
    good = sum(map(is_good, rows))
    return "\n\n".join(
        [
            "## Each kind of fault",
            f"One fault in each of {UNITS} units, at a part, joint or robot that the seed draws;"
            f" {seeds} seeds, jitter {JITTER:g}. **{good} of {len(rows)} runs** made all units"
            " within 0.1 mm, as runs of the net, touched nothing that had not fallen, missed no"
            " fault and gave no false alarm. Fewer have *struck* than there are units where a robot"
            " delivered what it was to drop, or a joint was undone for another reason. A blackout"
            " and a missing part are waits: no test looks for them. *Undone*: transitions fired"
            " backwards, on average.",
            table(
                (*head, *more),
                [_row(group) for group in groups if group],
            ),
        ]
    )


def _row(group: list[dict[str, Any]]) -> tuple[object, ...]:
    def total(key: str) -> int:
        return sum(int(row[key]) for row in group)

    return (
        group[0]["product"],
        KINDS[group[0]["about"]],
        len(group),
        total("struck"),
        f"{total('made')} of {total('asked')}",
        sum(row["trouble"] is not None for row in group),
        max(row["error_mm"] or 0.0 for row in group),
        total("contacts"),
        total("missed"),
        total("false_alarms"),
        total("undone") / len(group),
        f"{max(row['sim_s'] for row in group):.1f}",
        all(map(is_good, group)),
    )
