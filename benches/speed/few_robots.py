"""Few robots: factories in which robots serve several labels, found for a number of robots, and
what they do in MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from benches.fidelity.products import BRICKS, EXAMPLES
from benches.speed.factories import require
from benches.tables import table
from factory.apps.few_robots.aim import Aim, least_robots
from factory.apps.few_robots.search import allocated
from factory.apps.runs.options import fusing_pays
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.pipeline import read
from factory.theory.nets.verify import verify

JITTER, UNITS = 0.3, 6
"""Of all runs."""


@dataclass(frozen=True)
class Wanted:
    """A product with a number of robots, and the cycle time that is aimed at [s]; with what
    `effort` it is looked for, how many seeds are run."""

    file: Path
    robots: int
    cycle: float
    effort: int | None = None
    seeds: int = 5

    @property
    def command(self) -> str:
        """What makes this factory."""
        words = f"factory run {self.file.name} --robots {self.robots}"
        return words + (f" --effort {self.effort}" if self.effort else "")


ROWS = (  # larger ones take longer than twenty minutes: docs/decisions/few-robots.md
    Wanted(EXAMPLES / "paper.pag", 3, 4.1),
    Wanted(BRICKS / "889-1-RadarTruck.pag", 18, 7.3, seeds=3),
    Wanted(BRICKS / "30023-1-Lighthouse.pag", 7, 15.4, seeds=3),
)


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Look for each, prove it, and run it."""
    rows = list[dict[str, Any]]()
    for wanted in ROWS[:1] if quick else ROWS:
        if wanted.file.is_file():
            rows.append(_measured(wanted))
            print(".", end="", flush=True)
            yield {"rows": rows, "jitter": JITTER}
    print()


def _measured(wanted: Wanted) -> dict[str, Any]:
    project = read(wanted.file)
    begin = perf_counter()
    found = allocated(project, Aim(wanted.robots, effort=wanted.effort))
    layout, looked = found.layout, perf_counter() - begin
    runs = []
    for seed in range(wanted.seeds):
        fuse = fusing_pays(layout.factory, layout.product)
        request = RunRequest("mujoco", UNITS, seed, JITTER, found.settings, fuse=fuse)
        run = Simulation(layout, request).run()
        assert run.physics is not None
        require(run.verdict)
        runs.append(
            {
                "cycle_s": run.cycle_time_s,
                "predicted_s": run.predicted_cycle_time_s,
                "contacts": run.physics.unintended_contacts,
                "succeeded": run.succeeded,
                "error_mm": run.physics.product_error_max_mm,
            }
        )
    labels = [x for robot in layout.factory.robots for x in layout.factory.deliveries(robot.index)]
    bare = [x for grip in found.no_grips for x in (grip.line or (grip.label,))]
    assert layout.certificate is not None
    return {
        "product": wanted.file.stem,
        "command": wanted.command,
        "aim_s": wanted.cycle,
        "robots": len(layout.factory.robots),
        "least": least_robots(project.pag, project.templates).total,
        "written": len(project.plain.robots),
        "area_m2": layout.area,
        "proved": verify(layout.factory.net).holds and layout.certificate.holds,
        "in_hands": len(labels) - len(set(bare) & set(labels)),
        "labels": len(labels),
        "looked_s": looked,
        "runs": runs,
    }


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("command", "as written", "least", "robots", "aim [s]", "predicted [s]", "measured [s]"),
        *("off by", "contacts", "failed runs", "in hands", "floor [m²]", "found in [s]"),
    )
    rows = []
    for row in results["rows"]:
        cycles = [run["cycle_s"] for run in row["runs"] if run["cycle_s"] is not None]
        off = [
            abs(run["cycle_s"] / run["predicted_s"] - 1)
            for run in row["runs"]
            if run["cycle_s"] is not None
        ]
        predicted = [run["predicted_s"] for run in row["runs"]]
        rows.append(
            (
                f"`{row['command']}`",
                row["written"],
                row["least"],
                row["robots"],
                f"{row['aim_s']:g}",
                f"{min(predicted):.2f}–{max(predicted):.2f}",
                f"**{min(cycles):.2f}–{max(cycles):.2f}**" if cycles else None,
                f"{100 * max(off):.1f} %" if off else None,
                sum(run["contacts"] for run in row["runs"]),
                sum(not run["succeeded"] for run in row["runs"]),
                f"{row['in_hands']} of {row['labels']}",
                f"{row['area_m2']:.2f}",
                f"{row['looked_s']:.0f}",
            )
        )
    return "\n\n".join(
        [
            "## Few robots",
            "Factories that `--robots` finds, proved live and certified clear, in MuJoCo with"
            f" jitter {results['jitter']:g} over several seeds ({UNITS} units each). *As"
            " written*: the robots with one for each label. *Least*: the bound that is proved,"
            " tools included. *In hands*: labels that are held by a hand.",
            table(head, rows),
        ]
    )
