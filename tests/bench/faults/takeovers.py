"""Each robot that has a deputy dies once, without spares: the deputy takes its tours, in the ideal
world, and the pace afterwards is beside what is predicted, and that of a run of N' from m_0."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from factory.compiler.taking_over import present, with_moved
from factory.layout.layout import Layout
from factory.layout.request import Ground
from factory.layout.standby import deputies_in, part_of
from factory.pipeline import read
from factory.simulation.recovery import Campaign, WorldFault, recover
from factory.simulation.request import RunRequest
from factory.simulation.run import mean_interval
from factory.simulation.simulation import Simulation
from tests.fidelity.products import EXAMPLES
from tests.tables import table

PAPER = (
    "root = sub3; sub3 = insert(sub2, part3); sub2 = weld(sub1); sub1 = insert(part1, part2);"
    " part1 = atomic(); part2 = atomic(); part3 = atomic()"
)
"""The paper's example with inserts: as it is written no robot has a deputy."""

UNITS, SWAP = 14, 10.0
TIMES = {"paper": (5.0, 6.0, 7.0), "truck": (13.0, 15.0, 17.0), "chest": (14.0, 16.0, 18.0)}
"""From when on a robot dies as it begins its next operation [s], as where a spare comes."""

FIRST = 2
"""So many products after the exchange are left out: some come sooner, of what is there already."""


@cache
def layout_of(product: str) -> Layout:
    """The layout of a product whose deputies can take over."""
    if product != "paper":
        return read(EXAMPLES / f"{product}.pag", ground=Ground(deputies=True)).layout
    with TemporaryDirectory() as folder:
        file = Path(folder) / "paper.pag"
        file.write_text(PAPER)
        return read(file, ground=Ground(deputies=True)).layout


def tried(product: str, dead: int, deputy: int, at: float) -> dict[str, Any]:
    """What came of a run in which a robot dies, and of one of N' alone."""
    layout = layout_of(product)
    name = layout.factory.robots[dead].name
    simulation = Simulation(layout, RunRequest("ideal", UNITS, recovers=True))
    recovery = recover(simulation, Campaign((WorldFault("dead", robot=name, at=at),), swap=SWAP))
    run = simulation.run(max_time=300.0)
    after = with_moved(layout.factory, {dead: deputy})
    alone = part_of(layout, after, [r for r in range(len(layout.factory.robots)) if r != dead])
    assert alone is not None and present(after)
    left = [t for t in run.dropoffs if run.exchanges and t > run.exchanges[0].t][FIRST:]
    return {
        "product": product,
        "dead": name,
        "deputy": layout.factory.robots[deputy].name,
        "at": at,
        "asked": UNITS,
        "made": run.products,
        "trouble": run.trouble and str(run.trouble),
        "replays": run.refines_net,
        "found": len(recovery.found),
        "exchanges": len(run.exchanges),
        "undone": recovery.report().undone,
        "predicted_s": run.exchanges[0].cycle_time if run.exchanges else None,
        "before_s": run.predicted_cycle_time_s,
        "interval_s": (left[-1] - left[0]) / (len(left) - 1) if len(left) > 1 else None,
        "alone_s": mean_interval(Simulation(alone, RunRequest("ideal", UNITS)).run().dropoffs),
    }


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Let die each robot that has a deputy, at three times each."""
    rows = list[dict[str, Any]]()
    for product in ["paper"] if quick else TIMES:
        for dead, deputy in sorted(deputies_in(layout_of(product)).items()):
            for at in TIMES[product]:
                rows.append(tried(product, dead, deputy, at))
                yield {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    groups = [[r for r in results["rows"] if r["product"] == product] for product in TIMES]
    head = ("product", "runs", "robots", "taken over", "units made", "undone", "N [s]")
    more = ("N' predicted [s]", "interval [s]", "off by", "off N' alone", "refine")
    return "\n\n".join(
        [
            "## Deputies",
            f"Each robot that has a deputy dies once in a run of {UNITS} units without spares, at"
            f" three times each, in the ideal world; it is lifted out {SWAP:g} s after that was"
            " found, and the deputy has its tours from then on. *N* and *N'*: predicted cycle times"
            " before and after. *Interval*: mean between products after the exchange, but for the"
            f" first {FIRST}; *off by*: from the prediction, at most; *off N' alone*: from the"
            " cycle time of a run of N' from its beginning. The paper's example is taken with"
            " inserts.",
            table((*head, *more), [_row(group) for group in groups if group]),
        ]
    )


def _row(group: list[dict[str, Any]]) -> tuple[object, ...]:
    over = [row for row in group if row["interval_s"] is not None]
    off = [100 * abs(row["interval_s"] / row["predicted_s"] - 1) for row in over]
    alone = [100 * abs(row["interval_s"] / row["alone_s"] - 1) for row in over]
    times = [row["interval_s"] for row in over]
    return (
        group[0]["product"],
        len(group),
        len({row["dead"] for row in group}),
        sum(row["exchanges"] for row in group),
        f"{sum(row['made'] for row in group)} of {sum(row['asked'] for row in group)}",
        sum(row["undone"] for row in group),
        f"{group[0]['before_s']:.3f}",
        f"{min(r['predicted_s'] for r in over):.3f}–{max(r['predicted_s'] for r in over):.3f}",
        f"{min(times):.3f}–{max(times):.3f}",
        f"{max(off):.1f} %",
        f"{max(alone):.1f} %",
        f"{sum(row['replays'] for row in group)} of {len(group)}",
    )
