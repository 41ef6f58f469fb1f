"""A spotlight on the robots of a hand-over: all others fade, with what they hold."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import Geoms, Replica
from factory.film.action import Snapshot

DIM, DIMMER = 0.09, 0.05
"""Opacity of a robot that fades, of which several may be in front of each other, and of what it
holds, which is seen through to its inside."""


class Spotlight:
    """Fades robots of a replica of the model. Rails stay, as the plan of the floor."""

    def __init__(self, replica: Replica) -> None:
        self.m = m = replica.m
        self.faded = np.empty(0, np.intp)
        self.own = m.geom_rgba.copy()
        self.robots: defaultdict[str, list[int]] = defaultdict(list)
        self.loads: defaultdict[int, list[int]] = defaultdict(list)
        for g in range(m.ngeom):
            root = int(m.body_rootid[m.geom_bodyid[g]])
            if names.kind(name := m.body(root).name) == "robot":
                self.robots[name.partition("/")[0]].append(g)
            elif names.kind(name) == "part":
                self.loads[root].append(g)
        welds = ((e, m.equality(e).name) for e in range(m.neq))
        self.holders = {e: _holder(name) for e, name in welds if names.kind(name) == "grip"}

    def aim(self, robots: frozenset[str] | None, shown: Snapshot) -> None:
        """Fade all robots but these, with what they hold in a state; none for None."""
        m = self.m
        m.geom_rgba[self.faded] = self.own[self.faded]
        others = {} if robots is None else dict(self._others(robots, shown))
        self.faded = np.array([*others], np.intp)
        for geom, opacity in others.items():
            m.geom_rgba[geom] = Geoms(m).colour(geom) * (1.0, 1.0, 1.0, opacity)

    def _others(self, robots: frozenset[str], shown: Snapshot) -> Iterator[tuple[int, float]]:
        """The geoms of other robots and of what they hold, with their opacities."""
        for name in self.robots.keys() - robots:
            yield from ((geom, DIM) for geom in self.robots[name])
        pairs = zip(shown.active.tolist(), shown.body2.tolist(), strict=True)
        grips = [(self.holders[e], body) for e, body in pairs if e in self.holders]
        kept = {body for robot, body in grips if robot in robots}
        for body in {body for _, body in grips} - kept:
            yield from ((geom, DIMMER) for geom in self.loads[body])


def _holder(weld: str) -> str:
    """The robot whose weld this is: `grip/r3/part1` -> `r3`."""
    return weld.split("/")[1]
