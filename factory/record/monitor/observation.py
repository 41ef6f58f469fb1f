"""The observation of a factory after a tick: the state of the engine and its active constraints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Observation:
    """The state at a time [s]: the engine's `qpos`, `qvel` and setpoints `ctrl`; `welds` (k, 3):
    the active constraints by number, and the two bodies that each joins. `at_end`: made as
    operations ended and parts changed hands, before the engine continued; others are made after a
    tick.

    Until a constraint is switched or reassigned, `welds` is the same array."""

    time: float
    qpos: Array = field(repr=False)
    qvel: Array = field(repr=False)
    ctrl: Array = field(repr=False)
    welds: Index = field(repr=False)
    at_end: bool = False

    def kept(self) -> Observation:
        """The same, with arrays of its own."""
        state = self.qpos.copy(), self.qvel.copy(), self.ctrl.copy()
        return Observation(self.time, *state, self.welds, self.at_end)


class EngineView:
    """Observes a running engine: its model `m` and data `d`."""

    def __init__(self, m: Any, d: Any) -> None:
        self.m, self.d = m, d
        self._seen = (b"", b"", b"")
        self._welds: Index = np.empty((0, 3), np.intp)

    def look(self, at_end: bool = False) -> Observation:
        """The present state; its arrays are the engine's own and change with the next tick."""
        d = self.d
        return Observation(float(d.time), d.qpos, d.qvel, d.ctrl, self.welds(), at_end)

    def welds(self) -> Index:
        """The active constraints (k, 3), as of an `Observation`."""
        m, d = self.m, self.d
        seen = d.eq_active.tobytes(), m.eq_obj2id.tobytes(), m.eq_obj1id.tobytes()
        if seen != self._seen:
            self._seen = seen
            on = np.flatnonzero(d.eq_active)
            self._welds = np.stack([on, m.eq_obj1id[on], m.eq_obj2id[on]], axis=1)
        return self._welds
