"""The scalar law of an arm on a way: with x the coordinate of the way g, the torques are
τ = α(x) ẍ + β(x) ẋ² + γ(x), where α = M g', β = M g" + C(g, g') g', γ the weight.

They are affine in (ẍ, ẋ²): limits hold for all |ẍ| <= A and |ẋ| <= V if and only if they hold in
the four corners. Each is one pass of the recursive Newton-Euler algorithm (Featherstone, Rigid Body
Dynamics Algorithms, 2008), in the base frame.
"""

from __future__ import annotations

import numpy as np

from factory.apps.arms.chain import SerialChain, cross
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.support.arrays import Array

GRAVITY = np.array([0.0, 0.0, -9.81])
"""In the base frame of an arm that stands upright [m/s²]."""

PLACES = 300
"""Number of places on a way at which torques are computed."""


def torques(chain: SerialChain, q: Array, speed: Array, acceleration: Array) -> Array:
    """Torques or forces (..., n) of the drives without gravity [N m, N].

    Args:
        chain: the arm.
        q: configurations (..., n) [rad, m].
        speed: of the joints (..., n) [rad/s, m/s].
        acceleration: of the joints (..., n) [rad/s², m/s²].
    """
    place, turn = chain.frames(q)
    axis = (turn[..., 1:, :, :] @ chain.axis[..., None])[..., 0]
    arm = (turn[..., 1:, :, :] @ chain.inertia.center[..., None])[..., 0]
    spin = turn_rate = rise = np.zeros((*q.shape[:-1], 3))
    force, couple = np.zeros_like(axis), np.zeros_like(axis)
    for j, slides in enumerate(chain.slides):
        step = place[..., j + 1, :] - place[..., j, :]
        rise = rise + cross(turn_rate, step) + cross(spin, cross(spin, step))
        fast, push = (v[..., j, None] * axis[..., j, :] for v in (speed, acceleration))
        if slides:
            rise = rise + push + 2 * cross(spin, fast)
        else:
            turn_rate = turn_rate + push + cross(spin, fast)
            spin = spin + fast
        body, tensor = arm[..., j, :], turn[..., j + 1, :, :]
        tensor = tensor @ chain.inertia.moment[j] @ np.swapaxes(tensor, -1, -2)
        pull = rise + cross(turn_rate, body) + cross(spin, cross(spin, body))
        force[..., j, :] = chain.inertia.mass[j] * pull
        momentum = (tensor @ spin[..., None])[..., 0]
        couple[..., j, :] = (tensor @ turn_rate[..., None])[..., 0] + cross(spin, momentum)
    couple += cross(arm, force)
    return _joint_torques(chain, place, axis, force, couple) + chain.inertia.rotor * acceleration


def weights(chain: SerialChain, q: Array) -> Array:
    """Torques or forces (..., n) by which the drives bear the weight of the links [N m, N].

    Args:
        chain: the arm.
        q: configurations (..., n) [rad, m].
    """
    place, turn = chain.frames(q)
    axis = (turn[..., 1:, :, :] @ chain.axis[..., None])[..., 0]
    arm = (turn[..., 1:, :, :] @ chain.inertia.weight_center[..., None])[..., 0]
    force = np.broadcast_to(-chain.inertia.weight[:, None] * GRAVITY, arm.shape)
    return _joint_torques(chain, place, axis, force, cross(arm, force))


def _joint_torques(
    chain: SerialChain, place: Array, axis: Array, force: Array, couple: Array
) -> Array:
    """Torques (..., n) of the joints that bear forces and couples (..., n, 3) at the origins of
    their frames and of all after them."""
    borne = np.zeros(axis.shape[:-1])
    pull = twist = np.zeros((*axis.shape[:-2], 3))
    for j in reversed(range(len(chain))):
        if j + 1 < len(chain):
            twist = twist + cross(place[..., j + 2, :] - place[..., j + 1, :], pull)
        pull, twist = pull + force[..., j, :], twist + couple[..., j, :]
        along = pull if chain.slides[j] else twist
        borne[..., j] = (along * axis[..., j, :]).sum(axis=-1)
    return borne


def scalar_law(
    chain: SerialChain, g: Array, first: Array, second: Array
) -> tuple[Array, Array, Array]:
    """α, β and γ (..., n), which are the feed-forward of the drives too.

    Args:
        chain: the arm, with its payload.
        g: configurations on the way (..., n) [rad, m].
        first: g' there (..., n).
        second: g" there (..., n).
    """
    rest = np.zeros_like(g)
    alpha, beta = torques(chain, g, rest, first), torques(chain, g, first, second)
    return alpha, beta, weights(chain, g)


def torque_share(chain: SerialChain, way: JointWay, pace: WayLimits, damping: Array) -> Array:
    """Greatest share (n,) of its limit that each drive needs, at equal distances along a way.

    Args:
        chain: the arm, with its payload.
        way: followed by it.
        pace: limits of the way's coordinate.
        damping: of the joints (n,) [N m s/rad, N s/m].
    """
    g, first, second = way.at(np.linspace(0.0, way.length, PLACES))
    alpha, beta, gamma = scalar_law(chain, g, first, second)
    push = np.abs(alpha) * pace.acceleration
    drag = np.abs(damping * first) * pace.speed
    ends = [np.abs(gamma) + push, np.abs(gamma + pace.speed**2 * beta) + push + drag]
    return np.asarray(np.max(ends, axis=(0, 1)) / chain.limits.torque)
