"""Configurations of an arm for its visits: candidates for each tour, and the best round a circuit.

A tour takes a part at one pose and places it at another. Its two configurations are on one branch:
the joint line between them stays away from singular configurations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.inverse import (
    SINGULAR,
    descend,
    least_singular_value,
    nearest_in_range,
    solutions,
    tool_lines,
)
from factory.apps.arms.legs import Clearance, NoWay
from factory.support.arrays import Array, Index, Truth

CROSSING = 0.02
"""Along the joint line within a branch no least singular value is below this."""

EVERY_JOINT = 0.05
"""Weight of the time of all joints beside that of the slowest."""


def partners(chain: SerialChain, q: Array, place: Array, turn: Array) -> tuple[Array, Truth]:
    """The configurations (k, n) that bring the tool to a second pose on the branch of those that
    have it at a first one, and whether there is one (k,): both, and the joint line between them,
    stay away from singular configurations.

    Args:
        chain: the arm.
        q: configurations at the first pose (k, n) [rad, m].
        place: of the tool at the second pose (3,) or (k, 3) [m].
        turn: orientation of the tool there (3, 3) or (k, 3, 3).
    """
    other, there = descend(chain, place, turn, q, 80)
    other, inside = nearest_in_range(chain, other, q)
    share = np.linspace(0.0, 1.0, 9)[:, None, None]
    values = least_singular_value(chain, q + share * (other - q))
    good = there & inside & (np.minimum(values[0], values[-1]) >= SINGULAR)
    return other, good & (values.min(axis=0) >= CROSSING)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Configurations with which an arm can take a part at one pose and place it at another.

    Attributes:
        pairs: where it takes it and where it places it (k, 2, n) [rad, m].
        grips: number of the pair of poses that each belongs to (k,).
        blocked: what most of those that are not clear are too near to; None if all are clear.
    """

    pairs: Array
    grips: Index
    blocked: NoWay | None


def candidates(
    chain: SerialChain,
    takes: tuple[Array, Array],
    puts: tuple[Array, Array],
    clearance: Clearance,
    near: Array,
    ends: tuple[Sequence[Array], Sequence[Array]],
) -> Candidates:
    """The candidates for a tour whose part may be held in m ways.

    Args:
        chain: the arm.
        takes: places (m, 3) [m] and orientations (m, 3, 3) of the tool where it takes the part.
        puts: those where it places it.
        clearance: of configurations at both, and at the far ends of the straight lines there.
        near: a configuration; of those that whole turns make equal, the nearest is used [rad, m].
        ends: the lines of the tool at either, as the offsets of places from there (l, 3) [m].
    """
    q, good, grips = _reaching(chain, takes, near)
    other, joined = partners(chain, q, puts[0][grips], puts[1][grips])
    joined &= good
    grips, q, other = grips[joined], q[joined], other[joined]
    (there, goes), (here, comes) = _with_ends(chain, (q, other), ends)
    follows = goes & comes
    margin, pair = _asked(clearance, [*there, *here], follows)
    clear = margin.min(axis=0, initial=np.inf) >= 0.0
    pairs = np.stack([q, other], axis=1)[follows]
    blocked = _obstacle(margin[:, ~clear], pair[:, ~clear])
    return Candidates(pairs[clear], grips[follows][clear], blocked)


def free_candidates(
    chain: SerialChain,
    takes: tuple[Array, Array],
    puts: tuple[Array, Array],
    clearance: Clearance,
    near: Array,
    ends: tuple[Sequence[Array], Sequence[Array]],
) -> Candidates:
    """As `candidates`, but with two configurations that need not be on one branch, of which each is
    away from singular ones."""
    visits, blocked = list[tuple[Array, Index]](), list[NoWay]()
    both = [_reaching(chain, poses, near) for poses in (takes, puts)]
    ended = _with_ends(chain, [q for q, _, _ in both], ends)
    for (q, good, grips), (asked, follows) in zip(both, ended, strict=True):
        good &= follows & (least_singular_value(chain, q) >= SINGULAR)
        margin, pair = _asked(clearance, asked, good)
        clear = margin.min(axis=0, initial=np.inf) >= 0.0
        obstacle = None if clear.any() else _obstacle(margin, pair)
        blocked += [obstacle] if obstacle else []
        visits.append((q[good][clear], grips[good][clear]))
    (one, first), (other, last) = visits
    i, j = np.nonzero(first[:, None] == last)
    after, inside = nearest_in_range(chain, other[j], one[i])
    pairs = np.stack([one[i], after], axis=1)[inside]
    return Candidates(pairs, first[i][inside], blocked[0] if blocked else None)


def _reaching(
    chain: SerialChain, poses: tuple[Array, Array], near: Array
) -> tuple[Array, Truth, Index]:
    """The configurations (k, n) that come to m poses, whether all joints are within their limits
    (k,), and the number of each one's pose (k,)."""
    every = solutions(chain, *poses)
    grips = np.repeat(np.arange(len(every)), [len(q) for q in every])
    return *nearest_in_range(chain, np.concatenate(every), near), grips


def _with_ends(
    chain: SerialChain, visits: Sequence[Array], ends: Sequence[Sequence[Array]]
) -> Iterator[tuple[list[Array], Truth]]:
    """The configurations (m, n) of each visit with those at the far ends of its lines of the tool
    from there, and whether the arm follows all of these lines (m,)."""
    starts = [q for q, lines in zip(visits, ends, strict=True) for _ in lines]
    made = iter(tool_lines(chain, starts, [offsets for lines in ends for offsets in lines]))
    for q, lines in zip(visits, ends, strict=True):
        rows, good = zip(*(next(made) for _ in lines), strict=True)
        yield [q, *(row[:, -1] for row in rows)], np.logical_and.reduce(good)


def _asked(clearance: Clearance, places: Sequence[Array], which: Truth) -> tuple[Array, Index]:
    """The margins and pairs (l, k) at l places of those of m configurations that are asked for."""
    every = np.stack(places)[:, which]
    margin, pair = clearance(every.reshape(-1, every.shape[-1]))
    return margin.reshape(every.shape[:2]), pair.reshape(every.shape[:2])


def _obstacle(margin: Array, pair: Index) -> NoWay | None:
    """What columns of margins and pairs (l, k) say that is too near."""
    if not margin.size:
        return None
    worst = margin.argmin(axis=0), np.arange(margin.shape[1])
    counts = np.bincount(pair[worst])
    most = int(counts.argmax())
    return NoWay(most, -float(margin[worst][pair[worst] == most].min()), int(counts[most]))


def circuit(options: Sequence[Array], speed: Array) -> list[int]:
    """Which configurations to use for each tour of a circuit: those of least total time, by dynamic
    programming. A leg costs the time of its slowest joint, and a twentieth of that of all.

    Args:
        options: for each tour in turn, pairs of configurations where it takes its part and where it
            places it (k, 2, n), at least one [rad, m].
        speed: greatest speed of the joints (n,) [rad/s, m/s].
    """

    def cost(a: Array, b: Array) -> Array:
        time = np.abs(b - a) / speed
        return np.asarray(time.max(axis=-1) + EVERY_JOINT * time.sum(axis=-1))

    brings = [cost(pairs[:, 0], pairs[:, 1]) for pairs in options]
    goes = [
        cost(one[:, None, 1], other[None, :, 0])
        for one, other in zip(options, [*options[1:], options[0]], strict=True)
    ]
    rounds = (_round(first, brings, goes) for first in range(len(options[0])))
    return min(rounds, key=lambda one: one[0])[1]


def _round(first: int, brings: Sequence[Array], goes: Sequence[Array]) -> tuple[float, list[int]]:
    """The least cost of a circuit whose first tour has the configurations `first`, and its
    choice."""
    total = np.where(np.arange(len(brings[0])) == first, brings[0], np.inf)
    before: list[Index] = []
    for way, load in zip(goes[:-1], brings[1:], strict=True):
        every = total[:, None] + way
        before.append(every.argmin(axis=0))
        total = every.min(axis=0) + load
    total = total + goes[-1][:, first]
    chosen = [int(total.argmin())]
    for back in reversed(before):
        chosen.append(int(back[chosen[-1]]))
    return float(total.min()), chosen[::-1]
