"""What is left out of the broad phase: nothing that moves, and nothing that can be met."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from factory.engine.mjcf.masks import NOBODY
from factory.engine.simulation.mujoco.fast import neighbours
from factory.engine.simulation.mujoco.fast.strides import Strides
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from tests.simulation_values import ready


@pytest.fixture(autouse=True)
def _in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


def solid_bodies(m: mujoco.MjModel) -> np.ndarray:
    """The bodies that can collide, by the masks of their geoms, which nothing is left out of."""
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    return np.unique(m.geom_bodyid[solid])


def boxes(m: mujoco.MjModel, d: mujoco.MjData, bodies: np.ndarray) -> np.ndarray:
    """The boxes (n, 2, 3) that the engine's broad phase has for bodies, in the world's axes."""
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    turn = d.geom_xmat.reshape(-1, 3, 3)
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    found = np.empty((m.nbody, 2, 3))
    found[:, 0], found[:, 1] = np.inf, -np.inf
    np.minimum.at(found[:, 0], m.geom_bodyid[solid], (middle - half)[solid])
    np.maximum.at(found[:, 1], m.geom_bodyid[solid], (middle + half)[solid])
    return np.asarray(found[bodies])


def within_boxes(simulation: Simulation) -> bool:
    """Whether all that holders have is within the boxes that they are to sweep."""
    world = simulation.physical
    m, d, stepping_ = world.m, world.d, world.motion.stepping
    assert isinstance(stepping_, Strides)
    mujoco.mj_kinematics(m, d)
    code, bodies = world.parts.masks.code, solid_bodies(m)
    bodies = bodies[code[bodies] != NOBODY]
    low, high = boxes(m, d, bodies).transpose(1, 0, 2)
    least, most = (corners.T[code[bodies]] for corners in stepping_._neighbours.boxes())
    return bool((least <= low[:, :2]).all() and (high[:, :2] <= most).all())


@pytest.mark.parametrize(("name", "given"), [("tee", {}), ("bar", {})])
def test_what_a_holder_has_is_within_its_box(name: str, given: dict[str, Any]) -> None:
    simulation = ready(name, **given)
    while simulation.physical.time < 8.0:
        for _ in range(10):
            simulation.supervisor.step()
        assert within_boxes(simulation)
