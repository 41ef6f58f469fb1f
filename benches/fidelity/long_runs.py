"""Long runs: nothing drifts, and no copy of a part is lost.

300 units of the paper's example and 40 of a real product, in one run each. For every unit: product
error, largest hand-off gap and weld residual since the last dropoff, and the interval. The first
ten are the first after the factory has filled, the last ten the last before it runs empty.

A figure is the same at the end as at the beginning when the means of the ten differ by no more than
three standard errors of that difference and a floor, below which nothing matters: 1 µm, and one
tick. Memory may grow by what the record of a unit takes, at most `KIB_A_UNIT`, measured by a line
through the second half of the run. The pool is whole when every copy has exactly one weld that
holds it, of a robot, a feeder, the tray or its parking place, and is either to spare or in a
unit."""

from __future__ import annotations

import gc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benches.fidelity.products import PAPER, REAL, layout, over_cores
from benches.tables import table
from factory.engine.mjcf import names
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation

RUNS = ((PAPER, 300), *((name, 40) for name in REAL))

TEN = 10

SIGMAS = 3.0

FLOORS = {"error_mm": 1e-3, "gap_mm": 1e-3, "residual_mm": 1e-3, "interval_s": 0.01}
"""Differences that do not matter."""

KIB_A_UNIT = 16.0

HOLDERS = {"grip": "held", "feed": "fed", "hold": "on the tray", "park": "parked"}


@dataclass
class Diary:
    """An observer that keeps the figures of every unit, and looks after the copies."""

    simulation: Simulation
    error_mm: list[float] = field(default_factory=list)
    gap_mm: list[float] = field(default_factory=list)
    residual_mm: list[float] = field(default_factory=list)
    memory_kib: list[float] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    seen: int = 0

    def observe(self, _: State) -> None:
        """After a tick; the worst figures of the inspection begin anew with each dropoff."""
        world = self.simulation.physical
        if len(world.dropoffs) == self.seen:
            return
        self.seen = len(world.dropoffs)
        inspection = world.inspection
        self.error_mm.append(1e3 * (inspection.error.vertex if inspection.error else 0.0))
        self.gap_mm.append(1e3 * world.parts.welds.taken.gap)
        self.residual_mm.append(1e3 * inspection.residual)
        inspection.error, inspection.residual, world.parts.welds.taken.gap = None, 0.0, 0.0
        self.memory_kib.append(resident_kib())
        self.lost += misplaced(world)


def resident_kib() -> float:
    """Memory of this process that is in use [KiB]."""
    pages = Path("/proc/self/statm")
    if pages.exists():
        import resource

        return int(pages.read_text().split()[1]) * resource.getpagesize() / 1024
    return 0.0


def whereabouts(world: Any) -> dict[str, list[str]]:
    """What holds each copy, by the welds that are on: `held`, `fed`, `on the tray`, `parked`."""
    m, d, copies = world.m, world.d, world.parts.holdings
    found: dict[str, list[str]] = {
        m.body(body).name: [] for bodies in copies.body.values() for body in bodies
    }
    for weld in np.flatnonzero(d.eq_active):
        body = m.body(m.eq_obj2id[weld]).name
        holder = HOLDERS.get(m.equality(weld).name.partition("/")[0])
        if body in found and holder:
            found[body].append(holder)
    return found


def misplaced(world: Any) -> list[str]:
    """Copies that nothing or more than one thing holds, or that are not either to spare or in one
    unit."""
    holdings, wrong = world.parts.holdings, list[str]()
    for name, holders in whereabouts(world).items():
        if len(holders) != 1:
            wrong.append(f"{name}: {' and '.join(holders) or 'nothing holds it'}")
    units = world.parts.masks.unit
    for label, bodies in holdings.body.items():
        for copy, body in enumerate(bodies.tolist()):
            part = label, int(units[body])
            used = part in holdings and holdings[part] == body
            if holdings.free[label].count(body) + used != 1:
                wrong.append(f"{names.part(label, copy + 1)}: neither to spare nor in a unit")
    return wrong


def compare(values: Sequence[float], fill: int, floor: float) -> dict:
    """The first ten against the last ten of a figure, once `fill` units at either end are left
    out."""
    steady = np.asarray(values[fill : len(values) - fill])
    first, last = steady[:TEN], steady[-TEN:]
    error = float(np.sqrt(first.var(ddof=1) / len(first) + last.var(ddof=1) / len(last)))
    change = float(last.mean() - first.mean())
    return {
        "first": float(first.mean()),
        "last": float(last.mean()),
        "worst": float(np.max(values)),
        "change": change,
        "allowed": SIGMAS * error + floor,
        "same": abs(change) <= SIGMAS * error + floor,
    }


def growth(memory: Sequence[float]) -> float:
    """Memory gained a unit over the second half [KiB]."""
    later = np.asarray(memory[len(memory) // 2 :])
    return float(np.polyfit(np.arange(len(later)), later, 1)[0]) if len(later) > 1 else 0.0


def long_run(case: tuple[str, int]) -> dict:
    """So many units of a product in one run, and what became of its figures."""
    product, units = case
    gc.collect()
    simulation = Simulation(layout(product), RunRequest(units=units))
    assert simulation.model is not None
    fill = min(max(simulation.model.copies.values()), (units - 2 * TEN) // 2)
    diary = Diary(simulation)
    run = simulation.run([diary.observe])
    intervals = np.diff(run.dropoffs, prepend=0.0).tolist()
    figures: Mapping[str, Sequence[float]] = {
        "error_mm": diary.error_mm,
        "gap_mm": diary.gap_mm,
        "residual_mm": diary.residual_mm,
        "interval_s": intervals,
    }
    physics = run.physics
    assert physics is not None
    return {
        "product": product,
        "units": units,
        "made": run.products,
        "trouble": str(run.trouble) if run.trouble else None,
        "sim_time_s": run.sim_time_s,
        "wall_time_s": run.wall_time_s,
        "refines_net": run.refines_net,
        "contacts": physics.unintended_contacts,
        "warnings": physics.engine_warnings,
        "fill": fill,
        "figures": {
            name: compare(values, fill, FLOORS[name])
            for name, values in figures.items()
            if run.products == units
        },
        "memory_kib": [round(diary.memory_kib[0]), round(diary.memory_kib[-1])],
        "growth_kib_a_unit": growth(diary.memory_kib),
        "lost": diary.lost[:TEN],
    }


def faults(found: Mapping[str, Any]) -> list[str]:
    """What is wrong with a long run, in words."""
    said = [f"{name} drifts" for name, f in found["figures"].items() if not f["same"]]
    if found["made"] != found["units"]:
        said.append(f"{found['made']} of {found['units']} made: {found['trouble']}")
    if not found["refines_net"]:
        said.append("does not refine the net")
    if found["contacts"] or found["warnings"]:
        said.append(f"{found['contacts']} contacts, {found['warnings']} warnings")
    if found["growth_kib_a_unit"] > KIB_A_UNIT:
        said.append(f"memory grows by {found['growth_kib_a_unit']:.1f} KiB a unit")
    return said + found["lost"]


def measure(quick: bool = False) -> dict:
    """The long runs; 30 units of the first if it is to be quick."""
    return {"runs": over_cores(long_run, [(PAPER, 30)] if quick else RUNS)}


def section(results: dict) -> str:
    """The report."""
    runs = results["runs"]
    rows = [
        (
            r["product"],
            name.replace("_", ", "),
            *(f[key] for key in ("first", "last", "change", "allowed", "worst", "same")),
        )
        for r in runs
        for name, f in r["figures"].items()
    ]
    lines = []
    for r in runs:
        said = faults(r)
        lines.append(
            f"* `{r['product']}`: {r['made']} of {r['units']} units in {r['sim_time_s']:.0f} s"
            f" simulated, {r['wall_time_s']:.0f} s of wall time; {r['contacts']} unintended"
            f" contacts, {r['warnings']} engine warnings; memory {r['memory_kib'][0] / 1024:.1f} to"
            f" {r['memory_kib'][1] / 1024:.1f} MiB, {r['growth_kib_a_unit']:.2f} KiB a unit over"
            f" the second half; copies lost: {len(r['lost'])}."
            f" **{'; '.join(said) if said else 'Nothing drifts'}.**"
        )
    head = ("product", "figure", "first ten", "last ten", "change", "allowed", "worst", "same")
    return "\n\n".join(
        [
            "## Long runs",
            "One run each. The means of the first ten units after the factory has filled and of the"
            " last ten before it runs empty are the same if they differ by at most three standard"
            " errors and 1 µm, or one tick. Every copy of every part must be held by exactly one of"
            " robot, feeder, tray or parking place at every dropoff.",
            "\n".join(lines),
            table(head, rows),
        ]
    )
