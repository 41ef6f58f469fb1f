"""The state that some steps of the engine began in, to take them again."""

from __future__ import annotations

import numpy as np

from factory.engine import mujoco

STATE = sum(
    int(getattr(mujoco.mjtState, f"mjSTATE_{part}"))
    for part in ("TIME", "QPOS", "QVEL", "ACT", "WARMSTART")
)
"""All that a step of the engine goes on from, but what only the world writes, and who sleeps."""


class Rewind:
    """Takes an engine's data back to where it was at the last `save`: the next steps are the same
    again, to the last bit."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.m, self.d = m, d
        self._state = np.empty(mujoco.mj_stateSize(m, STATE))
        self._asleep = d.tree_asleep.copy()

    def save(self) -> None:
        """Remember where it is."""
        mujoco.mj_getState(self.m, self.d, self._state, STATE)
        self._asleep[:] = self.d.tree_asleep

    def restore(self) -> None:
        """Go back. What has been woken since must be where it slept before it sleeps again: the
        engine does not look where sleepers are."""
        mujoco.mj_setState(self.m, self.d, self._state, STATE)
        mujoco.mj_kinematics(self.m, self.d)
        mujoco.mj_comPos(self.m, self.d)
        self.d.tree_asleep[:] = self._asleep
