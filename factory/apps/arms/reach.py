"""The reach of an arm: why it does not come to a pose, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.inverse import (
    SEEDS,
    SINGULAR,
    STEPS,
    descend,
    least_singular_value,
    nearest_in_range,
    seeds,
    solutions,
)
from factory.support.arrays import Array, Truth

RAY, CUTS, ROUNDS = 24, 8, 4
"""Number of places on the ray that are tried first, and of those between two of them in each round
of the search for the edge."""


@dataclass(frozen=True, slots=True)
class Unreachable:
    """Why a pose is out of an arm's reach, or only reached near a singular configuration.

    Attributes:
        distance: of the pose from the axis of the base [m].
        height: of the pose above the base [m].
        reach: the distance to which the arm comes at that height in that direction, with that
            orientation; less than `distance` at the outer edge, more at the inner edge; None where
            it comes to no distance there [m].
        singular: least singular value of the best configuration, where the pose is reached.
    """

    distance: float
    height: float
    reach: float | None
    singular: float | None = None

    @property
    def short(self) -> float:
        """Distance between the pose and the edge [m]; infinite where there is none."""
        return float("inf") if self.reach is None else abs(self.distance - self.reach)

    def message(self, part: str, arm: str, above: float = 0.0) -> str:
        """The text of a diagnostic.

        Args:
            part: label of what is at the pose.
            arm: name of the arm.
            above: height of the pose above that at which the part is taken or placed [m].
        """
        named = f"'{part}', {above * 1e3:.0f} mm above its place," if above else f"'{part}'"
        if self.singular is not None:
            limit = f"only within {SINGULAR:g} of a singular configuration"
            return f"{named} is reached by {arm} {limit}"
        where = f"{named} is {self.distance:.3f} m from the axis of {arm}"
        where += f", at {self.height:.2f} m above its base"
        if self.reach is None:
            return f"{where}; it comes to no place at that height so turned"
        if self.reach > self.distance:
            return f"{where}; it comes no nearer than {self.reach:.3f} m there"
        return f"{where}; it comes to {self.reach:.3f} m there, {self.short * 1e3:.0f} mm short"


def diagnose_reach(chain: SerialChain, place: Array, turn: Array) -> Unreachable | None:
    """Why an arm does not reach a pose, from a search on the ray from the axis of its base through
    it; None where it does, with a least singular value of at least SINGULAR.

    Args:
        chain: the arm, whose base frame stands upright.
        place: of the tool (3,) [m].
        turn: orientation of the tool (3, 3).
    """
    distance, height = float(np.hypot(place[0], place[1])), float(place[2])
    (there,) = solutions(chain, place[None], turn[None])
    if len(there):
        best = float(least_singular_value(chain, there).max())
        return None if best >= SINGULAR else Unreachable(distance, height, distance, best)
    way = np.array([place[0], place[1], 0.0]) / distance if distance else np.eye(3)[0]
    return Unreachable(distance, height, _edge(chain, turn, way, distance, height))


def _edge(
    chain: SerialChain, turn: Array, way: Array, distance: float, height: float
) -> float | None:
    """The last distance on a ray that an arm reaches towards one that it does not reach [m]: from
    the nearest that it reaches, by sections; None where it reaches none."""
    middle, radii = height * np.eye(3)[2], np.linspace(0.0, 1.1 * chain.length, RAY)
    turns = np.tile(turn, (RAY, 1, 1))
    every = solutions(chain, radii[:, None] * way + middle, turns, SEEDS // 4)
    good = [k for k, q in enumerate(every) if len(q)]
    if not good:
        return None
    first = min(good, key=lambda k: abs(float(radii[k]) - distance))
    edge, beyond, q = float(radii[first]), distance, every[first]
    for _ in range(ROUNDS):
        cuts = np.linspace(edge, beyond, CUTS + 1)
        reached, q = _farthest(chain, cuts[1:, None] * way + middle, turn, q)
        edge, beyond = float(cuts[reached]), float(cuts[min(reached + 1, CUTS)])
    return edge


def _farthest(chain: SerialChain, places: Array, turn: Array, q: Array) -> tuple[int, Array]:
    """How many of some places in a row an arm reaches from configurations (k, n) at the place
    before them, and its configurations at the last."""
    start = np.tile(q, (len(places), 1))
    rows, there = descend(chain, np.repeat(places, len(q), axis=0), turn, start, 3 * STEPS)
    rows, inside = nearest_in_range(chain, rows, start)
    good = (there & inside).reshape(len(places), len(q))
    reached = int(np.argmin(np.append(good.any(axis=1), False)))
    if not reached:
        return 0, q
    return reached, rows.reshape(len(places), len(q), -1)[reached - 1][good[reached - 1]]


ROUND = 1e-9
"""Distances that differ by less are one [m]."""


def circle_of(chain: SerialChain) -> float | None:
    """The radius of the circle about the axis of its base on which an arm's tool stays [m], as that
    of one hinge with a slide and a wrist does; None where it does not."""
    distances = np.hypot(*chain.tool(seeds(chain))[0][:, :2].T)
    return float(distances.mean()) if np.ptp(distances) < ROUND else None


BASES = (0.10, 0.14, 0.18, 0.22, 0.26, 0.30, 0.36, 0.42, 0.48)
"""Heights at which the base of an arm may stand [m]."""

STEP = 0.02
"""Between the distances from the axis that are tried [m]."""

ENOUGH = 0.12
"""A ring that is wider than this is wide enough; among narrower ones the widest is taken [m]."""


@dataclass(frozen=True, slots=True)
class Ring:
    """Where an arm works with its tool down, at all heights between two.

    Attributes:
        base: height of its base [m].
        inner: least distance from its axis [m].
        outer: greatest distance from its axis [m].
        spread: how far from the station it places parts [m].
    """

    base: float
    inner: float
    outer: float
    spread: float = 0.0

    @property
    def is_circle(self) -> bool:
        """Whether the arm comes to one distance only."""
        return self.inner == self.outer

    def at(self, share: float) -> float:
        """The distance from its axis at a share of the ring's width, from where all places about it
        are in the ring, if that is wide enough; of a line that crosses the ring of an arm that
        comes to one distance only [m]."""
        width = self.outer - self.inner
        if self.is_circle:
            return self.outer * (1.0 - share / 2)
        spread = min(self.spread, width / 2)
        return self.inner + min(max(share * width, spread), width - spread)


def ring_of(chain: SerialChain, low: float, high: float, spread: float = 0.0) -> Ring | None:
    """The ring in which an arm comes with its tool down to all heights between two; None where
    there is none.

    Args:
        chain: the arm.
        low: least height of the tip of the tool above the floor [m].
        high: greatest height [m].
        spread: how far from the station it places parts [m].
    """
    circle = circle_of(chain)
    radii = np.arange(STEP, chain.length, STEP) if circle is None else np.array([circle])
    turn = np.diag([1.0, -1.0, -1.0])
    best: Ring | None = None
    longest = chain.length + 2 * float(chain.spans[0]) * bool(chain.slides[0])
    for base in BASES:
        reached = np.ones(len(radii), bool)
        for height in (low, high, (low + high) / 2):
            places = np.stack([radii, np.zeros_like(radii), np.full_like(radii, height)], axis=1)
            places[:, 2] -= base
            off = np.linalg.norm(places - chain.anchor[0], axis=1)
            reached &= off <= longest  # beyond that nothing needs to be solved
            asked = np.flatnonzero(reached)
            rows = solutions(chain, places[asked], np.tile(turn, (len(asked), 1, 1)), 16)
            reached[asked] = [
                bool(len(q)) and float(least_singular_value(chain, q).max()) >= SINGULAR
                for q in rows
            ]
            if not reached.any():
                break
        inner, outer = _longest(reached)
        ring = Ring(base, float(radii[inner]), float(radii[outer]), spread)
        if circle is not None and reached.all():
            return ring
        if outer > inner and (best is None or ring.outer - ring.inner > best.outer - best.inner):
            best = ring
        if best is not None and best.outer - best.inner > ENOUGH + 2 * spread:
            return best
    return best


def _longest(there: Truth) -> tuple[int, int]:
    """The first and the last index of the longest run of what is there; equal where there is
    none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]])))
    runs = edges.reshape(-1, 2)
    if not len(runs):
        return 0, 0
    first, end = runs[int((runs[:, 1] - runs[:, 0]).argmax())]
    return int(first), int(end) - 1
