"""The fidelity of a recorded run: figures from the log and, where there is a layout, against the
ideal world."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factory.mjcf import names
from factory.mjcf.pads import Pads
from factory.mjcf.parts import HIDDEN
from factory.mjcf.replica import Replica
from factory.mjcf.weld_frames import FEED, GRIP, HOLD, gaps
from factory.plant.approaches import Pair
from factory.record.state import Event
from factory.record.verdict import STRENGTH
from factory.show.report.recording import Recording
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.study.analysis.measured import conditions
from factory.study.fidelity.causality import causal_record, duration_differences
from factory.study.fidelity.readings import ActiveWelds

EVERY = 5
"""Number of ticks between two measurements of the residuals of welds."""


def fidelity(recording: Recording) -> dict[str, float | None]:
    """The figures of a recording, by the keys of their definitions."""
    monitor = recording.monitor
    return {
        "monitor_violations": None if monitor is None else float(len(monitor.violations)),
        **_welds(recording),
        STRENGTH: (recording.log.figures or {}).get(STRENGTH),
        "tracking_error_max_mm": _tracking(recording),
        **_ideal(recording),
    }


def excluded(recording: Recording) -> tuple[Pair, ...]:
    """The pairs of parts that are excluded from contact in the recorded model."""
    m = recording.motion.m
    pairs = (names.excluded(m.exclude(i).name) for i in range(m.nexclude))
    return tuple(dict.fromkeys(pairs))


def _tracking(recording: Recording) -> float | None:
    """Largest distance of an axis from its setpoint at the end of a tick [mm]."""
    log, m = recording.log, recording.motion.m
    if log.ctrl is None:
        return None
    joint, setpoint = m.jnt_qposadr[m.actuator_trnid[:, 0]], m.actuator_ctrladr
    rows = (log.qpos[row][joint] - log.ctrl[row][setpoint] for row in range(len(log)))
    return 1e3 * max(float(np.abs(error).max(initial=0.0)) for error in rows)


def _welds(recording: Recording) -> dict[str, float | None]:
    """Number of hand-offs, largest gaps, residual and displacement of a part in the product
    [mm]."""
    log, replica = recording.log, Replica(recording.motion.m)
    m, d = replica.m, replica.d
    replica.switch(log.active[0])
    welds = ActiveWelds(m, d)
    pads, residual, product = Pads(m), 0.0, 0.0
    handoffs, finished = 0, bool(log.delivered[-1])
    replica.place(log.qpos[0])
    fed = np.flatnonzero(welds.active & (welds.kinds == FEED))
    gap, grip_gap = 0.0, pads.first_taken(d, fed, fed)
    for row, switched in _rows(recording):
        if switched:
            replica.place(log.qpos[row - 1])
            replica.switch(log.active[row])
            fresh = welds.scan()
            fresh = fresh[
                d.xpos[m.eq_obj2id[fresh], 2] > HIDDEN
            ]  # without bodies that replace others
            handoffs += len(fresh)
            gap = max(gap, float(gaps(m, fresh, d.xpos, d.xmat).max(initial=0.0)))
            taken = pads.first_taken(d, fresh, np.flatnonzero(welds.active))
            grip_gap = max(grip_gap, taken, key=lambda apart: apart or 0.0)
            continue
        replica.place(log.qpos[row])
        on = np.flatnonzero(welds.active & (welds.kinds >= GRIP))
        residual = max(residual, float(gaps(m, on, d.xpos, d.xmat).max(initial=0.0)))
        held = np.flatnonzero(welds.active & (welds.kinds == HOLD))
        if len(held):
            off = d.xpos[m.eq_obj2id[held]] - m.eq_data[held, 3:6]
            product = max(product, float(np.linalg.norm(off - off[0], axis=1).max()))
    return {
        "handoffs": float(handoffs),
        "handoff_gap_max_mm": 1e3 * gap,
        "grip_gap_max_mm": None if grip_gap is None else 1e3 * grip_gap,
        "weld_residual_max_mm": 1e3 * residual,
        "product_position_max_mm": 1e3 * product if finished else None,
    }


def _rows(recording: Recording) -> Iterator[tuple[int, bool]]:
    """The measured rows of the log, and whether welds are switched there."""
    active = recording.log.active
    for row in range(1, len(recording.log)):
        if active.starts[row] != active.starts[row - 1]:
            yield row, True
        elif row % EVERY == 0:
            yield row, False


def _ideal(recording: Recording) -> dict[str, float | None]:
    """Durations of operations less those in the ideal world, in which ẋ = F [s]."""
    if recording.layout is None:
        return {}
    log, net = recording.log, recording.factory.net
    made = conditions(log.header)
    if not recording.from_start or not log.delivered[-1]:
        return {}
    units = int(log.delivered[-1])
    ideal = Simulation(
        recording.layout,
        RunRequest(
            "ideal",
            units=units,
            seed=made.seed,
            jitter=made.jitter,
            settings=made.settings,
            wip=made.wip,
        ),
    ).run()
    events = [Event(t, name) for t, name in log.lasting]
    differences = duration_differences(
        causal_record(net, ideal.lasting), causal_record(net, events)
    )
    if not len(differences):
        return {}
    return {
        "duration_difference_mean_s": float(differences.mean()),
        "duration_difference_max_s": float(differences[np.abs(differences).argmax()]),
    }
