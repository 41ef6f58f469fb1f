"""What two arms at one station share: on which part of its way an arm is certainly clear of all
ways of another.

A link is taken for a capsule or a ball that contains it, a payload for a ball. Stretches of both
ways are halved until the distance at their middles, less what the arms travel from there, is enough
(Lemma 2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.scene import Scene
from factory.apps.arms.travel import travels
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

STEPS, COARSE = 1024, 64
"""Number of equal steps of a way, and of those of a stretch to begin with."""

BETWEEN = 0.01
"""Least distance of two arms that may move without waiting for each other [m]."""

LONG = tuple(map(int, (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER)))
"""Geoms that a capsule contains; all others are taken for balls."""


@dataclass(frozen=True, eq=False)
class SweptArm:
    """The capsules of an arm on a way.

    Attributes:
        ends: of their axes (STEPS + 1, k, 2, 3) [m].
        radius: (k,) [m].
        gone: how far a point of them has moved at most (STEPS + 1,) [m].
    """

    ends: Array
    radius: Array
    gone: Array

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
        m = scene.m
        geoms = [*scene.links, *scene.loads.get(label, ())]
        round_ = ~np.isin(m.geom_type[geoms], LONG)
        long = np.where(round_, 0.0, m.geom_size[geoms, 1])
        radius = np.where(round_, m.geom_rbound[geoms], m.geom_size[geoms, 0])
        x = np.linspace(0.0, way.length, STEPS + 1)
        steps = travels(chain, way, x, [*chain.bodies, *carried]).max(axis=1)
        places, turns = scene.poses(way.at(x)[0])
        turns = turns[:, np.searchsorted(scene.moves, geoms)].reshape(len(x), -1, 3, 3)
        middle, axis = places[:, geoms], turns[..., 2] * long[:, None]
        ends = np.stack([middle - axis, middle + axis], axis=2)
        return cls(ends, radius, np.append(0.0, np.cumsum(steps)))

    @property
    def backwards(self) -> SweptArm:
        """Those on the same way from its end to its beginning."""
        return replace(self, ends=self.ends[::-1], gone=(self.gone[-1] - self.gone)[::-1])

    @cached_property
    def balls(self) -> tuple[Array, Array]:
        """Middles (STEPS + 1, k, 3) and radii (k,) of balls that contain the capsules [m]."""
        half = np.linalg.norm(self.ends[0, :, 1] - self.ends[0, :, 0], axis=-1) / 2
        return self.ends.mean(axis=2), half + self.radius

    def strays(self, begin: Index, size: Index) -> Array:
        """How far a point is on stretches (n,) from where it is at their middles, at most [m]."""
        middle = self.gone[begin + size // 2]
        before, after = middle - self.gone[begin], self.gone[begin + size] - middle
        return np.asarray(np.maximum(before, after))


def clear_share(one: SweptArm, others: Sequence[SweptArm]) -> float:
    """The share of its way, from its beginning, on which an arm is certainly clear of others
    wherever these are on theirs."""
    at, size = 0, COARSE
    while at < STEPS and size > 1:
        if all(_clear(one, at, size, other) for other in others):
            at += size
        else:
            size //= 2
    return at / STEPS


def _clear(one: SweptArm, begin: int, size: int, other: SweptArm) -> bool:
    """Whether an arm on a stretch is clear of another wherever that is on its way."""
    there = np.arange(0, STEPS, COARSE)
    starts = np.stack([np.full(len(there), begin), there], axis=1)
    sizes = np.tile([size, COARSE], (len(there), 1))
    while len(starts):
        strays = [way.strays(*at) for way, *at in zip((one, other), starts.T, sizes.T, strict=True)]
        need = BETWEEN + strays[0] + strays[1]
        middles = starts + sizes // 2
        gaps = _gaps(one, middles[:, 0], other, middles[:, 1], need)
        near = gaps < need
        if (gaps < BETWEEN).any() or (sizes[near].max(axis=1, initial=0) <= 2).any():
            return False
        starts, sizes = starts[near], sizes[near]
        second = (strays[1] > strays[0])[near]
        longer = np.where(np.minimum(*sizes.T) > 2, second, sizes[:, 1] > 2).astype(int)
        rows = np.arange(len(sizes))
        sizes[rows, longer] //= 2
        further = starts.copy()
        further[rows, longer] += sizes[rows, longer]
        starts, sizes = np.concatenate([starts, further]), np.tile(sizes, (2, 1))
    return True


def _gaps(one: SweptArm, at: Index, other: SweptArm, there: Index, need: Array) -> Array:
    """Distances (n,) of two arms at places of their ways, exact where they are below `need` (n,),
    else lower bounds that are not [m]."""
    (a, ra), (b, rb) = one.balls, other.balls
    off = a[at][:, :, None] - b[there][:, None]
    gaps = np.sqrt((off * off).sum(axis=-1)) - ra[:, None] - rb
    pair, i, j = np.nonzero(gaps < need[:, None, None])
    exact = _distances(one.ends[at[pair], i], other.ends[there[pair], j])
    gaps[pair, i, j] = exact - one.radius[i] - other.radius[j]
    return np.asarray(gaps.min(axis=(1, 2)))


def _distances(a: Array, b: Array) -> Array:
    """Distances (m,) of segments (m, 2, 3) from others (m, 2, 3) [m]."""
    u, v, w = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], a[:, 0] - b[:, 0]
    uu, vv, uv, uw, vw = ((p * q).sum(axis=1) for p, q in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    det, uu, vv = uu * vv - uv**2, np.maximum(uu, 1e-12), np.maximum(vv, 1e-12)
    skew = det > 1e-12
    s = np.clip(np.where(skew, (uv * vw - vv * uw) / np.where(skew, det, 1.0), 0.0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    off = w + s[:, None] * u - t[:, None] * v
    return np.asarray(np.linalg.norm(off, axis=1))
