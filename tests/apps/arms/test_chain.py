"""Chains move, weigh and resist as the engine's do."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.dynamics import scalar_law, torque_share, torques, weights
from factory.apps.arms.joint_way import JointWay
from tests.arm_models import PACE, both, configurations, random_way, shipped

SEEDS = range(30)


def test_frames_and_jacobians_are_those_of_the_engine() -> None:
    for seed in range(8):
        chain, m, d = both(seed)
        q = configurations(chain, 5, seed)
        place, turn, columns = chain.tool_and_jacobian(q)
        rows = np.zeros((6, len(chain)))
        for number in range(len(q)):
            d.qpos[:] = q[number]
            mujoco.mj_forward(m, d)
            mujoco.mj_jacSite(m, d, rows[:3], rows[3:], 0)
            home, stand = base_of(m, d)
            assert np.abs(home.T @ (d.site_xpos[0] - stand) - place[number]).max() < 1e-12
            assert np.abs(home.T @ d.site_xmat[0].reshape(3, 3) - turn[number]).max() < 1e-12
            there = np.vstack([home.T @ rows[:3], home.T @ rows[3:]])
            assert np.abs(there - columns[number]).max() < 1e-12


def base_of(m: mujoco.MjModel, d: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Orientation and place of the body that a random arm stands on."""
    base = 0 if m.body_jntnum[1] else 1
    return d.xmat[base].reshape(3, 3), d.xpos[base]


def test_torques_are_those_of_the_engine() -> None:
    for seed in range(8):
        chain, m, d = both(seed)
        rng = np.random.default_rng(seed)
        q = configurations(chain, 4, seed)
        first, second = rng.normal(size=(2, *q.shape))
        mujoco.mj_forward(m, d)
        home, _ = base_of(m, d)
        alpha, beta, gamma = scalar_law(chain, q, first, second, home.T @ [0.0, 0.0, -9.81])
        for number, (fast, push) in enumerate(rng.normal(size=(len(q), 2))):
            d.qpos[:], d.qvel[:] = q[number], first[number] * fast
            d.qacc[:] = first[number] * push + second[number] * fast**2
            mujoco.mj_inverse(m, d)
            law = alpha[number] * push + beta[number] * fast**2 + gamma[number]
            assert np.abs(law - d.qfrc_inverse).max() < 1e-9


def test_a_payload_is_a_body_at_the_tool() -> None:
    """The kinetic energy of the loaded chain is that of the chain and of the load."""
    for seed in range(8):
        chain, _, _ = both(seed)
        rng = np.random.default_rng(seed)
        center, moment = rng.normal(size=3) * 0.1, np.diag([0.01, 0.02, 0.015])
        loaded = chain.with_payload(2.0, center, moment)
        q, speed = configurations(chain, 1, seed), rng.normal(size=(1, len(chain)))
        _, turn, columns = chain.tool_and_jacobian(q)
        velocity, spin = np.split(columns[0] @ speed[0], 2)
        velocity = velocity + np.cross(spin, turn[0] @ center)
        tensor = turn[0] @ moment @ turn[0].T
        energy = 2.0 * velocity @ velocity + spin @ tensor @ spin
        rest = np.zeros_like(speed)
        more = torques(loaded, q, rest, speed) - torques(chain, q, rest, speed)
        assert float((more * speed).sum()) == pytest.approx(energy, rel=1e-9)
        weight = weights(loaded, q) - weights(chain, q)
        assert float((weight * speed).sum()) == pytest.approx(2.0 * 9.81 * velocity[2], rel=1e-9)


def test_no_point_is_faster_than_its_levers() -> None:
    """Levers bound the Jacobian of every point of a body, and are no idle bound."""
    used = 0.0
    for seed in SEEDS:
        chain, _, _ = both(seed)
        q, frame = configurations(chain, 100, seed), len(chain)
        points = np.random.default_rng(seed).normal(size=(3, 3)) * 0.1
        lever = chain.lever(frame, points)
        columns = np.array([chain.point_jacobian(q, frame, point)[:, :3] for point in points])
        speed = np.linalg.norm(columns, axis=2).max(axis=(0, 1))
        assert (speed <= lever + 1e-12).all()
        used = max(used, float((speed / lever)[~chain.slides].max(initial=0.0)))
    assert used > 0.95


def test_a_lever_is_the_length_of_the_chain() -> None:
    """From the shoulder of the shipped arm straight up to its wrist, and a slide's is 1."""
    six, scara = shipped("six"), shipped("scara")
    point = np.zeros((1, 3))
    assert six.lever(4, point)[1] == pytest.approx(
        np.hypot(0.131, 0.425) + np.hypot(0.126, 0.392), abs=1e-9
    )
    assert six.lever(3, point)[3:].tolist() == [0.0, 0.0, 0.0]
    elbow = np.hypot(0.25, 0.18) + 0.05
    shoulder = np.hypot(0.25, 0.06) + elbow
    assert scara.lever(4, point).tolist() == pytest.approx([shoulder, elbow, 1.0, 0.0])
    assert six.levers([ConvexBody("point", 3, point, 0.1)])[0, 2] == pytest.approx(0.1)


def test_torque_shares_are_those_of_the_worst_corner() -> None:
    """As great as at any speed and acceleration within the limits, and met at one of them."""
    chain = shipped("six").with_payload(1.0, np.array([0.0, 0.0, 0.05]), np.eye(3) * 1e-3)
    way = random_way(chain, 5)
    share = torque_share(chain, way, PACE)
    g, first, second = way.at(np.linspace(0.0, way.length, 300))
    alpha, beta, gamma = scalar_law(chain, g, first, second)
    rng = np.random.default_rng(0)
    most = np.zeros(len(chain))
    for fast, push in [*rng.uniform(-1, 1, (200, 2)), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0)]:
        force = alpha * push * PACE.acceleration + beta * (fast * PACE.speed) ** 2 + gamma
        most = np.maximum(most, np.abs(force / chain.limits.torque).max(axis=0))
    assert (most <= share + 1e-12).all()
    assert (most >= 0.95 * share).all()


def test_a_heavier_payload_needs_more_torque() -> None:
    chain = shipped("six")
    way = JointWay(np.linspace(0.0, 1.0, 4), np.linspace([0, 1.5, 0, 0, 0, 0], [1.0] * 6, 4))

    def share(mass: float) -> float:
        loaded: SerialChain = chain.with_payload(mass, np.zeros(3), np.zeros((3, 3)))
        return float(torque_share(loaded, way, PACE)[1])

    assert share(5.0) > share(1.0) > share(1e-9)
    weak = replace(chain, limits=replace(chain.limits, torque=chain.limits.torque / 2))
    assert torque_share(weak, way, PACE) == pytest.approx(2 * torque_share(chain, way, PACE))
