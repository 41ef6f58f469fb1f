"""Dry friction of guides: a constant, and a share of the load's weight."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf.model import GRAVITY, ROLLING
from factory.simulation.mujoco.axes import Across
from factory.support.engine import mujoco


class Guides:
    """The guides of axes with degrees of freedom `dof` (axes,). `empty` (axes,): friction without a
    load [N], as in the model."""

    def __init__(self, m: mujoco.MjModel, dof: Index, across: Across) -> None:
        self._m, self._dof, self._across = m, dof, across
        self.empty = m.dof_frictionloss[dof].copy()
        self._loads = np.zeros(len(dof))

    def load(self, axes: Index, loads: Array) -> None:
        """Set the loads of axes beside their own weight [kg]."""
        self._loads[axes] = loads
        self._rub(axes)

    def rub(self, axes: Index, newtons: float) -> None:
        """Set the friction of empty axes [N]."""
        self.empty[axes] = newtons
        self._rub(axes)

    def _rub(self, axes: Index) -> None:
        weight = self._loads[axes] * GRAVITY
        self._m.dof_frictionloss[self._dof[axes]] = self.empty[axes] + ROLLING * weight
        which, rows = self._across.among(np.asarray(axes))
        if len(rows):
            same = self._m.dof_frictionloss[self._dof[np.asarray(axes)[which]]]
            self._m.dof_frictionloss[self._across.dof[rows]] = same[:, None]
