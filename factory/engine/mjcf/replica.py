"""A copy of the engine's state that no run uses: to draw and to measure."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factory.engine.mjcf.masks import NOBODY, loose_code, masks_of, robot_code
from factory.engine.mjcf.pads import Pads, trunks
from factory.support.arrays import Array, Index, Indices
from factory.support.engine import mujoco

SHOWN = 3
"""Geoms of groups below this one are drawn."""


class Replica:
    """A model `m` and data `d` of its own, in which nothing sleeps, at the model's start."""

    NOBODY: ClassVar[int] = NOBODY

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m = copy(m)
        self.m.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self.d = mujoco.MjData(self.m)
        mujoco.mj_kinematics(self.m, self.d)

    def place(self, qpos: NDArray[Any]) -> None:
        """Put the joints at their positions `qpos` (nq,), the bodies and geoms where these have
        them."""
        self.d.qpos[:] = qpos
        mujoco.mj_kinematics(self.m, self.d)

    def switch(self, active: NDArray[np.int32]) -> None:
        """Make these constraints active and no others: rows (n, 3) of a constraint's number and its
        two bodies."""
        self.d.eq_active[:] = 0
        self.d.eq_active[active[:, 0]] = 1
        self.m.eq_obj1id[active[:, 0]] = active[:, 1]
        self.m.eq_obj2id[active[:, 0]] = active[:, 2]

    @staticmethod
    def robot_code(robot: int) -> int:
        """The code of a robot (index) as a holder of parts."""
        return robot_code(robot)

    @cached_property
    def trunk(self) -> Index:
        """For each body the one that it is a shell of; else itself (nbody,)."""
        return trunks(self.m)

    @cached_property
    def pads(self) -> Pads:
        """The pads of holders, and the geoms of parts that collide."""
        return Pads(self.m)

    def hold(self, body: int, code: int) -> None:
        """Give a part the contact masks of what a holder (code) holds, or of NOBODY."""
        self.mask(self.pads.solid[body], self.trunk == body, *masks_of(code))

    def release(self, body: int) -> None:
        """Give a part the contact masks of what nothing holds any more."""
        self.hold(body, loose_code(body))

    def exclude_nothing(self) -> None:
        """Let no pair of bodies be left out of contact."""
        self.m.exclude_signature[:] = -1

    def mask(
        self, geoms: NDArray[Any], bodies: NDArray[Any], contype: int, conaffinity: int
    ) -> None:
        """Give geoms and the bodies that they are of these masks."""
        self.m.geom_contype[geoms], self.m.geom_conaffinity[geoms] = contype, conaffinity
        self.m.body_contype[bodies], self.m.body_conaffinity[bodies] = contype, conaffinity


class Geoms:
    """What is drawn of a model.

    Attributes:
        m: the model.
    """

    SHOWN: ClassVar[int] = SHOWN

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m = m

    def shown(self, body: int) -> Iterator[int]:
        """The geoms of a body that are drawn: no planes, nothing hidden."""
        m, first = self.m, int(self.m.body_geomadr[body])
        for geom in range(first, first + int(m.body_geomnum[body])):
            plane = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
            if m.geom_group[geom] < SHOWN and not plane:
                yield geom

    def colour(self, geom: int) -> Array:
        """The colour (4,) of a geom or of its material, from 0 to 1."""
        m, material = self.m, self.m.geom_matid[geom]
        return np.asarray(m.mat_rgba[material] if material >= 0 else m.geom_rgba[geom], float)

    def mesh(self, geom: int) -> tuple[Array, Indices]:
        """The vertices (n, 3) [m] and faces (k, 3) of a geom's mesh, in its frame."""
        m, mesh = self.m, self.m.mesh(int(self.m.geom_dataid[geom]))
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        vertices = np.asarray(m.mesh_vert[first : first + count], float)
        first, count = int(mesh.faceadr[0]), int(mesh.facenum[0])
        return vertices, np.asarray(m.mesh_face[first : first + count], np.int64)
