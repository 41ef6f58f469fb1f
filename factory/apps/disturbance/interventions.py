"""Interventions in a running factory: robots are pushed and slowed down, feeders blocked; where it
goes on after failures, faults of every kind strike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from factory.api import Diagnostic, InputError, Limits, MujocoWorld, Operation, Simulation, names
from factory.apps.disturbance.interference import Interference
from factory.apps.recovery import Campaign, WorldFault, recover


@dataclass(slots=True)
class Pushed:
    """A push of a robot (index) with a `force` [N] ahead, negative backwards, until a time `end`
    [s]; `gave`: how far at most the robot has been off its setpoint for it [m], by what it was off
    `before`."""

    robot: int
    force: float
    end: float
    before: float
    gave: float = 0.0


class Interventions:
    """Into a simulation in MuJoCo.

    A robot is pushed along its guidepath. One that is slowed down knows its new limits; no other
    robot does. A feeder that is blocked gives no part. With a `campaign` the simulation goes on
    after failures, and more of them can be made. `pushed`: the last push.
    """

    def __init__(self, simulation: Simulation, campaign: Campaign | None = None) -> None:
        if not isinstance(simulation.world, MujocoWorld):
            message = "the ideal world has nothing to push"
            raise InputError(Diagnostic("BadValue", message, None, "take the world mujoco"))
        self.simulation, self._world = simulation, simulation.world
        self.recovery = None if campaign is None else recover(simulation, campaign)
        self._interference = Interference(simulation.world)
        self._limits = simulation.limits
        self._slowed: dict[int, float] = {}
        self._blocked: set[str] = set()
        self._pushed: dict[int, Pushed] = {}
        self.pushed: Pushed | None = None
        self._world.hooks.gates.append(self._admits)

    @property
    def slowed(self) -> Mapping[int, float]:
        """Factors on the speeds of robots (index) that do not go at their full speed."""
        return MappingProxyType(self._slowed)

    @property
    def blocked(self) -> frozenset[str]:
        """The labels of parts that are not given."""
        return frozenset(self._blocked)

    def push(self, robot: int, share: float, seconds: float) -> None:
        """Push a robot forwards, to where it delivers, with a `share` of the greatest force of its
        drive, backwards where that is negative, for so long from now on."""
        layout = self.simulation.layout
        body = int(self._world.m.body(names.carriage(layout.factory.robots[robot].name)).id)
        heading = np.array([*layout.guidepaths[robot].heading, 0.0])
        newtons = share * self._interference.greatest_force(robot)
        self._interference.push(body, newtons * heading)
        if not self._pushed:
            self._world.hooks.before_step.append(self._let_go)
        end, off = self._world.time + seconds, self._interference.off(robot)
        pushed = self._pushed.setdefault(body, Pushed(robot, newtons, end, off))
        pushed.force, pushed.end, self.pushed = newtons, end, pushed

    def slow(self, robot: int, factor: float) -> None:
        """Let a robot go at `factor` times its speed from now on; 1 gives it back."""
        self._slowed[robot] = factor
        if factor == 1.0:
            del self._slowed[robot]
        speed = np.array(self._limits.speed)
        for number, share in self._slowed.items():
            speed[self._world.motion.axes.of_robot(number)] *= share
        limits = Limits(speed, self._limits.acceleration)
        if self.recovery is None:
            self.simulation.limit(limits)
        else:
            self.recovery.responding.standing.limit(limits)

    def block(self, label: str) -> None:
        """Let the feeder of a part give nothing."""
        self._blocked.add(label)

    def free(self, label: str) -> None:
        """Let it give parts again."""
        self._blocked.discard(label)
        self._world.supplied = True

    def fail(
        self, kind: str, robot: int | None = None, label: str = "", seconds: float = 0.0
    ) -> None:
        """Let a fault of some kind strike as soon as it can: that of a robot (index) or of a label,
        where the kind has one, for so long where it lasts. Raises InputError (BadFault)."""
        if self.recovery is None:
            message = "this factory does not go on after failures"
            raise InputError(Diagnostic("BadFault", message, None, "give --spares or --faults"))
        name = "" if robot is None else self.simulation.layout.factory.robots[robot].name
        now = float(self._world.time)
        self.recovery.strike(WorldFault(kind, label, name, at=now, seconds=seconds))

    def _let_go(self) -> None:
        """Before a timestep: see how far robots give way, and end the pushes whose time is over."""
        now = self._world.time
        for pushed in self._pushed.values():
            off = self._interference.off(pushed.robot) - pushed.before
            pushed.gave = max(pushed.gave, abs(off))
        for body in [body for body, pushed in self._pushed.items() if now >= pushed.end]:
            self._interference.push(body, None)
            del self._pushed[body]
        if not self._pushed:
            self._world.hooks.before_step.remove(self._let_go)

    def _admits(self, operation: Operation, unit: int) -> bool:
        return bool(operation.inputs) or operation.label not in self._blocked
