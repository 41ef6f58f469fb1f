"""Failures in a picture: marks on the floor under robots that stand still or are dead, zones around
fallen parts, and robots that were removed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import Replica
from factory.film.action import Snapshot
from factory.film.colours import AMBER, DEAD
from factory.film.history import History
from factory.floor.layout.dimensions import APART
from factory.support.engine import mujoco
from factory.support.pictures.ink import FLASH, Colour

Zone = tuple[float, float, float]
"""The middle and the radius of a disc on the floor [m]."""


class Zones:
    """Discs on the floor around fallen parts, where no robot may come near: bodies of parts that
    nothing holds, except those below the floor or over a bin."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m, bodies = m, np.arange(m.nbody)
        loose = [names.kind(m.body(b).name) == "part" and m.body_dofnum[b] > 0 for b in bodies]
        self.parts = bodies[np.array(loose, bool)]
        self.radii = np.zeros(m.nbody)
        far = np.linalg.norm(m.geom_pos, axis=1) + m.geom_rbound
        np.maximum.at(self.radii, m.geom_bodyid, far)
        self.bins = [b for b in bodies.tolist() if names.kind(m.body(b).name) == "bin"]

    def at(self, d: mujoco.MjData, held: NDArray[np.int32]) -> list[Zone]:
        """The zones in a state of the engine in which these bodies are `held`."""
        zones = list[Zone]()
        for body in np.setdiff1d(self.parts, held).tolist():
            x, y, z = d.xpos[body].tolist()
            if z > 0.0 and not any(self._is_over(d, one, x, y) for one in self.bins):
                zones.append((x, y, float(self.radii[body]) + APART))
        return zones

    def _is_over(self, d: mujoco.MjData, bin_: int, x: float, y: float) -> bool:
        """Whether a place is over a bin, by its bottom plate."""
        bottom = int(self.m.body_geomadr[bin_])
        half, at = self.m.geom_size[bottom], d.geom_xpos[bottom]
        return bool(abs(x - at[0]) <= half[0] and abs(y - at[1]) <= half[1])


ROBOT = 0.062
"""Radius of the mark under a robot [m], larger than its carriage."""

THIN = 1e-3
"""Thickness of a mark [m]."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A disc on the floor: its middle and radius [m], its colour, and how opaque it is."""

    at: tuple[float, float]
    radius: float
    colour: Colour
    alpha: float

    def add_to(self, scene: mujoco.MjvScene) -> None:
        """Add it to a scene that has been filled, if there is room."""
        if scene.ngeom >= scene.maxgeom:
            return
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, np.array([self.radius, THIN / 2, 0.0])
        rgba = np.array([*(part / 255 for part in self.colour), self.alpha], np.float32)
        place = np.array([*self.at, THIN])
        mujoco.mjv_initGeom(scene.geoms[scene.ngeom], kind, size, place, np.eye(3).ravel(), rgba)
        scene.ngeom += 1


class Marks:
    """The marks in pictures of a replica's model, from a history: none before a first failure or
    a first robot that stands still."""

    def __init__(self, replica: Replica, history: History) -> None:
        self.replica, self.history, m = replica, history, replica.m
        robots = history.factory.robots
        self.carriages = [m.body(names.carriage(robot.name)).id for robot in robots]
        self.zones = Zones(m)

    def at(self, shown: Snapshot, time: float) -> Iterator[Mark]:
        """The marks at a time [s]; the replica is in the state of that time."""
        history = self.history
        if not history.failings and not history.standing:
            return
        dead = history.dead(time)
        for robot in sorted(history.stands(time) | dead):
            x, y, _ = self.replica.d.xpos[self.carriages[robot]].tolist()
            yield Mark((x, y), ROBOT, DEAD if robot in dead else AMBER, 1.0)
        for x, y, radius in self.zones.at(self.replica.d, shown.body2):
            yield Mark((x, y), radius, FLASH, 0.35)
