"""Each robot that has a deputy dies once, without spares: the deputy takes its tours, and the pace
afterwards is beside what is predicted."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import product as pairs
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benches.faults.deaths import WORLDS
from benches.faults.trials import Kept
from benches.fidelity.products import EXAMPLES
from benches.tables import table
from factory.layout.layout import Layout
from factory.layout.request import Ground
from factory.layout.standby import deputies_in
from factory.pipeline import read
from factory.record.log import LogWriter, read_log
from factory.record.monitor.record import watch_log
from factory.simulation.recovery import Campaign, WorldFault, recover
from factory.simulation.request import RunRequest, WorldName
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation

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


def tried(product: str, world: WorldName, dead: int, deputy: int, at: float) -> dict[str, Any]:
    """What came of a run in which a robot dies; in MuJoCo with the verdict of the monitor on its
    log."""
    layout = layout_of(product)
    name = layout.factory.robots[dead].name
    simulation = Simulation(layout, RunRequest(world, UNITS, recovers=True))
    recovery = recover(simulation, Campaign((WorldFault("dead", robot=name, at=at),), swap=SWAP))
    with TemporaryDirectory() as folder:
        run, judged = _run(simulation, Path(folder) / "run.log")
    physics = run.physics
    return {
        "product": product,
        "world": world,
        "dead": name,
        "deputy": layout.factory.robots[deputy].name,
        "at": at,
        "asked": UNITS,
        "made": run.products,
        "trouble": run.trouble and str(run.trouble),
        "replays": run.refines_net,
        "judged": judged,
        "contacts": physics.unintended_contacts if physics else 0,
        "error_mm": physics and physics.product_error_max_mm,
        "found": len(recovery.found),
        "exchanges": len(run.exchanges),
        "undone": recovery.report().undone,
        "predicted_s": run.exchanges[0].cycle_time if run.exchanges else None,
        "before_s": run.predicted_cycle_time_s,
        "interval_s": interval_after(run),
    }


def interval_after(run: Run) -> float | None:
    """The mean interval between products after a deputy took over, but for the first [s]; None for
    none."""
    left = [t for t in run.dropoffs if run.exchanges and t > run.exchanges[0].t][FIRST:]
    return (left[-1] - left[0]) / (len(left) - 1) if len(left) > 1 else None


def _run(simulation: Simulation, file: Path) -> tuple[Run, bool]:
    """A run, and whether the monitor of its log finds nothing wrong; in the ideal world it judges
    nothing."""
    if simulation.model is None:
        return simulation.run(max_time=300.0), True
    with LogWriter(file, simulation) as log:
        run = simulation.run([log.observe], max_time=300.0)
        log.end(run.trouble)
    return run, not watch_log(read_log(file))[0].violations


def measure(quick: bool = False, kept: Kept = None) -> Iterator[dict[str, Any]]:
    """Let die each robot that has a deputy, at three times each, in both worlds."""
    rows = [*(kept or {}).get("rows", ())]
    there = {(row["product"], row["world"], row["dead"], row["at"]) for row in rows}
    for product, world in pairs(["paper"] if quick else TIMES, WORLDS):
        layout = layout_of(product)
        for (dead, deputy), at in pairs(sorted(deputies_in(layout).items()), TIMES[product]):
            if (product, world, layout.factory.robots[dead].name, at) not in there:
                rows.append(tried(product, world, dead, deputy, at))
                yield {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    groups = [
        [row for row in results["rows"] if (row["product"], row["world"]) == key]
        for key in pairs(TIMES, WORLDS)
    ]
    head = ("product", "world", "runs", "robots", "taken over", "units made", "error [mm]")
    more = ("contacts", "undone", "N [s]", "N' predicted [s]", "interval [s]", "off by")
    return "\n\n".join(
        [
            "## Deputies",
            f"Each robot that has a deputy dies once in a run of {UNITS} units without spares, at"
            f" three times each; it is lifted out {SWAP:g} s after that was found, and the deputy"
            " has its tours from then on. *N* and *N'*: predicted cycle times before and after."
            " *Interval*: mean between products after the exchange, but for the first"
            f" {FIRST}; *off by*: from the prediction, at most. *Judged*: runs in which the monitor"
            " finds nothing wrong, from the log of the bodies alone, before the death and after it."
            " The paper's example is taken with inserts.",
            table((*head, *more, "refine", "judged"), [_row(group) for group in groups if group]),
        ]
    )


def _row(group: list[dict[str, Any]]) -> tuple[object, ...]:
    over = [row for row in group if row["interval_s"] is not None]
    off = [100 * abs(row["interval_s"] / row["predicted_s"] - 1) for row in over]
    times = [row["interval_s"] for row in over]
    is_ideal = group[0]["world"] == "ideal"
    return (
        group[0]["product"],
        "ideal" if is_ideal else "MuJoCo",
        len(group),
        len({row["dead"] for row in group}),
        sum(row["exchanges"] for row in group),
        f"{sum(row['made'] for row in group)} of {sum(row['asked'] for row in group)}",
        None if is_ideal else max(row["error_mm"] or 0.0 for row in group),
        sum(row["contacts"] for row in group),
        sum(row["undone"] for row in group),
        f"{group[0]['before_s']:.3f}",
        f"{min(r['predicted_s'] for r in over):.3f}–{max(r['predicted_s'] for r in over):.3f}",
        f"{min(times):.3f}–{max(times):.3f}",
        f"{max(off):.1f} %",
        f"{sum(row['replays'] for row in group)} of {len(group)}",
        None if is_ideal else f"{sum(row['judged'] for row in group)} of {len(group)}",
    )
