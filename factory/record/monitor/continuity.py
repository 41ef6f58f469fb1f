"""Whether the states of a log go together: what moves along a rail is where its speeds bring it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from factory.mjcf.weld_frames import SLIDE
from factory.record.log.reader import Log
from factory.record.monitor.report import Violation

JUMP = 3e-4
"""A joint is no further than this from where its speeds bring it in a tick [m]; honest logs stay
below a tenth of it."""


SPAN = 20_000
"""So many ticks are looked at at once."""


def jumps(log: Log, m: Any) -> Iterator[Violation]:
    """The first tick in which each slide joint is elsewhere than its speeds at both ends of the
    tick, or any between these, bring it."""
    slides, found = np.flatnonzero(m.jnt_type == SLIDE), set[int]()
    at, moves = m.jnt_qposadr[slides], m.jnt_dofadr[slides]
    for first in range(0, len(log) - 1, SPAN):
        rows = range(first, min(first + SPAN + 1, len(log)))
        q = np.array([log.qpos[row][at] for row in rows])
        v = np.array([log.qvel[row][moves] for row in rows])
        spent = np.diff(log.time[rows.start : rows.stop])[:, None]
        gone = np.diff(q, axis=0) - spent * (v[1:] + v[:-1]) / 2
        off = np.abs(gone) - spent * np.abs(np.diff(v, axis=0)) / 2
        for joint in sorted({*np.flatnonzero((off > JUMP).any(axis=0)).tolist()} - found):
            found.add(joint)
            row = int((off[:, joint] > JUMP).argmax())
            name = m.joint(int(slides[joint])).name
            words = f"{name} jumps by {1e3 * abs(gone[row, joint]):.1f} mm within a tick"
            yield Violation(float(log.time[first + row + 1]), "", "", "Record", words)
