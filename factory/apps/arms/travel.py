"""How far the points of an arm's bodies travel between two coordinates of a way.

The velocity of a point p per unit of the coordinate is Σ_j g'_j J_j, with J_j that per unit of
joint j, and |J_j| is at most the lever R_j of the joint (`SerialChain.lever`), the same in all
configurations. So a path between two coordinates at a distance h is at most h Σ_j R_j max |g'_j|
long.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.support.arrays import Array


def travels(
    chain: SerialChain, way: JointWay, x: Array, bodies: Sequence[ConvexBody] | None = None
) -> Array:
    """Greatest length of path of a point of each body between consecutive coordinates
    (m - 1, bodies) [m]: h Σ_j R_j |g'_j|.

    Args:
        chain: the arm.
        way: followed by it.
        x: coordinates of the samples in ascending order (m,) [m].
        bodies: those of the chain, unless others that move with its frames.
    """
    return np.asarray(way.bounds(x)[0] @ chain.levers(bodies).T * np.diff(x)[:, None])
