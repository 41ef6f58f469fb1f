"""A spotlight on the robots of a hand-over: all others fade, with what they hold."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Geoms, Replica
from factory.film.action import Snapshot
from factory.support.engine import mujoco

DIM, DIMMER = 0.09, 0.05
"""Opacity of a robot that fades, of which several may be in front of each other, and of what it
holds. Of that meshes are left out, since their insides would show."""


class Spotlight:
    """Fades robots of a replica of the model. Rails stay, as the plan of the floor."""

    def __init__(self, replica: Replica) -> None:
        self.m = m = replica.m
        self.faded = np.empty(0, np.intp)
        self.own, self.groups = m.geom_rgba.copy(), m.geom_group.copy()
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
        m.geom_group[self.faded] = self.groups[self.faded]
        others = {} if robots is None else dict(self._others(robots, shown))
        self.faded = np.array([*others], np.intp)
        for geom, opacity in others.items():
            if opacity:
                m.geom_rgba[geom] = Geoms(m).colour(geom) * (1.0, 1.0, 1.0, opacity)
            else:
                m.geom_group[geom] = SHOWN

    def _others(self, robots: frozenset[str], shown: Snapshot) -> Iterator[tuple[int, float]]:
        """The geoms of other robots and of what they hold, with their opacities."""
        for name, geoms in self.robots.items():
            yield from ((geom, DIM) for geom in geoms if name not in robots)
        pairs = zip(shown.active.tolist(), shown.body2.tolist(), strict=True)
        grips = [(self.holders[e], body) for e, body in pairs if e in self.holders]
        kept = {body for robot, body in grips if robot in robots}
        for body in dict.fromkeys(body for _, body in grips if body not in kept):
            yield from ((g, 0.0 if self._is_mesh(g) else DIMMER) for g in self.loads[body])

    def _is_mesh(self, geom: int) -> bool:
        """Whether a geom is a mesh of the run's model, not a skin."""
        m, mesh = self.m, mujoco.mjtGeom.mjGEOM_MESH
        return bool(m.geom_type[geom] == mesh) and not m.geom(geom).name.endswith("/skin")


def _holder(weld: str) -> str:
    """The robot whose weld this is: `grip/r3/part1` -> `r3`."""
    return weld.split("/")[1]
