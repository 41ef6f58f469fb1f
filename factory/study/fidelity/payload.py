"""How hard payloads are shaken: acceleration in every step, jerk from tick to tick."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array
from factory.study.fidelity.histogram import Histogram
from factory.study.fidelity.welds import FEED, Velocities, Welds


class Payload:
    """Accelerations [m/s²] and jerks [m/s³] of parts held by robots and the tray. Parts in feeders
    and spare copies are left out, and with them the engine's only teleports."""

    def __init__(self, welds: Welds, velocities: Velocities, timestep: float) -> None:
        self.welds, self.velocities, self.timestep = welds, velocities, timestep
        self.acceleration, self.jerk = Histogram(), Histogram()
        self._mean = np.zeros((len(welds.kind), 3))
        self._held = np.zeros(len(welds.kind), bool)

    def tick(self, v: Array) -> None:
        """The steps of a tick, speeds (n + 1, nv)."""
        parts = self.welds.carried()
        if len(parts):
            linear = self.velocities.linear(v, parts)
            change = (linear[1:] - linear[:-1]) / self.timestep
            self.acceleration.add(_lengths(change))
            span = (len(v) - 1) * self.timestep
            mean = (linear[-1] - linear[0]) / span
            again = self._held[parts]
            jerk = (mean - self._mean[parts])[again] / span
            self.jerk.add(_lengths(jerk))
            self._mean[:] = 0.0
            self._mean[parts] = mean
        else:
            self._mean[:] = 0.0
        self._held = self.welds.kind >= FEED


def _lengths(vectors: Array) -> Array:
    """Of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
