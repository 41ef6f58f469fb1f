"""Cycle time against the size of a factory, with relays and without: balanced trees whose parts
fill one cube, so that the size and mass of the product are the same."""

from __future__ import annotations

from time import process_time
from typing import Any

import factory
from benches.speed.factories import cube, laid_out, require
from benches.tables import table
from factory.layout.durations import Pace, gear_times
from factory.layout.layout import Layout
from factory.layout.relaying import relayed
from factory.nets.verify import verify
from factory.support.settings import Settings
from factory.timing.timed import timed
from factory.timing.timing import Timing

SIZES = (16, 32, 64, 128, 256, 512, 1024)
"""Parts of the product."""

MEASURED = {"ideal": 1024, "mujoco": 64}
"""Up to so many parts a run is measured, in each world."""

SETTINGS = Settings(hands=0)
"""Hands cannot relay what is as heavy and narrow as cubes."""

UNITS = 12
"""Products of a run: the last four at an even pace."""


def measure(quick: bool = False) -> dict[str, Any]:
    """Lay out, prove and predict each; run some."""
    rows = []
    for parts in SIZES[:1] if quick else SIZES:
        plain = laid_out(cube(parts), SETTINGS)
        begin = process_time()
        layout = relayed(plain, SETTINGS)
        row = {
            "parts": parts,
            "robots": len(plain.factory.robots),
            "added": len(layout.factory.robots) - len(plain.factory.robots),
            "plain_s": max(gear_times(plain, Pace.of(SETTINGS))),
            "net_s": max(gear_times(layout, Pace.of(SETTINGS))),
            "plain_area_m2": plain.area,
            "area_m2": layout.area,
            "seconds": process_time() - begin,
            "proved": verify(layout.factory.net).holds,
        }
        for world, most in MEASURED.items():
            row[f"predicted_{world}_s"] = predicted(layout, world)
            row[f"measured_{world}"] = made(layout, world) if parts <= most else None
        rows.append(row)
        print(".", end="", flush=True)
    print()
    return {"rows": rows, "units": UNITS}


def predicted(layout: Layout, world: Any) -> float:
    """The cycle time [s] that the net, and in MuJoCo the outfeed, allow."""
    return timed(Timing(layout, SETTINGS, world)).cycle.seconds


def made(layout: Layout, world: Any) -> dict[str, Any]:
    """A run: its cycle time [s], and in MuJoCo how well it went."""
    run = factory.run(layout, world, UNITS, settings=SETTINGS, fuse=world == "mujoco")
    require(run.verdict)
    found: dict[str, Any] = {"cycle_s": run.cycle_time_s, "refines_net": run.refines_net}
    if run.physics is not None:
        found["contacts"] = run.physics.unintended_contacts
        found["gap_mm"] = run.physics.handoff_gap_max_mm
    return found


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("parts", "robots", "without [s]", "relays", "net [s]", "ideal world [s]"),
        *("MuJoCo, predicted [s]", "MuJoCo [s]", "gap [mm]", "contacts", "floor [m²]"),
        "time to find [s]",
    )
    rows = []
    for row in results["rows"]:
        ideal, physical = row["measured_ideal"] or {}, row["measured_mujoco"] or {}
        rows.append(
            (
                row["parts"],
                row["robots"],
                f"{row['plain_s']:.2f}",
                row["added"],
                f"{row['net_s']:.2f}",
                _seconds(ideal.get("cycle_s")),
                f"{row['predicted_mujoco_s']:.2f}",
                _seconds(physical.get("cycle_s")),
                None if not physical else f"{physical['gap_mm']:.3f}",
                physical.get("contacts"),
                f"{row['plain_area_m2']:.1f} → {row['area_m2']:.1f}",
                f"{row['seconds']:.1f}",
            )
        )
    times = [row["net_s"] for row in results["rows"]]
    spread = 100 * (max(times) / min(times) - 1)
    return "\n\n".join(
        [
            "## Relays",
            "Balanced trees of boxes that fill a cube of 0.3 m and 3 kg together,"
            " `--relay --no-hands`. The net of each was proved. The longest and the shortest cycle"
            f" with relays differ by {spread:.0f} %. In MuJoCo the outfeed's tray has to be back"
            " first.",
            table(head, rows),
        ]
    )


def _seconds(value: float | None) -> str | None:
    return None if value is None else f"{value:.2f}"
