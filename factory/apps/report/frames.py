"""The motion of a run, compressed: poses of the bodies that move, frame by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Model, names
from factory.apps.exports import motion
from factory.apps.report.recording import Recording
from factory.apps.report.scene import Pack

RATE = motion.RATE / 3
"""Frames a second of a run that is not too long: a third of those in other exports."""

MOST = 4_000_000
"""Upper bound on the numbers in all frames; a longer run has fewer frames a second."""

UNITS = 10_000
"""Positions are whole tenths of a millimetre, components of quaternions whole 1/10000."""

TURNED = 2e-3
"""A change of a quaternion component up to which a body has a constant orientation."""


def frames(recording: Recording, pack: Pack) -> dict[str, Any]:
    """Poses relative to the parent body: `time` (n,) [s] and, for each body that moves,
    `x<body>` (3, n), `q<body>` (4, n) if it turns, go into the pack; the poses of all bodies at
    the start, and the parents, are returned."""
    seen = recording.motion
    m, rows = seen.m, seen.rows
    time = recording.log.time[rows]
    parts = {b for b in range(m.nbody) if names.kind(seen.name(b)) == "part"}
    moved = np.ptp(seen.position, axis=0).max(axis=1) > 0.5 / UNITS
    moving = [b for b in range(1, m.nbody) if moved[b] or b in parts]
    kept = _thinned(time, len(moving))
    pack.add("time", time[kept].astype(np.float32))
    turning = []
    for body in moving:
        pack.add(f"x{body}", planes(_whole(seen.position[kept, body])))
        turns = _continuous(seen.quaternion[kept, body])
        if np.ptp(turns, axis=0).max() > TURNED:
            turning.append(body)
            pack.add(f"q{body}", planes(_whole(turns)))
    return {
        "count": len(kept),
        "units": UNITS,
        "hidden": Model.HIDDEN,
        "moving": moving,
        "turning": turning,
        "parents": {str(b): int(p) for b, p in enumerate(m.body_parentid) if p and b},
        "position": np.round(seen.position[0], 5).tolist(),
        "quaternion": np.round(seen.quaternion[0], 6).tolist(),
    }


def _thinned(time: NDArray[np.float64], bodies: int) -> NDArray[np.int64]:
    """The frames that are kept, with the first and the last."""
    span = float(time[-1] - time[0])
    rate = min(RATE, max(1.0, MOST / (3 * max(1, bodies) * max(span, 1e-9))))
    wanted = np.arange(time[0], time[-1], 1 / rate)
    rows = np.searchsorted(time, wanted - 1e-9)
    return np.unique([0, *rows.tolist(), len(time) - 1]).astype(np.int64)


def _continuous(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same orientations, without jumps from a quaternion to its negative."""
    flips = np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0, -1.0, 1.0)
    return np.asarray(turns * np.cumprod([1.0, *flips])[:, None])


def _whole(values: NDArray[np.float64]) -> NDArray[np.int32]:
    return np.round(values.T * UNITS).astype(np.int32)


def planes(values: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Whole numbers as first differences along the last axis, byte plane by byte plane: slow
    changes give zeros, which compress well."""
    steps = np.diff(values.astype(np.int64), axis=-1, prepend=0).astype("<i4")
    return np.ascontiguousarray(steps.reshape(-1).view(np.uint8).reshape(-1, 4).T).reshape(-1)
