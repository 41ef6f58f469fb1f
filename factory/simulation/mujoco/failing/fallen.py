"""What has fallen: where it lies, and which robots could touch it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from factory.layout.bins import TOP, Bin
from factory.layout.sweeping import SweptFloor
from factory.mjcf.masks import robot_code
from factory.simulation.mujoco.failing.jets import Jets
from factory.simulation.mujoco.world import MujocoWorld, anything

SETTLES = 0.5
"""So long after the last thing has been cleared away nothing shakes any more [s]."""


@dataclass(frozen=True, slots=True)
class Heap:
    """The `bodies` of something that has fallen, by label, `until` when they lie [s], and the bin
    `into` which they are to fall, if any."""

    bodies: Mapping[str, int]
    until: float
    into: Bin | None = None


class Fallen:
    """What lies about in a world: `heaps`; `closed`: the robots (index) that could touch it, but
    for what lies in its bin; `binned`: how often something has fallen into one."""

    def __init__(self, world: MujocoWorld) -> None:
        self._world, self._swept = world, SweptFloor.of(world.model.layout)
        self._calm, self._jets = 0.0, Jets(world)
        self.binned = 0
        self.heaps: list[Heap] = []
        self.closed = frozenset[int]()

    def let_fall(self, robot: int, seconds: float, into: Bin | None = None) -> None:
        """A robot lets go of all that it holds, which lies for so long [s], in a bin where one is
        given."""
        world = self._world
        bodies = world.parts.holdings.drop(robot_code(robot))
        self.heaps.append(Heap(bodies, world.time + seconds, into))
        if into is not None:
            self._jets.blow(bodies.values(), into)
        self.watch(bodies.values())
        world.motion.load([robot], [0.0])
        self.closed |= self._near()

    def tick(self) -> bool:
        """A tick is over: what has lain long enough is cleared away. Whether anything was."""
        parts, now = self._world.parts, self._world.time
        self._jets.tick()
        over = [heap for heap in self.heaps if heap.until <= now]
        for heap in over:
            self.heaps.remove(heap)
            self.binned += self._is_in_bin(heap)
            parts.holdings.put_away(heap.bodies.values())
        if over:
            parts.welds.write()
        self._forget()
        self.closed = self._near() if self.heaps else frozenset()
        return bool(over)

    def watch(self, bodies: Iterable[int]) -> None:
        """From now on bodies may come anywhere: all is looked at in every timestep."""
        world = self._world
        world.inspection.pressing.fallen.update(bodies)
        if anything not in world.hooks.before_step:
            world.hooks.before_step.append(anything)

    def calm(self, bodies: Iterable[int]) -> None:
        """Bodies are where they should be again, but for those that lie about."""
        lie = {body for heap in self.heaps for body in heap.bodies.values()}
        self._world.inspection.pressing.fallen.difference_update({*bodies} - lie)

    def _forget(self) -> None:
        """What is out of sight has not fallen."""
        world, units = self._world, self._world.parts.masks.unit
        pressing = world.inspection.pressing
        pressing.fallen -= {body for body in pressing.fallen if units[body] < 0}
        if pressing.fallen:
            self._calm = world.time + SETTLES
        elif anything in world.hooks.before_step and world.time >= self._calm:
            pressing.shaken.clear()
            world.hooks.before_step.remove(anything)

    def _is_in_bin(self, heap: Heap) -> bool:
        """Whether all of a heap is in its bin, or sinks into it."""
        radius, d, into = self._world.model.carried.radius, self._world.d, heap.into
        found = ((*d.xipos[body].tolist(), radius[label]) for label, body in heap.bodies.items())
        return into is not None and all(
            into.holds((x, y)) and z < TOP + far for x, y, z, far in found
        )

    def _near(self) -> frozenset[int]:
        """The robots that could touch what lies about now."""
        m, radius = self._world.m, self._world.model.carried.radius
        about = [heap for heap in self.heaps if not self._is_in_bin(heap)]
        lie = [(body, radius[label]) for h in about for label, body in h.bodies.items()]
        if not lie:
            return frozenset()
        bodies, radii = np.array([body for body, _ in lie]), np.array([r for _, r in lie])
        address = m.jnt_qposadr[m.body_jntadr[bodies]][:, None] + np.arange(2)
        return self._swept.near(self._world.d.qpos[address], radii)
