"""Sleep: the engine skips slow kinematic trees until they are woken."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.support.arrays import Index
from factory.support.engine import mujoco

MAY_SLEEP, STAYS_AWAKE = (
    int(getattr(mujoco.mjtSleepPolicy, f"mjSLEEP_{name}")) for name in ("ALLOWED", "NEVER")
)

AWAKE = -0.0
"""Written over a speed of zero it wakes a sleeping body and changes nothing else."""

FRESH = -1 - int(mujoco.mjMINAWAKE)
"""The engine's number of a tree that has just begun to be slow."""


class Sleep:
    """Keeps axes awake, by their kinematic `trees` (axes,), and wakes bodies."""

    def __init__(self, arrays: ModelArrays, d: mujoco.MjData, trees: Index) -> None:
        m, self._policy = arrays.m, arrays["tree_sleep_policy"]
        self._m, self._d, self._trees = m, d, trees
        self._tree = np.where(m.body_dofnum > 0, m.body_treeid, -1)
        self._awake = np.zeros(len(trees), bool)

    def stay_awake(self, axes: Index) -> None:
        """Keep the axes of an active mode awake: a robot asleep would ignore its next setpoint."""
        new = axes[~self._awake[axes]]
        if len(new):
            self._awake[new] = True
            self._policy[self._trees[new]] = STAYS_AWAKE
            self._rouse(self._trees[new])

    def may_sleep(self, axes: Index) -> None:
        """Let axes sleep that are in no active mode, except in trees with an awake axis."""
        self._awake[axes] = False
        self._policy[self._trees[axes]] = MAY_SLEEP
        self._policy[self._trees[self._awake]] = STAYS_AWAKE

    def wake(self, bodies: Iterable[int]) -> None:
        """Wake bodies that sleep, and keep those awake that are about to fall asleep."""
        trees = self._tree[np.fromiter(bodies, np.intp)]
        self._rouse(trees[trees >= 0])

    def _rouse(self, trees: Index) -> None:
        asleep, speed = self._d.tree_asleep, self._d.qvel
        awake = asleep[trees] < 0
        asleep[trees[awake]] = FRESH
        dofs = self._m.tree_dofadr[trees[~awake]]
        speed[dofs[speed[dofs] == 0.0]] = AWAKE
