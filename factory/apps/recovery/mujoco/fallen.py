"""Fallen bodies: where they lie, and which robots could touch them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from factory.api import MujocoWorld
from factory.apps.recovery.sweeping import SweptFloor
from factory.floor.layout.bins import Bin

SETTLES = 0.5
"""So long after the last thing has been cleared away nothing shakes any more [s]."""


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
        speed = way / sqrt(2 * max(middle[2] - Bin.TOP / 2, Bin.TOP / 2) / -m.opt.gravity[2])
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


@dataclass(frozen=True, slots=True)
class Heap:
    """Fallen `bodies` by label, the time `until` which they lie [s], and the bin `into` which they
    fall, if any."""

    bodies: Mapping[str, int]
    until: float
    into: Bin | None = None


class Fallen:
    """What lies about in a world.

    Attributes:
        heaps: what has fallen together, each until it is cleared away.
        closed: robots (index) that could touch something outside its bin.
        binned: number of heaps that fell into a bin.
    """

    def __init__(self, world: MujocoWorld) -> None:
        self._world, self._swept = world, SweptFloor.of(world.model.layout)
        self._calm, self._jets = 0.0, Jets(world)
        self.binned = 0
        self.heaps: list[Heap] = []
        self.closed = frozenset[int]()

    def let_fall(self, robot: int, seconds: float, into: Bin | None = None) -> None:
        """Drop everything that a robot holds, to lie for some time [s], into a bin if one is
        given."""
        world = self._world
        bodies = world.parts.holdings.drop(world.parts.holdings.code(robot))
        self.heaps.append(Heap(bodies, world.time + seconds, into))
        if into is not None:
            self._jets.blow(bodies.values(), into)
        self.watch(bodies.values())
        world.motion.load([robot], [0.0])
        self.closed |= self._near()

    def tick(self) -> bool:
        """At the end of a tick, remove what has lain long enough. Returns whether anything was."""
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
        """Bodies may come anywhere from now on: every timestep is inspected."""
        self._world.inspection.pressing.fallen.update(bodies)
        self._world.hooks.step_singly = True

    def calm(self, bodies: Iterable[int]) -> None:
        """Bodies are back in their places, except those that lie about."""
        lie = {body for heap in self.heaps for body in heap.bodies.values()}
        self._world.inspection.pressing.fallen.difference_update({*bodies} - lie)

    def _forget(self) -> None:
        """Forget fallen bodies that are out of sight."""
        world, units = self._world, self._world.parts.masks.unit
        pressing = world.inspection.pressing
        pressing.fallen -= {body for body in pressing.fallen if units[body] < 0}
        if pressing.fallen:
            self._calm = world.time + SETTLES
        elif world.hooks.step_singly and world.time >= self._calm:
            pressing.shaken.clear()
            world.hooks.step_singly = False

    def _is_in_bin(self, heap: Heap) -> bool:
        """Whether all bodies of a heap are in its bin or sinking into it."""
        radius, d, into = self._world.model.carried.radius, self._world.d, heap.into
        extents = ((*d.xipos[body].tolist(), radius[label]) for label, body in heap.bodies.items())
        return into is not None and all(
            into.holds((x, y)) and z < Bin.TOP + far for x, y, z, far in extents
        )

    def _near(self) -> frozenset[int]:
        """Robots that could touch something that lies about now."""
        m, radius = self._world.m, self._world.model.carried.radius
        about = [heap for heap in self.heaps if not self._is_in_bin(heap)]
        lie = [(body, radius[label]) for h in about for label, body in h.bodies.items()]
        if not lie:
            return frozenset()
        bodies, radii = np.array([body for body, _ in lie]), np.array([r for _, r in lie])
        address = m.jnt_qposadr[m.body_jntadr[bodies]][:, None] + np.arange(2)
        return self._swept.near(self._world.d.qpos[address], radii)
