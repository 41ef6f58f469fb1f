"""Certifies that an arm keeps clear along a whole way, not at samples alone.

Between two samples at which a body is at distances a and b from something, and moves by no more
than t in all (`travels`), it is never nearer than (a + b - t) / 2. An interval in which that
is too near is halved (Lemma 2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.legs import NoWay
from factory.apps.arms.travel import travels
from factory.support.arrays import Array, Index

PIECES = 40
"""Number of equal pieces of a stretch to begin with."""

SHORTEST = 2e-4
"""An interval in which no body moves by more is not halved [m]."""

Margins = Callable[[Array], tuple[Array, Index]]
"""From configurations (m, n) to their margins (m,), the distance to what is nearest less what is to
be certified [m], and the number of the nearest pair (m,)."""


def uncertified(
    chain: SerialChain,
    way: JointWay,
    stretch: tuple[float, float],
    bodies: Sequence[ConvexBody],
    margins: Margins,
) -> NoWay | None:
    """What an arm may come too near to on a stretch of a way; None if it certainly does not.

    Args:
        chain: the arm.
        way: followed by it.
        stretch: from which coordinate to which [m].
        bodies: all that moves: links, tool and payload.
        margins: of configurations.
    """
    if stretch[1] <= stretch[0]:
        return None
    x = np.linspace(*stretch, PIECES + 1)
    margin, pair = margins(way.at(x)[0])
    while True:
        gone = travels(chain, way, x, bodies).max(axis=1)
        bound = (margin[:-1] + margin[1:] - gone) / 2
        near = bound < 0.0
        if not near.any():
            return None
        if margin.min() < 0.0 or gone[near].max() < SHORTEST:
            worst = int(margin.argmin())
            return NoWay(int(pair[worst]), -float(min(margin.min(), bound.min())), int(near.sum()))
        middle = (x[:-1] + x[1:])[near] / 2
        more, pairs = margins(way.at(middle)[0])
        order = np.argsort(np.concatenate([x, middle]), kind="stable")
        x = np.concatenate([x, middle])[order]
        margin, pair = np.concatenate([margin, more])[order], np.concatenate([pair, pairs])[order]
