"""Speeds and forces within a tick, step by step, without changing the run.

The engine calls its control callback in every step, when the state is that at the step's beginning
and the forces are still those of the step before. The callback only copies.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

import numpy as np

from factory.control.mode import Array
from factory.support.engine import mujoco


class Steps:
    """Speeds of all degrees of freedom and forces of all drives in the steps of the tick under
    way. Use as a context around the run; one at a time in a process."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, room: int) -> None:
        self._qvel, self._force = d.qvel, d.actuator_force
        self._v = np.zeros((room + 1, m.nv))
        self._f = np.zeros((room + 1, len(self._force)))
        self._t = np.zeros(room + 1)
        self._count = 0

    def __enter__(self) -> Self:
        mujoco.set_mjcb_control(self._step)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        mujoco.set_mjcb_control(None)

    def _step(self, m: Any, d: Any) -> None:
        at = int(np.searchsorted(self._t[: self._count], d.time))
        if (
            at == self._count
        ):  # else the step is repeated: it has woken a body, or something touched
            self._t[at], self._v[at], self._f[at] = d.time, self._qvel, self._force
        self._count = at + 1

    def take(self) -> tuple[Array, Array]:
        """Speeds (n + 1, nv) before, between and after the n steps since the last call, and the
        forces (n, nu) in them. Valid until the next step."""
        n, self._count = self._count, 0
        self._v[n] = self._qvel
        self._f[n] = self._force
        return self._v[: n + 1], self._f[1 : n + 1]
