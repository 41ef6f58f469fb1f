"""How much the hull of two samples of a body has to grow to contain what the body sweeps between
them (Lemma 2).

For x in [x_i, x_i + h] a body lies in hull(B(x_i) ∪ B(x_i + h)) ⊕ ρ with ρ = h²/8 · max |p"| over
its points p, since a path stays within that of its chord, and chords lie in the hull. With J_j the
velocity of p per unit of joint j, ∂J_j/∂q_i = z_i × J_j for i <= j if joint i is a hinge with the
axis z_i, and 0 if it is a slide; so
|p"| <= Σ_j R_j (|g"_j| + |g'_j| (w_j |g'_j| + 2 Σ_{i<j} w_i |g'_i|)), with R_j the lever of joint j
(`SerialChain.lever`) and w 1 for hinges, 0 for slides. The levers are the same in all
configurations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.api import Array
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay


def growths(
    chain: SerialChain, way: JointWay, x: Array, bodies: Sequence[ConvexBody] | None = None
) -> Array:
    """ρ between consecutive coordinates, for each body (m - 1, bodies) [m].

    Args:
        chain: the arm.
        way: followed by it.
        x: coordinates of the samples in ascending order (m,) [m].
        bodies: those of the chain, unless others that move with its frames.
    """
    first, second = way.bounds(x)
    hinges = ~chain.slides * first
    before = np.cumsum(hinges, axis=1) - hinges
    bend = second + first * (hinges + 2 * before)
    return np.asarray(bend @ chain.levers(bodies).T * np.diff(x)[:, None] ** 2 / 8)


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


def samples(chain: SerialChain, way: JointWay, most: float, count: int = 16) -> Array:
    """Coordinates (m,) from 0 to the length [m], halved until no body of the chain has to grow by
    more than `most` between two of them.

    Args:
        chain: the arm.
        way: followed by it.
        most: greatest growth [m].
        count: number of equal pieces to begin with.

    Raises ValueError where `most` is not positive.
    """
    if not most > 0.0:
        raise ValueError(f"growths are not all below {most}")
    x = np.linspace(0.0, way.length, count + 1)
    while (wide := growths(chain, way, x).max(axis=1, initial=0.0) > most).any():
        x = np.sort(np.concatenate([x, (x[:-1] + x[1:])[wide] / 2]))
    return x
