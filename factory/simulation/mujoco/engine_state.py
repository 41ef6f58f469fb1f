"""The engine's own state between two ticks: what its next step depends on, and where bodies were as
the last one began, which is what is measured between steps."""

from __future__ import annotations

import numpy as np

from factory.simulation.keeping import Keeper
from factory.simulation.mujoco.sleep import AWAKE, FRESH
from factory.support.engine import mujoco

STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart", "eq_active")
"""Of `mjData`, what a step reads that is not of the one before."""

SEEN = ("xpos", "xquat", "xmat")
"""Where bodies were as the last step began."""


def keep_engine(keeper: Keeper, m: mujoco.MjModel, d: mujoco.MjData) -> None:
    """Time, state, setpoints, which welds are on and on what they aim, what sleeps, warnings; a
    weld that is off may aim anywhere. Raises ValueError where the engine could not go on from
    there."""
    time = keeper.number("time", float(d.time), 0)
    aims = m.eq_obj2id.copy()
    keeper.array("engine.eq_obj2id", aims, 0, m.nbody - 1)
    kept = {name: getattr(d, name).copy() for name in (*STATE, *SEEN)}
    for name, values in kept.items():
        keeper.array(f"engine.{name}", values, *((0, 1) if name == "eq_active" else ()))
    asleep, history = d.tree_asleep.copy(), d.history.copy()
    keeper.array("engine.tree_asleep", asleep, -1 - int(mujoco.mjMINAWAKE), m.ntree - 1)
    keeper.array("engine.history", history)
    warned = np.array([warning.number for warning in d.warning])
    keeper.array("engine.warnings", warned, 0)
    if not keeper.takes_up:
        return
    _check_asleep(asleep)
    _check_newest(m, history)
    d.time, m.eq_obj2id[:], d.history[:] = time, aims, history
    for name in STATE:
        getattr(d, name)[:] = kept[name]
    _set_asleep(m, d, np.full_like(asleep, FRESH))
    _set_asleep(m, d, asleep)
    for name, values in kept.items():
        getattr(d, name)[:] = values
    if not (asleep >= 0).all():
        d.tree_asleep[:] = asleep
    for warning, number in zip(d.warning, warned.tolist(), strict=True):
        warning.number = number


def _set_asleep(m: mujoco.MjModel, d: mujoco.MjData, asleep: np.ndarray) -> None:
    """Let these trees sleep and the others be awake, and derive what a step does from that. The
    engine renews its lists of what is awake where it wakes something: one that is, put to sleep
    by itself before. Where all sleep, the ring of the first is woken, and falls asleep again."""
    sleeps = asleep >= 0
    first = int(sleeps.argmin())
    d.tree_asleep[:] = asleep
    if not sleeps[first]:
        d.tree_asleep[first] = first
        sleeps[first] = True
    d.tree_awake[:] = ~sleeps
    d.qvel[sleeps[m.dof_treeid]] = 0.0
    d.qvel[m.tree_dofadr[first]] = AWAKE
    mujoco.mj_forward(m, d)


def _check_asleep(asleep: np.ndarray) -> None:
    """Trees that sleep wake each other in rings: each has the number of the next."""
    (sleeping,) = (asleep >= 0).nonzero()
    if sorted(asleep[sleeping].tolist()) != sleeping.tolist():
        raise ValueError("what sleeps in it is not asleep in rings")


def _check_newest(m: mujoco.MjModel, history: np.ndarray) -> None:
    """The second number of an actuator's buffer is that of its newest sample."""
    samples, at = m.actuator_history[:, 0], m.actuator_historyadr
    newest = history[at[samples > 0] + 1]
    if ((newest != newest.round()) | (newest < 0) | (newest >= samples[samples > 0])).any():
        raise ValueError("the newest setpoints in it are none of the buffers'")
