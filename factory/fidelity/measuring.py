"""Measure a run in MuJoCo while it goes on: an observer that reads and never writes.

The run is the same, to the last bit, with and without it.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from factory.control.mode import Index
from factory.fidelity.approach import BEYOND, Approaches
from factory.fidelity.drives import Drives
from factory.fidelity.finished import Finished
from factory.fidelity.handoffs import HandOffs
from factory.fidelity.payload import Payload
from factory.fidelity.record import HandOff
from factory.fidelity.residual import Residual
from factory.fidelity.shadow import Shadow
from factory.fidelity.steps import Steps
from factory.fidelity.welds import HOLD, Velocities, Welds
from factory.mjcf.names import label_of
from factory.monitor import beside
from factory.simulation import Simulation
from factory.trace import Run


class Measurement:
    """Measures the simulation it is made for; `run` goes through it."""

    def __init__(self, simulation: Simulation) -> None:
        world, model = simulation.world, simulation.model
        if model is None:
            raise ValueError("only a run in MuJoCo can be measured")
        self.simulation, self.m, self.d = simulation, world.m, world.d
        layout = simulation.layout
        self.shadow = Shadow(self.m, self.d, layout.clearance + BEYOND)
        self.welds = Welds(self.m, self.d)
        velocities = Velocities(self.m, self.shadow.d.xaxis)
        self.handoffs = HandOffs(self.m, self.welds, velocities)
        self.payload = Payload(self.welds, velocities, float(self.m.opt.timestep))
        self.drives = Drives(world)
        self.approaches = Approaches(world, layout, self.welds, self.shadow)
        self.finished = Finished(model)
        self.residual = Residual(world, velocities)
        self.seconds = 0.0
        self._order = {part: place for place, part in enumerate(self.finished.parts)}
        self._product: Index | None = None
        self._seen = self._what_happened()
        self._steps = Steps(self.m, self.d, simulation.settings.steps)

    def run(self, max_time: float | None = None) -> Run:
        """Run the simulation, measuring, with a monitor beside it."""
        watcher = beside(self.simulation)
        with self._steps:
            run = self.simulation.run([self.observe, watcher.observe], max_time)
        report = watcher.report()
        self.seconds += report.time_s
        return replace(run, monitor=report)

    def observe(self, world: Any, supervisor: Any) -> None:
        """After a tick. The shadow is still where the tick began: where welds were switched."""
        begin = perf_counter()
        v, force = self._steps.take()
        happened = self._what_happened()
        if happened != self._seen:
            self._seen = happened
            self._switched(world, v)
        self.handoffs.tick(v, world.time)
        self.payload.tick(v)
        self.drives.tick(v, force)
        self.residual.tick(v[-1])
        self.shadow.follow()
        self.approaches.tick(supervisor.active.operations)
        self.seconds += perf_counter() - begin

    def _what_happened(self) -> tuple[int, int]:
        """Firings and products gone so far: welds are switched only with one of them."""
        world, supervisor = self.simulation.world, self.simulation.supervisor
        return len(supervisor.events), len(world.dropoffs)

    def _switched(self, world: Any, v: Any) -> None:
        fresh = self.welds.scan()
        xpos, xmat = self.shadow.d.xpos, self.shadow.d.xmat
        if self._product is not None and not (self.welds.kind[self._product] == HOLD).all():
            self.finished.measure(self._product, xpos, xmat)
            self._product = None
        if not len(fresh):
            return
        begun = world.time - (len(v) - 1) * float(self.m.opt.timestep)
        self.handoffs.begin(fresh, begun, v[0], xpos, xmat)
        held = self.m.eq_obj2id[fresh[self.welds.kinds[fresh] == HOLD]]
        if len(held):
            self._product = np.array(sorted(held, key=self._place))
            self.finished.measure(self._product, xpos, xmat)

    def _place(self, body: int) -> int:
        return self._order[label_of(self.m.body(int(body)).name)]

    def figures(self) -> dict[str, float | None]:
        """The figures of the MuJoCo run alone, by the keys of their quantities."""
        handoffs, misplaced = self.handoffs.all(), self.finished.found()
        drives, payload = self.drives, self.payload
        moved = self.m.body_mass[self.m.body_treeid >= 0]
        physics = self.simulation.world.inspection.figures()
        return {
            "tracking_error_max_mm": 1e3 * drives.error,
            "tracking_error_p99_mm": 1e3 * drives.tracking.quantile(0.99),
            "tracking_error_rms_mm": 1e3 * drives.tracking.rms,
            "handoffs": sum(h.parts for h in handoffs),
            **_of_handoffs(handoffs),
            "weld_residual_max_mm": 1e3 * self.residual.largest,
            "weld_residual_p99_mm": 1e3 * self.residual.moving.quantile(0.99),
            "product_position_max_mm": max((m.position_mm for m in misplaced), default=None),
            "product_angle_max_deg": max((m.angle_deg for m in misplaced), default=None),
            "product_vertex_max_mm": max((m.vertex_mm for m in misplaced), default=None),
            "closest_approach_mm": 1e3 * self.approaches.closest(),
            "clearance_margin_mm": 1e3 * self.approaches.margin(),
            "force_saturated_percent": 1e2 * drives.saturation,
            "force_peak_percent": 1e2 * drives.peak,
            "drive_work_J": drives.work,
            "payload_acceleration_max_m_s2": payload.acceleration.largest,
            "payload_acceleration_p99_m_s2": payload.acceleration.quantile(0.99),
            "payload_jerk_max_m_s3": payload.jerk.largest,
            "payload_jerk_p99_m_s3": payload.jerk.quantile(0.99),
            "moved_mass_kg": float(moved.sum()),
            "unintended_contacts": physics.unintended_contacts,
            "engine_warnings": physics.engine_warnings,
        }


def _of_handoffs(handoffs: tuple[HandOff, ...]) -> dict[str, float | None]:
    return {
        "handoff_gap_max_mm": max((h.gap_mm for h in handoffs), default=None),
        "speed_step_max_mm_s": max((h.speed_step_mm_s for h in handoffs), default=None),
        "impulse_max_mNs": max((h.impulse_mNs for h in handoffs), default=None),
        "handoff_energy_max_mJ_per_kg": max((h.energy_mJ_per_kg for h in handoffs), default=None),
    }
