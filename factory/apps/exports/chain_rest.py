"""Robots whose first axes move several joints, at rest where a run starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from factory.api import Layout, LayoutMachines, names

if TYPE_CHECKING:
    from factory.support.engine import mujoco


@dataclass(frozen=True, slots=True)
class JointRest:
    """A joint at rest.

    Attributes:
        joint: its name.
        actuator: the name of its drive.
        position: its coordinate [rad, m].
        setpoint: of a `position` actuator that holds it there against gravity [rad, m].
    """

    joint: str
    actuator: str
    position: float
    setpoint: float


def joints_at_rest(layout: Layout) -> list[JointRest]:
    """The joints of a layout's chains; none where there are no chains."""
    if layout.chains is None:
        return []
    chains, factory = layout.chains, layout.factory
    at = LayoutMachines(layout).starts(factory.net.initial_marking)
    made = list[JointRest]()
    for robot in chains.robots:
        row = np.array([chains.row(factory.first(robot).index, robot)])
        x, still = at[[robot]], np.zeros(1)
        places = chains.curves.at(row, x)[0][0]
        forces = chains.curves.force(row, (x, still, still), still, still)[0]
        named = names.moved_along(factory.robots[robot])
        for (joint, actuator), q, force, (kp, _, _) in zip(
            named, places.tolist(), forces.tolist(), chains.drives(robot), strict=True
        ):
            made.append(JointRest(joint, actuator, q, q + force / kp))
    return made


def key_values(m: mujoco.MjModel, rests: list[JointRest]) -> tuple[np.ndarray, np.ndarray]:
    """Positions of all joints (nq,) of a compiled model, and its setpoints (nu,), with some joints
    at rest and all else where the model starts."""
    qpos, ctrl = m.qpos0.copy(), np.zeros(m.nu)
    for rest in rests:
        qpos[m.joint(rest.joint).qposadr[0]] = rest.position
        ctrl[m.actuator(rest.actuator).id] = rest.setpoint
    return qpos, ctrl
