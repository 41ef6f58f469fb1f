"""Look for bends with which a layout takes less floor.

What brings robots their inputs are branches of regions that are moved as they are: how far is what
the bends decide. A search changes one guidepath at a time, and keeps what is clear by the regions
of `sweeps`, is nearer to the middle of the floor, and does not make a cycle longer than it may be.
What it finds is certified like any layout; it is deterministic, and counts its tries.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from factory.api import Detour, Layout, LayoutMachines, Pace
from factory.apps.platen.placing import Floor, Placing
from factory.support.decimals import up

TRIES, EFFORT = 220, 120_000
"""Changes that are tried for each guidepath, and at most robots times changes: each takes a time
that grows with the number of robots."""

SEARCHES = 2
"""So many times it is looked, from other random numbers; the best is taken."""

SLOWER = 1.03
"""The cycle may become so many times as long."""

PULL = 0.3
"""What it counts for that a robot is nearer to the middle of the floor, beside the floor itself."""

SHARPER = (0.04, 0.02)
"""Other roundings of corners, for robots that need not be as fast [m]."""

PRESS = 0.3, 40.0
"""What it costs at first, and at last, that two robots are nearer than they may be [1/m]."""

BEYOND = 1.0
"""A guidepath that ends across its heading has its second corner so much further [m]."""

INITIAL_TEMPERATURE = 0.1
"""Temperature of the simulated annealing at first: by how much worse a layout may be to go on from,
as a share of the floor."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Bounds on the detours of a robot, apart from roundings: the least coordinate at which it may
    leave its line (`head`), and the straight stretch that its guidepath needs at the other end [m],
    along its heading (`tail`) or to either side (`aside`; None if it has several stations)."""

    head: float
    tail: float
    aside: tuple[float, ...]

    @classmethod
    def of(cls, layout: Layout, robot: int) -> Reach:
        """The bounds of a robot: its stations are at the end at which it receives, and a feeder's
        next part comes down only when it is clear."""
        path, operations = layout.guidepaths[robot], layout.factory.operations
        gear = [operations[number] for number in layout.factory.robots[robot].operations]
        at = {o.index: layout.visits[o.index, robot].at for o in gear}
        heads = [path.reach, *(at[o.index] for o in gear if o.carrier != robot)]
        tail = max((path.length - at[o.index] for o in gear if o.carrier == robot), default=0.0)
        aside = [0.0, 0.0] if tail < LayoutMachines.ROUNDING else []
        if layout.magazine(robot):
            cleared = partial(LayoutMachines(layout).cleared, robot)
            tail, aside = max(tail, cleared(0.0)), [*map(cleared, (1.0, -1.0))] if aside else []
        return cls(max(heads), tail, tuple(aside))


def compacted(layout: Layout, pace: Pace) -> list[Layout]:
    """Layouts with bends, each taking less floor than the one before; not certified."""
    robots = len(layout.guidepaths)
    tries = min(TRIES * robots, EFFORT // robots)
    searches = (_Search(layout, pace, seed).better(tries) for seed in range(SEARCHES))
    pairs = [pair for search in searches for pair in search]
    return [made for _, made in sorted(pairs, key=lambda pair: -pair[0])]


class _Search:
    """The search for bends."""

    def __init__(self, layout: Layout, pace: Pace, seed: int) -> None:
        self.layout, self.pace, self.ground = layout, pace, Floor(layout)
        self.most = SLOWER * pace.cycle_of(layout)
        full = pace.rounding
        self.roundings = [full, *(small for small in SHARPER if small < full)]
        self.rng = np.random.default_rng(seed)
        goes = [r for r, path in enumerate(layout.guidepaths) if r and path.travels]
        self.reach = {robot: Reach.of(layout, robot) for robot in goes}
        self.under = [*map(self.ground.search.branch, range(len(self.ground.on)))]
        self.begin = Placing(self.ground, {})
        low, high, lowest, highest = self.begin.hulls[0]
        self.middle = np.array([(low + high) / 2, (lowest + highest) / 2])

    def better(self, tries: int) -> Iterator[tuple[float, Layout]]:
        """Floors [m²] in falling order, each with its layout."""
        here, least = self.begin, self.begin.area
        size, robots = least, [*self.reach]
        for step in range(tries):
            share = step / tries
            press = PRESS[0] * (PRESS[1] / PRESS[0]) ** share
            robot = int(self.rng.choice(robots))
            under = self.under[robot]
            there = here.changed(robot, self.proposed(robot, here.detours.get(robot)), under)
            now = self.worth(here, size) + press * here.deep.sum()
            limit = now + INITIAL_TEMPERATURE * (1 - share) ** 2 * self.rng.exponential()
            if self.worth(there, size) > limit:
                continue
            there.look(under)
            if self.worth(there, size) + press * there.deep.sum() > limit:
                continue
            made = self.ground.bent(there.detours)
            if self.pace.cycle_of(made) > self.most:
                continue
            here = there
            if not here.deep.any() and here.area < least - 1e-4:
                least = here.area
                yield least, made

    def worth(self, placing: Placing, size: float) -> float:
        """The cost of a floor."""
        off = np.abs(placing.hulls - np.repeat(self.middle, 2))
        furthest = off[:, :2].max(axis=1) + off[:, 2:].max(axis=1)
        return placing.area / size + PULL * float(furthest.mean())

    def proposed(self, robot: int, before: Detour | None) -> Detour | None:
        """Another detour for a robot; None for a straight one."""
        rng, reach, path = self.rng, self.reach[robot], self.layout.guidepaths[robot]
        kind = rng.random()
        if kind < 0.1:
            return None
        if kind < 0.2:
            return Detour(round(path.travel + abs(rng.normal()) * 0.1, 3))
        if before and before.first and kind < 0.6:
            bend, rounding = before.first
            ends = path.reach + before.travel
            lengths = [bend.at, bend.across, ends - bend.end]
            if lengths[2] < 0.0:
                lengths = [bend.at, float(np.copysign(ends - bend.at, bend.across)), 0.0]
            lengths[int(rng.integers(0, 3 - (lengths[2] == 0.0)))] += rng.normal() * 0.08
        else:
            rounding = self.roundings[int(rng.integers(0, len(self.roundings)))]
            across = rng.choice([-1, 1]) * (2 * rounding + rng.exponential(0.15))
            head, tail = (rng.exponential(0.1) * (rng.random() < 0.4) for _ in range(2))
            lengths = [reach.head + rounding + head, across, reach.tail + rounding + tail]
            if reach.aside and rng.random() < 0.5:
                lengths[2] = 0.0
        return self.fitting(robot, lengths, rounding)

    def fitting(self, robot: int, lengths: list[float], rounding: float) -> Detour:
        """The detour straight, across and straight again by given lengths, or longer ones if
        needed; across only if the last is 0 [m]."""
        at, across, tail = lengths
        reach, path = self.reach[robot], self.layout.guidepaths[robot]
        at = max(up(at), up(reach.head + rounding))
        if tail == 0.0:
            least = reach.aside[int(across > 0)] + rounding
            far = max(up(abs(across)), up(least))
            side = float(np.copysign(far + BEYOND, across))
            return Detour.across(round(at + far - path.reach, 3), at, side, rounding)
        tail = max(up(tail), up(reach.tail + rounding))
        across = round(float(np.copysign(max(abs(across), 2 * rounding), across)), 3)
        travel = round(at + abs(across) + tail - path.reach, 3)
        return Detour.across(travel, at, across, rounding)
