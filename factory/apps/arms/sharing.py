"""What two arms at one station share: how far one must have gone before the other may come.

A link is taken for a capsule or a ball that contains it, a payload for a ball.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from factory.api import Array, mujoco
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.scene import Scene
from factory.apps.arms.travel import travels

SAMPLES = 96
"""Number of places on a way."""

BETWEEN = 0.01
"""Least distance of two arms that may move without waiting for each other [m]."""


@dataclass(frozen=True, eq=False)
class SweptArm:
    """The capsules of an arm on a way.

    Attributes:
        ends: of their axes (SAMPLES, k, 2, 3) [m].
        radius: (k,) [m].
        between: the most that a point of them moves from one sample to the next [m].
    """

    ends: Array
    radius: Array
    between: float

    @classmethod
    def of(
        cls,
        scene: Scene,
        chain: SerialChain,
        way: JointWay,
        carried: Sequence[ConvexBody],
        label: str = "",
    ) -> SweptArm:
        """Those of an arm on a way, with what it carries at its tool, a part perhaps."""
        m, d = scene.m, scene.d
        geoms = [*scene.links, *scene.loads.get(label, ())]
        round_ = ~np.isin(m.geom_type[geoms], LONG)
        long = np.where(round_, 0.0, m.geom_size[geoms, 1])
        radius = np.where(round_, m.geom_rbound[geoms], m.geom_size[geoms, 0])
        rows = []
        x = np.linspace(0.0, way.length, SAMPLES)
        gone = float(travels(chain, way, x, [*chain.bodies, *carried]).max())
        for q in way.at(x)[0]:
            d.qpos[:] = q
            mujoco.mj_kinematics(m, d)
            axis = d.geom_xmat[geoms].reshape(-1, 3, 3)[:, :, 2] * long[:, None]
            middle = d.geom_xpos[geoms]
            rows.append(np.stack([middle - axis, middle + axis], axis=1))
        return cls(np.array(rows), radius, gone)


LONG = tuple(map(int, (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER)))
"""Geoms that a capsule contains; all others are taken for balls."""


def clear_from(leaves: SweptArm, others: Sequence[SweptArm]) -> float | None:
    """From which share of its way on an arm is clear of others wherever these are on theirs; None
    where it is not even at its end."""
    near = np.zeros(SAMPLES, bool)
    for other in others:
        for k in range(SAMPLES):
            near[k] |= _nearer(leaves, k, other)
    if near[-1]:
        return None
    last = np.flatnonzero(near)
    return 0.0 if not len(last) else float((last[-1] + 1) / (SAMPLES - 1))


def _nearer(one: SweptArm, row: int, other: SweptArm) -> bool:
    """Whether an arm at a sample comes nearer to another than it may, wherever that is."""
    a, b = one.ends[row], other.ends.reshape(-1, 2, 3)
    radius = np.tile(other.radius, SAMPLES)
    least = BETWEEN + (one.between + other.between) / 2
    middle = b.mean(axis=1)
    reach = np.linalg.norm(b[:, 1] - b[:, 0], axis=1) / 2 + radius
    for ends, r in zip(a, one.radius, strict=True):
        far = np.linalg.norm(middle - ends.mean(axis=0), axis=1) - reach
        close = far - np.linalg.norm(ends[1] - ends[0]) / 2 - r < least
        if close.any():
            gap = _distances(ends, b[close]) - radius[close] - r
            if (gap < least).any():
                return True
    return False


def _distances(a: Array, b: Array) -> Array:
    """Distances (m,) of a segment (2, 3) from segments (m, 2, 3) [m]."""
    u, v = a[1] - a[0], b[:, 1] - b[:, 0]
    w = a[0] - b[:, 0]
    uu, vv, uv = float(u @ u), (v * v).sum(axis=1), v @ u
    uw, vw = w @ u, (v * w).sum(axis=1)
    det = uu * vv - uv**2
    s = np.clip(np.where(det > 1e-12, (uv * vw - vv * uw) / np.maximum(det, 1e-12), 0.0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / np.maximum(vv, 1e-12), 0.0, 1.0)
    s = np.clip((uv * t - uw) / max(uu, 1e-12), 0.0, 1.0)
    off = w + s[:, None] * u - t[:, None] * v
    return np.asarray(np.linalg.norm(off, axis=1))
