"""Marks on the floor of a picture: under robots that stand, those that are dead, and round what
lies about, where no robot may come near."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from factory.mjcf import names
from factory.mjcf.replica import Replica
from factory.render.colours import AMBER, DEAD, FLASH
from factory.render.history import History
from factory.render.ink import Colour
from factory.render.subject import Snapshot
from factory.render.zones import Zones
from factory.support.engine import mujoco

ROBOT = 0.062
"""Radius of the mark under a robot [m]: it shows on all sides of its carriage."""

THIN = 1e-3
"""How thick a mark is [m]."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A disc on the floor: its middle and radius [m], its colour, and how opaque it is."""

    at: tuple[float, float]
    radius: float
    colour: Colour
    alpha: float

    def add_to(self, scene: mujoco.MjvScene) -> None:
        """Put it into a scene that has been filled, where there is room."""
        if scene.ngeom >= scene.maxgeom:
            return
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, np.array([self.radius, THIN / 2, 0.0])
        rgba = np.array([*(part / 255 for part in self.colour), self.alpha], np.float32)
        place = np.array([*self.at, THIN])
        mujoco.mjv_initGeom(scene.geoms[scene.ngeom], kind, size, place, np.eye(3).ravel(), rgba)
        scene.ngeom += 1


class Marks:
    """What is marked in pictures of a replica's model, as a history tells. Nothing is, while
    nothing has failed and no robot has stood."""

    def __init__(self, replica: Replica, history: History) -> None:
        self.replica, self.history, m = replica, history, replica.m
        robots = history.factory.robots
        self.carriages = [m.body(names.carriage(robot.name)).id for robot in robots]
        self.zones = Zones(m)

    def at(self, shown: Snapshot, time: float) -> Iterator[Mark]:
        """All at a time [s], with the replica as it is then."""
        history = self.history
        if not history.failings and not history.standing:
            return
        dead = history.dead(time)
        for robot in sorted(history.stands(time) | dead):
            x, y, _ = self.replica.d.xpos[self.carriages[robot]].tolist()
            yield Mark((x, y), ROBOT, DEAD if robot in dead else AMBER, 1.0)
        for x, y, radius in self.zones.at(self.replica.d, shown.body2):
            yield Mark((x, y), radius, FLASH, 0.35)
