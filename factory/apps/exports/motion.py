"""Motion of the engine's bodies in a log, frame by frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from factory.api import Model
from factory.apps.log import Log
from factory.support.arrays import Array, Indices, Truth

if TYPE_CHECKING:
    from factory.support.engine import mujoco

RATE = 50.0
"""Greatest rate of frames [1/s]."""

MOST = 8_000_000
"""Greatest number of poses in all frames, which take 450 MB."""

STILL = 1e-6
"""Greatest displacement [m] from frame to frame, and change of a component of the quaternion, of a
body that counts as stationary."""


@dataclass(frozen=True)
class BodyMotion:
    """A log's motion: `rows` of the log that are frames; for each its bodies' positions (n, bodies,
    3) [m] and quaternions (n, bodies, 4), each relative to its parent."""

    m: mujoco.MjModel
    rows: Indices
    position: Array = field(repr=False)
    quaternion: Array = field(repr=False)

    def name(self, body: int) -> str:
        """The name of a body."""
        return str(self.m.body(body).name)

    def parent(self, body: int) -> str:
        """The name of the body that its pose is relative to."""
        return self.name(int(self.m.body_parentid[body]))

    def shown(self) -> Iterator[list[int]]:
        """For each frame the bodies whose pose a reader needs in order to interpolate linearly:
        those that have moved since the last frame or move before the next."""
        change = np.abs(np.diff(self.position, axis=0)).max(axis=2)
        turned = np.abs(np.diff(self.quaternion, axis=0)).max(axis=2)
        moved = (change > STILL) | (turned > STILL)
        ends = np.ones((1, moved.shape[1]), bool)
        needed = np.concatenate([ends, moved]) | np.concatenate([moved, ends])
        for frame in needed:
            yield [int(body) for body in np.flatnonzero(frame) if body]

    def unseen(self) -> Truth:
        """Whether a body is invisible in a frame (n, bodies): a spare one below the floor."""
        return np.asarray(self.position[:, :, 2] < Model.HIDDEN)


def motion_of(log: Log) -> BodyMotion:
    """The motion of a log. Raises InputError for a log of the ideal world or one without a tick."""
    from factory.api import Replica
    from factory.apps.log.model import model_of

    m = model_of(log)
    replica, rows = Replica(m), _frames(log, m.nbody)
    d = replica.d
    position = np.empty((len(rows), m.nbody, 3))
    quaternion = np.empty((len(rows), m.nbody, 4))
    for frame, row in enumerate(rows):
        replica.place(log.qpos[row])
        position[frame], quaternion[frame] = d.xpos, d.xquat
        for body in np.flatnonzero(m.body_parentid):
            place = position[frame, body], quaternion[frame, body]
            _relative(d, int(m.body_parentid[body]), int(body), *place)
    return BodyMotion(m, rows, position, quaternion)


def _relative(d: mujoco.MjData, parent: int, body: int, position: Array, turn: Array) -> None:
    """Write the pose of a body relative to its parent into `position` and `turn`."""
    from factory.support.engine import mujoco

    back = np.zeros(4)
    mujoco.mju_negQuat(back, d.xquat[parent])
    mujoco.mju_rotVecQuat(position, d.xpos[body] - d.xpos[parent], back)
    mujoco.mju_mulQuat(turn, back, d.xquat[body])


def _frames(log: Log, bodies: int) -> Indices:
    """Rows of a log, the first and the last included, at most RATE per second; fewer where their
    poses would be more than MOST."""
    kept, next_time = [], -np.inf
    rate = min(RATE, MOST / max(1.0, bodies * float(log.time[-1])))
    for row, time in enumerate(log.time.tolist()):
        if time >= next_time - 1e-9 or row == len(log) - 1:
            kept.append(row)
            next_time = time + 1 / rate
    return np.array(kept, np.int64)
