"""Air jets, which blow dropped scrap into a bin."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, sqrt

import numpy as np

from factory.layout.bins import TOP, Bin
from factory.mjcf.model import GRAVITY
from factory.simulation.mujoco.world import MujocoWorld

BLOWN = 0.03
"""A jet lasts so long, to the next whole tick [s]."""

BEYOND = 0.01
"""It aims so far beyond the middle of a bin, since what falls rubs on its way [m]."""


class Jets:
    """The active jets of a world: the time `until` which each blows [s], by body."""

    def __init__(self, world: MujocoWorld) -> None:
        self._world = world
        self._until: dict[int, float] = {}

    def blow(self, bodies: Iterable[int], target: Bin) -> None:
        """Blow bodies that start to fall together into a bin: the jet gives them the speed that
        brings them there as they pass the bin's plates."""
        m, d, chosen = self._world.m, self._world.d, [*bodies]
        masses = m.body_mass[chosen]
        middle = masses @ d.xipos[chosen] / masses.sum()
        way = np.array(target.middle) - middle[:2]
        way += BEYOND * way / max(float(np.linalg.norm(way)), BEYOND)
        speed = way / sqrt(2 * max(middle[2] - TOP / 2, TOP / 2) / GRAVITY)
        tick = self._world.model.settings.tick
        seconds = ceil(BLOWN / tick - 1e-9) * tick
        d.xfrc_applied[chosen, :2] = masses[:, None] * speed / seconds
        self._until |= dict.fromkeys(chosen, self._world.time + seconds)

    def tick(self) -> None:
        """At the end of a tick, end the jets whose time is over."""
        late = self._world.time + self._world.model.settings.tick / 2
        for body in [body for body, until in self._until.items() if until <= late]:
            del self._until[body]
            self._world.d.xfrc_applied[body, :2] = 0.0
