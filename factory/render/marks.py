"""Marks on the floor of a picture: under robots that stand, those that are dead, and round what
lies about, where no robot may come near."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from factory.layout.sweeping import APART
from factory.mjcf import names
from factory.mjcf.replica import Replica
from factory.render.colours import AMBER, DEAD, FLASH
from factory.render.history import History
from factory.render.ink import Colour
from factory.render.subject import Snapshot
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
        bodies = np.arange(m.nbody)
        loose = [names.kind(m.body(b).name) == "part" and m.body_dofnum[b] > 0 for b in bodies]
        self.parts = bodies[np.array(loose, bool)]
        self.radii = np.zeros(m.nbody)
        far = np.linalg.norm(m.geom_pos, axis=1) + m.geom_rbound
        np.maximum.at(self.radii, m.geom_bodyid, far)
        self.bins = [b for b in bodies.tolist() if names.kind(m.body(b).name) == "bin"]

    def at(self, shown: Snapshot, time: float) -> Iterator[Mark]:
        """All at a time [s], with the replica as it is then."""
        history = self.history
        if not history.failings and not history.standing:
            return
        dead = history.dead(time)
        for robot in sorted(history.stands(time) | dead):
            x, y, _ = self.replica.d.xpos[self.carriages[robot]].tolist()
            yield Mark((x, y), ROBOT, DEAD if robot in dead else AMBER, 1.0)
        for body in np.setdiff1d(self.parts, shown.body2).tolist():
            x, y, z = self.replica.d.xpos[body].tolist()
            if z > 0.0 and not any(self._is_over(one, x, y) for one in self.bins):
                yield Mark((x, y), float(self.radii[body]) + APART, FLASH, 0.35)

    def _is_over(self, bin_: int, x: float, y: float) -> bool:
        """Whether a place is over a bin, by its bottom plate."""
        bottom = int(self.replica.m.body_geomadr[bin_])
        half, at = self.replica.m.geom_size[bottom], self.replica.d.geom_xpos[bottom]
        return bool(abs(x - at[0]) <= half[0] and abs(y - at[1]) <= half[1])
