"""Somebody's hands in a running factory: they push robots, slow them down, and block feeders."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from factory.control.mode import Limits
from factory.mjcf import names
from factory.plant.factory import Operation
from factory.support.errors import Diagnostic, InputError

if TYPE_CHECKING:
    from factory.simulation.simulation import Simulation


class Hands:
    """On a simulation in MuJoCo; `let_go` must be called after every tick.

    A robot is pushed along its guidepath; one that is slowed knows it, nobody else does; a feeder
    that is blocked gives no part. `slowed`: factors on the speeds of robots (index); `blocked`: the
    labels of parts.
    """

    def __init__(self, simulation: Simulation) -> None:
        if simulation.model is None:
            message = "the ideal world has nothing to push"
            raise InputError(Diagnostic("BadValue", message, None, "take the world mujoco"))
        self._simulation, self._world = simulation, simulation.world
        self._layout, self._limits = simulation.layout, simulation.limits
        self._slowed: dict[int, float] = {}
        self._blocked: set[str] = set()
        self._pushed: dict[int, float] = {}
        self._prepared = self._world.prepared
        self._world.prepared = self._is_prepared

    @property
    def slowed(self) -> Mapping[int, float]:
        """The robots that do not go at their full speed."""
        return MappingProxyType(self._slowed)

    @property
    def blocked(self) -> frozenset[str]:
        """The parts that are not given."""
        return frozenset(self._blocked)

    def push(self, robot: int, share: float, seconds: float) -> None:
        """Push a robot forwards, to where it delivers, with a `share` of the greatest force of its
        drive, backwards where that is negative, for so long from now on."""
        world = self._world
        name = self._layout.factory.robots[robot].name
        body = int(world.m.body(names.carriage(name)).id)
        newtons = share * float(world.m.actuator(names.drive(name)).forcerange[1])
        heading = np.array([*self._layout.guidepaths[robot].heading, 0.0])
        world.vicinity.everything()
        world.d.xfrc_applied[body, :3] = newtons * heading
        self._pushed[body] = world.time + seconds

    def slow(self, robot: int, factor: float) -> None:
        """Let a robot go at `factor` times its speed from now on; 1 gives it back."""
        self._slowed[robot] = factor
        if factor == 1.0:
            del self._slowed[robot]
        speed = np.array(self._limits.speed)
        for number, share in self._slowed.items():
            speed[self._world.axes_of(number)] *= share
        self._simulation.supervisor.limit(Limits(speed, self._limits.acceleration))

    def block(self, label: str) -> None:
        """Let the feeder of a part give nothing."""
        self._blocked.add(label)

    def free(self, label: str) -> None:
        """Let it give parts again."""
        self._blocked.discard(label)
        self._world.supplied = True

    def let_go(self) -> None:
        """End the pushes whose time is over."""
        now = self._world.time
        for body in [body for body, end in self._pushed.items() if now >= end]:
            self._world.d.xfrc_applied[body, :3] = 0.0
            del self._pushed[body]

    def _is_prepared(self, operation: Operation, unit: int) -> bool:
        taken = not operation.inputs and operation.label in self._blocked
        return not taken and bool(self._prepared(operation, unit))
