"""Sensors of grips, joints and presented parts."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf.masks import robot_code
from factory.mjcf.weld_frames import WeldFrames
from factory.plant.factory import Operation
from factory.simulation.mujoco.world import MujocoWorld
from factory.simulation.recovery.faults import Campaign

LOST = 5e-3
"""A part further than this from its place in the hand is lost [m]."""

TURNED = 0.05
"""What a feeder shows is askew, too, when it is turned so far [rad]."""


class Senses:
    """The sensors of a world, with normal errors of standard deviation `noise` [m]."""

    def __init__(self, world: MujocoWorld, campaign: Campaign) -> None:
        self._world, self._noise = world, campaign.sensors.noise
        self._delay, self._draw = campaign.sensors.delay, np.random.default_rng((campaign.seed, 1))
        self._frames, self._seen = WeldFrames.of(world.m, world.d), -1
        self._welds = self._bodies = self._robots = np.empty(0, np.intp)
        self._since: dict[int, float] = {}

    def unfelt(self) -> frozenset[int]:
        """Robots (index) whose grip sensors do not report their payload now: there is no grip, or
        the payload is not in its place."""
        holdings, d = self._world.parts.holdings, self._world.d
        if self._seen != holdings.changes:
            self._seen = holdings.changes
            held = [
                (holdings.weld[robot_code(robot), label], body, robot)
                for robot, bodies in holdings.in_hands().items()
                for label, body in bodies.items()
            ]
            self._welds, self._bodies, self._robots = np.array(held, np.intp).reshape(-1, 3).T
        off = np.linalg.norm(self._gaps(self._welds, self._bodies), axis=1)
        gone = (off > LOST) | (d.eq_active[self._welds] == 0)
        return frozenset(self._robots[gone].tolist())

    def lost(self) -> list[int]:
        """Robots (index) whose payload has not been reported for at least the sensors' delay."""
        now = self._world.time
        self._since = {robot: self._since.get(robot, now) for robot in sorted(self.unfelt())}
        return [robot for robot, since in self._since.items() if now - since >= self._delay]

    def residual(self, operation: Operation) -> float:
        """Measured distance of inputs from their places in a joint about to be made [m]."""
        holdings = self._world.parts.holdings
        held = [
            (holdings.weld[robot_code(operation.carrier), label], body)
            for robot in operation.robots
            if robot != operation.carrier
            for label, body in holdings.hand(robot).items()
        ]
        if not held:
            return 0.0
        gaps = self._gaps(*np.array(held).T)
        gaps += self._noise * self._draw.normal(size=gaps.shape)
        return float(np.linalg.norm(gaps, axis=1).max())

    def is_askew(self, label: str, body: int, place: Array) -> bool:
        """Whether a feeder's camera finds the part displaced or turned from its `place` (3,)
        [m]."""
        test = self._world.model.factory.by_label[label].template.failure("misplaced")
        if test is None or test.limit is None:
            return False
        m = self._world.m
        address = m.jnt_qposadr[m.body_jntadr[body]] + np.arange(7)
        pose, upright = self._world.d.qpos[address], m.qpos0[address[3:]]
        off = np.linalg.norm(pose[:3] - place + self._noise * self._draw.normal(size=3))
        return bool(
            off > test.limit or 2 * np.arccos(min(1.0, abs(float(pose[3:] @ upright)))) > TURNED
        )

    def _gaps(self, welds: Index, bodies: Index) -> Array:
        """Distances of bodies from where welds should hold them (n,) [m]."""
        m, q, frames = self._world.m, self._world.d.qpos, self._frames.chosen(welds)
        place = q[m.jnt_qposadr[m.body_jntadr[bodies]][:, None] + np.arange(3)]
        return np.asarray(place - frames.at(q[frames.along]))
