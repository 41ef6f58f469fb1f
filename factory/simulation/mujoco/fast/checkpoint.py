"""The state that some steps of the engine began in, to take them again."""

from __future__ import annotations

from typing import Any

import numpy as np

from factory.support.engine import mujoco

ASLEEP = int(mujoco.mjtSleepState.mjS_ASLEEP)
"""What the engine has for a body that sleeps."""

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
        """Go back. What has been woken since must be where it slept, with all that follows from
        it, before it sleeps again: the engine does not look at sleepers."""
        m, d = self.m, self.d
        mujoco.mj_setState(m, d, self._state, STATE)
        mujoco.mj_forward(m, d)
        mujoco.mj_setState(m, d, self._state, STATE)
        d.tree_asleep[:] = self._asleep
        tell_who_is_awake(m, d)


def tell_who_is_awake(m: mujoco.MjModel, d: mujoco.MjData) -> None:
    """Make the engine's lists of who is awake agree with `tree_asleep`; it makes them anew only
    when it wakes somebody or puts somebody to sleep."""
    d.tree_awake[:] = d.tree_asleep < 0
    trees = m.body_treeid >= 0
    d.body_awake[trees] = d.tree_awake[m.body_treeid[trees]]
    parents = d.body_awake[m.body_parentid] != ASLEEP
    parents[0] = False
    d.ntree_awake = int(d.tree_awake.sum())
    d.nbody_awake = _list(d.body_awake_ind, d.body_awake != ASLEEP)
    d.nparent_awake = _list(d.parent_awake_ind, parents)
    d.nv_awake = _list(d.dof_awake_ind, d.tree_awake[m.dof_treeid] != 0)


def _list(listed: Any, chosen: Any) -> int:
    """Write the numbers of those that are chosen; gives how many there are."""
    (numbers,) = np.nonzero(chosen)
    listed[: len(numbers)] = numbers
    return len(numbers)
