"""The fidelity of a recorded run: the figures of its bodies, by its log and its monitor, and its
tracking errors."""

from __future__ import annotations

import numpy as np

from factory.mjcf import names
from factory.plant.approaches import Pair
from factory.record.monitor.recount import worst
from factory.record.verdict import LIMITS, STRENGTH
from factory.show.report.recording import Recording


def fidelity(recording: Recording) -> dict[str, float | None]:
    """The figures of a recording, by the keys of their definitions: for each the greater of what
    the log holds and what its monitor recomputes."""
    monitor, figures = recording.monitor, recording.log.figures or {}
    if monitor is not None and monitor.figures is not None:
        figures = worst(figures, monitor.figures)
    return {
        "monitor_violations": None if monitor is None else float(len(monitor.violations)),
        **{key: figures.get(key) for key in (*(limit.figure for limit in LIMITS), STRENGTH)},
        "tracking_error_max_mm": _tracking(recording),
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
