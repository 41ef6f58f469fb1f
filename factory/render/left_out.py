"""Robots that are gone are left out of pictures: their rails stay, and nothing else of them."""

from __future__ import annotations

import numpy as np

from factory.mjcf.replica import SHOWN, Replica, bodies_of
from factory.render.history import History


class LeftOut:
    """Leaves robots out of the pictures of a replica's model, as a history tells."""

    def __init__(self, replica: Replica, history: History) -> None:
        self.m, self.history = replica.m, history
        self.groups, self.now = replica.m.geom_group.copy(), frozenset[int]()

    def at(self, time: float) -> None:
        """Leave out those that are gone at a time [s], and no others."""
        gone = self.history.gone(time)
        if gone == self.now:
            return
        self.now, m, every = gone, self.m, self.history.factory.robots
        theirs = bodies_of(m, (every[robot].name for robot in gone))[m.geom_bodyid]
        m.geom_group[:] = np.where(theirs, np.maximum(self.groups, SHOWN), self.groups)
