"""States of the engine that are put there to be looked at, and changes of a compiled model."""

from __future__ import annotations

from factory.control.mode import Array, Index
from factory.support.engine import mujoco


def pose(m: mujoco.MjModel, d: mujoco.MjData, qpos: Array) -> None:
    """Put everything where the coordinates `qpos` (nq,) say, and find where bodies are."""
    d.qpos[:] = qpos
    mujoco.mj_kinematics(m, d)


def aim_welds(m: mujoco.MjModel, d: mujoco.MjData, active: Index) -> None:
    """Switch on the constraints in `active` (k, 3), each with the two bodies that it joins, and all
    others off."""
    welds, first, second = active.T
    d.eq_active[:] = 0
    d.eq_active[welds] = 1
    m.eq_obj1id[welds], m.eq_obj2id[welds] = first, second


def soften_welds(m: mujoco.MjModel, factor: float) -> None:
    """Multiply the time constants of all welds by a factor."""
    m.eq_solref[:, 0] *= factor
