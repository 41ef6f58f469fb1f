"""Inverse kinematics: all configurations that bring the tool to a pose, and straight lines of it.

Solutions are found by damped least squares (Levenberg-Marquardt) from many seeds at once. The seeds
are points of a Kronecker sequence, the solutions are sorted: the same input gives the same bits. A
chain of six axes has up to eight solutions; one of seven has infinitely many, of which one for each
seed remains.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.support.arrays import Array, Truth

STEPS, TOLERANCE = 60, 1e-9
"""Steps of damped least squares from a seed, and the error at which it is at the pose [m, rad]."""

SEEDS = 64

STRIDE, DAMPING = 0.5, 1e-2
"""No joint moves further than this in a step [rad, m]; the greatest damping factor."""

SAME = 1e-3
"""Configurations that differ by less in every joint are one solution [rad, m]."""

SINGULAR = 0.08
"""Least singular value of configurations that are used."""

TURN = 2 * np.pi


def descend(
    chain: SerialChain, place: Array, turn: Array, q: Array, steps: int = STEPS
) -> tuple[Array, Truth]:
    """The configurations (m, n) to which damped least squares comes, each for a pose of its own,
    and whether the tool is at the pose (m,).

    Args:
        chain: the arm.
        place: places of the tool (m, 3) or (3,) [m].
        turn: orientations of the tool (m, 3, 3) or (3, 3).
        q: configurations to begin with (m, n) [rad, m].
        steps: at most so many.
    """
    place, turn = np.broadcast_to(place, (len(q), 3)), np.broadcast_to(turn, (len(q), 3, 3))
    q, there, left = np.array(q, float), np.zeros(len(q), bool), np.arange(len(q))
    for step in range(steps + 1):
        at, now, columns = chain.tool_and_jacobian(q[left])
        error = np.concatenate([place[left] - at, _rotation(turn[left], now)], axis=-1)
        size = np.linalg.norm(error, axis=-1)
        there[left] = size < TOLERANCE
        open_ = size >= TOLERANCE
        left = left[open_]
        if step == steps or not len(left):
            break
        q[left] += _step(columns[open_], error[open_])
    return q, there


def _rotation(turn: Array, now: Array) -> Array:
    """The vectors (m, 3) of rotations from orientations `now` to `turn`: by their sine, beyond a
    quarter turn by their angle."""
    between = turn @ np.swapaxes(now, -1, -2)
    sine = (between[:, [2, 0, 1], [1, 2, 0]] - between[:, [1, 2, 0], [2, 0, 1]]) / 2
    cosine = (np.trace(between, axis1=-2, axis2=-1) - 1) / 2
    wide = np.flatnonzero(cosine < 0)
    size = np.linalg.norm(sine[wide], axis=-1)
    angle = np.arctan2(size, cosine[wide])
    sense = np.where(size[:, None] > 1e-9, sine[wide], [1.0, 0.0, 0.0])
    sine[wide] = sense * (angle / np.linalg.norm(sense, axis=-1))[:, None]
    return np.asarray(sine)


def _step(columns: Array, error: Array) -> Array:
    """Damped steps (m, n) that reduce errors (m, 6)."""
    square = (error * error).sum(axis=-1)
    damping = np.minimum(DAMPING, square) + 1e-12
    normal = columns @ np.swapaxes(columns, -1, -2) + damping[:, None, None] * np.eye(6)
    step = np.linalg.solve(normal, error[..., None])
    step = (np.swapaxes(columns, -1, -2) @ step)[..., 0]
    longest = np.abs(step).max(axis=-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, STRIDE / np.maximum(longest, 1e-300)))


def nearest_in_range(chain: SerialChain, q: Array, near: Array) -> tuple[Array, Truth]:
    """Configurations (m, n) with hinges moved by whole turns, within their limits as near to a
    reference as they come, and whether all joints are within their limits (m,).

    Args:
        chain: the arm.
        q: configurations (m, n) [rad, m].
        near: the reference (n,) or (m, n) [rad, m].
    """
    low, high = chain.limits.low, chain.limits.high
    least, most = np.ceil((low - q) / TURN), np.floor((high - q) / TURN)
    turns = np.minimum(np.maximum(np.round((near - q) / TURN), least), most)
    moved = np.where(chain.slides, q, q + TURN * turns)
    return moved, np.all((low <= moved) & (moved <= high), axis=-1)


def seeds(chain: SerialChain, count: int = SEEDS) -> Array:
    """Configurations (count, n) that fill the ranges of the joints evenly, of a hinge at most a
    whole turn: points of the Kronecker sequence of the generalised golden ratio (Roberts 2018).

    Args:
        chain: the arm.
        count: number of seeds.
    """
    n = len(chain)
    ratio = 2.0
    for _ in range(64):
        ratio = (1 + ratio) ** (1 / (n + 1))
    share = (0.5 + np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, n + 1))) % 1.0
    low, high = chain.limits.low, chain.limits.high
    middle = np.clip(0.0, low, high)
    half = np.where(chain.slides, high - low, TURN / 2)
    low, high = np.maximum(low, middle - half), np.minimum(high, middle + half)
    return np.asarray(low + share * (high - low))


def solutions(
    chain: SerialChain, places: Array, turns: Array, count: int = SEEDS
) -> tuple[Array, ...]:
    """For each of m poses the different configurations (k, n) within the joints' limits that bring
    the tool there, in lexicographic order; hinges are as near to 0 as their range lets them.

    Args:
        chain: the arm.
        places: of the tool (m, 3) [m].
        turns: orientations of the tool (m, 3, 3).
        count: number of seeds for each pose.
    """
    start = seeds(chain, count)
    q, there = descend(
        chain,
        np.repeat(places, count, axis=0),
        np.repeat(turns, count, axis=0),
        np.tile(start, (len(places), 1)),
    )
    q, inside = nearest_in_range(chain, q, np.zeros(len(chain)))
    good, q = (there & inside).reshape(-1, count), q.reshape(-1, count, len(chain))
    return tuple(_different(chain, row[mask]) for row, mask in zip(q, good, strict=True))


def _different(chain: SerialChain, q: Array) -> Array:
    """Configurations without those that others equal, whole turns of hinges aside, in order."""
    ordered = q[np.lexsort(np.round(q, 6).T[::-1])]
    kept: list[Array] = []
    for one in ordered:
        apart = np.array(kept).reshape(-1, len(chain)) - one
        apart -= np.where(chain.slides, 0.0, TURN * np.round(apart / TURN))
        if (np.abs(apart).max(axis=-1) > SAME).all():
            kept.append(one)
    return np.array(kept).reshape(-1, len(chain))


def least_singular_value(chain: SerialChain, q: Array) -> Array:
    """Least singular values (...,) of the Jacobian, with lengths in units of the chain's: the same
    for an arm twice as large, 0 where joints do not move the tool independently.

    Args:
        chain: the arm.
        q: configurations (..., n) [rad, m].
    """
    columns = chain.jacobian(q)
    columns[..., :3, :] /= chain.length
    scaled = columns * np.where(chain.slides, chain.length, 1.0)
    return np.asarray(np.linalg.svd(scaled, compute_uv=False)[..., -1])


def tool_line(chain: SerialChain, q: Array, offsets: Array) -> tuple[Array, Truth]:
    """Configurations (m, k, n) at places of the tool along a line, on which it keeps its
    orientation, and whether the arm follows the whole line without a jump (m,).

    Args:
        chain: the arm.
        q: configurations at the beginnings (m, n) [rad, m].
        offsets: of the places from the beginning, which is the first (k, 3) or (k, m, 3) [m].
    """
    place, turn = chain.tool(q)
    rows, good = [np.asarray(q)], np.ones(len(q), bool)
    for offset in offsets[1:]:
        ahead = 2 * rows[-1] - rows[-2] if len(rows) > 1 else rows[-1]
        after, there = descend(chain, place + offset, turn, ahead, 20)
        _, inside = nearest_in_range(chain, after, after)
        good &= there & inside & (np.abs(after - rows[-1]).max(axis=-1) < 5.0 / len(offsets))
        rows.append(after)
    return np.stack(rows, axis=1), good


def tool_lines(
    chain: SerialChain, starts: Sequence[Array], lines: Sequence[Array]
) -> list[tuple[Array, Truth]]:
    """`tool_line` for several lines, found together where they have as many places.

    Args:
        chain: the arm.
        starts: for each line configurations at its beginning (m, n) [rad, m].
        lines: offsets of the places of each from its beginning, which is the first (k, 3) [m].
    """
    rows = dict[int, tuple[Array, Truth]]()
    for count in dict.fromkeys(map(len, lines)):
        which = [n for n, line in enumerate(lines) if len(line) == count]
        many = [len(starts[n]) for n in which]
        offsets = np.repeat(np.stack([lines[n] for n in which], axis=1), many, axis=1)
        made = tool_line(chain, np.concatenate([starts[n] for n in which]), offsets)
        split = (np.split(each, np.cumsum(many)[:-1]) for each in made)
        rows.update(zip(which, zip(*split, strict=True), strict=True))
    return [rows[n] for n in range(len(lines))]
