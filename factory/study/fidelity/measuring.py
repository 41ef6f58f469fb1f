"""Measurement of a run in MuJoCo, by an observer that only reads.

The run is the same, to the last bit, with and without it.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

from factory.record.monitor import beside
from factory.record.state import State
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation
from factory.study.fidelity.approach import BEYOND, Approaches
from factory.study.fidelity.dynamics import DriveFigures, Payload, Residual
from factory.study.fidelity.hidden import HiddenPenetrations
from factory.study.fidelity.parts import Finished, HandOffs
from factory.study.fidelity.readings import ActiveWelds, Shadow, Steps, Velocities


class Measurement:
    """Measurement of a simulation, which `run` runs. `seconds`: time spent on measuring and on the
    monitor."""

    def __init__(self, simulation: Simulation) -> None:
        model, layout = simulation.model, simulation.layout
        if model is None:
            raise ValueError("only a run in MuJoCo can be measured")
        world = simulation.physical
        m, d = world.m, world.d
        self.simulation = simulation
        shadow = Shadow(m, d, layout.clearance + BEYOND)
        self.welds = ActiveWelds(m, d)
        velocities = Velocities(m, shadow.d)
        self.handoffs = HandOffs(m, self.welds, velocities)
        self.payload = Payload(self.welds, velocities, float(m.opt.timestep))
        self.drives = DriveFigures(world)
        self.approaches = Approaches(m, layout, self.welds, shadow)
        self.hidden = HiddenPenetrations.of(simulation)
        self.finished = Finished(model)
        self.residual = Residual(m, d, velocities.slides)
        self.seconds = 0.0
        self._seen = self._counts()
        self._steps = Steps(m, d, simulation.request.settings.steps)

    def run(self, max_time: float | None = None) -> Run:
        """Run and measure the simulation, with a monitor beside it unless it recovers: the monitor
        then judges its log (`record.monitor.calm`)."""
        if self.simulation.request.recovers:
            with self._steps:
                return self.simulation.run([self.observe], max_time)
        watcher = beside(self.simulation)
        with self._steps:
            run = self.simulation.run([self.observe, watcher.observe], max_time)
        report = watcher.report(run.lasting)
        self.seconds += report.time_s
        return replace(run, monitor=report)

    def observe(self, state: State) -> None:
        """Measure a tick. The shadow still has the configuration at the beginning of the tick, in
        which welds were switched."""
        begin, shadow = perf_counter(), self.approaches.shadow
        v, force = self._steps.take()
        counts = self._counts()
        if counts != self._seen:
            self._seen = counts
            fresh = self.welds.scan()
            xpos, xmat = shadow.d.xpos, shadow.d.xmat
            self.finished.tick(self.welds, fresh, xpos, xmat)
            if len(fresh):
                begun = state.time - (len(v) - 1) * self.payload.timestep
                self.handoffs.begin(fresh, begun, v[0], xpos, xmat)
        self.handoffs.tick(v, state.time)
        self.payload.tick(v)
        self.drives.tick(v, force)
        self.residual.tick(v[-1])
        shadow.follow()
        self.approaches.tick(self.simulation.supervisor.active.operations)
        self.hidden.look(state.observation.qpos, state.time)
        self.seconds += perf_counter() - begin

    def _counts(self) -> tuple[int, int]:
        """Numbers of firings and of finished products so far; welds are switched only with one of
        them."""
        world, supervisor = self.simulation.world, self.simulation.supervisor
        return len(supervisor.events), len(world.dropoffs)

    def figures(self) -> dict[str, float | None]:
        """The figures of the MuJoCo run alone, by the keys of their quantities."""
        handoffs, misplaced = self.handoffs.all(), self.finished.found()
        drives, payload, m = self.drives, self.payload, self.simulation.physical.m
        physics = self.simulation.physical.figures()
        return {
            "tracking_error_max_mm": 1e3 * drives.error,
            "tracking_error_p99_mm": 1e3 * drives.tracking.quantile(0.99),
            "tracking_error_rms_mm": 1e3 * drives.tracking.rms,
            "handoffs": sum(h.parts for h in handoffs),
            "handoff_gap_max_mm": max((h.gap_mm for h in handoffs), default=None),
            "speed_step_max_mm_s": max((h.speed_step_mm_s for h in handoffs), default=None),
            "impulse_max_mNs": max((h.impulse_mNs for h in handoffs), default=None),
            "handoff_energy_max_mJ_per_kg": max(
                (h.energy_mJ_per_kg for h in handoffs), default=None
            ),
            "weld_residual_max_mm": 1e3 * self.residual.largest,
            "weld_residual_p99_mm": 1e3 * self.residual.moving.quantile(0.99),
            "product_position_max_mm": max((m.position_mm for m in misplaced), default=None),
            "product_angle_max_deg": max((m.angle_deg for m in misplaced), default=None),
            "product_vertex_max_mm": max((m.vertex_mm for m in misplaced), default=None),
            "closest_approach_mm": 1e3 * self.approaches.closest(),
            "clearance_margin_mm": 1e3 * self.approaches.margin(),
            "hidden_penetration_max_mm": self.hidden.deepest(),
            "grip_gap_max_mm": physics.grip_gap_max_mm,
            "grip_strength_share_max": physics.grip_strength_share_max,
            "force_saturated_percent": 1e2 * drives.saturation,
            "force_peak_percent": 1e2 * drives.peak,
            "drive_work_J": drives.work,
            "payload_acceleration_max_m_s2": payload.acceleration.largest,
            "payload_acceleration_p99_m_s2": payload.acceleration.quantile(0.99),
            "payload_jerk_max_m_s3": payload.jerk.largest,
            "payload_jerk_p99_m_s3": payload.jerk.quantile(0.99),
            "moved_mass_kg": float(m.body_mass[m.body_treeid >= 0].sum()),
            "unintended_contacts": physics.unintended_contacts,
            "engine_warnings": physics.engine_warnings,
        }
