"""Robots that are gone are left out of pictures: their rails stay, and nothing else of them."""

from __future__ import annotations

import numpy as np

from factory.mjcf import names
from factory.mjcf.replica import SHOWN, Replica
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
        carriages = [m.body(names.carriage(every[robot].name)).id for robot in gone]
        theirs = np.isin(m.body_rootid[m.geom_bodyid], carriages)
        m.geom_group[:] = np.where(theirs, np.maximum(self.groups, SHOWN), self.groups)
