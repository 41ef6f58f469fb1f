"""Interventions in a running factory, each as a deviation that strikes now: robots are pushed and
slowed down, feeders emptied; where it goes on after failures, faults of every kind strike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from factory.api import Simulation, names
from factory.apps.deviations import Campaign, Deviation, FaultInjector
from factory.apps.recovery import recover

FOR_EVER = 1e9
"""How long a feeder is blocked, until it is freed [s]."""


@dataclass(slots=True)
class Pushed:
    """A push of a robot, for display.

    Attributes:
        robot: the robot (index).
        force: ahead along its guidepath, negative backwards [N].
        end: when it ends [s].
        before: deviation of the robot from its setpoint before the push [m; rad of an arm].
        gave: greatest displacement by it [m].
        lever: how far it is displaced where it is pushed by a deviation of 1.
    """

    robot: int
    force: float
    end: float
    before: float
    gave: float = 0.0
    lever: float = 1.0


class Interventions:
    """Into a simulation. With a `campaign` it goes on after failures, and more of them can be made.

    Attributes:
        simulation: the simulation.
        recovery: its recovery, None where it does not go on after failures.
        pushed: the last push.
    """

    def __init__(self, simulation: Simulation, campaign: Campaign | None = None) -> None:
        self.simulation = simulation
        self.recovery = None if campaign is None else recover(simulation, campaign)
        injector = self.recovery.injector if self.recovery else FaultInjector(simulation)
        self._injector, self._condition = injector, injector.condition
        self._blocked: set[str] = set()
        self.pushed: Pushed | None = None

    @property
    def slowed(self) -> Mapping[int, float]:
        """Factors on the speeds of robots (index) that do not go at their full speed."""
        return MappingProxyType(self._condition.slowed)

    @property
    def blocked(self) -> frozenset[str]:
        """The labels of parts that are not given until they are freed."""
        return frozenset(self._blocked)

    def push(self, robot: int, share: float, seconds: float) -> None:
        """Push a robot (index) forwards, to where it delivers, with a `share` of the greatest force
        of its drive, backwards where that is negative, for so long from now on. An arm is pushed at
        its tool, with a share of the moment of its first joint's drive."""
        interference, layout = self._condition.interference, self.simulation.layout
        newtons, lever = share * interference.greatest_force(robot), 1.0
        x, y = layout.guidepaths[robot].heading
        force, off = (newtons * x, newtons * y, 0.0), interference.off(robot)
        body = names.carriage(self._name(robot))
        if layout.chains is not None and robot in layout.chains.robots:
            body = names.tool(self._name(robot))
            most, lever = interference.thrust(robot, self.simulation.physical.m.body(body).id)
            x, y, z = (share * most).tolist()
            force, newtons = (x, y, z), newtons / lever
        now = float(self.simulation.world.time)
        self.pushed = Pushed(robot, newtons, now + seconds, off, lever=lever)
        self.strike(Deviation("push", body=body, force=force, seconds=seconds))
        if self._see not in (hooks := self.simulation.world.hooks).before_step:
            hooks.before_step.append(self._see)

    def slow(self, robot: int, factor: float) -> None:
        """Let a robot (index) go at `factor` times its speed from now on; 1 gives it back."""
        self.strike(Deviation("slow", robot=self._name(robot), factor=factor))

    def block(self, label: str) -> None:
        """Let the feeder of a part give nothing."""
        self._blocked.add(label)
        self.strike(Deviation("no_part", label=label, at=0.0, seconds=FOR_EVER))

    def free(self, label: str) -> None:
        """Let it give parts again."""
        self._blocked.discard(label)
        self._condition.supply(label)

    def fail(self, kind: str, robot: int | None = None, label: str = "", **values: Any) -> None:
        """Let a fault of some kind strike as soon as it can: that of a robot (index) or of a label,
        where the kind has one, with the `values` of its parameters."""
        name = "" if robot is None else self._name(robot)
        self.strike(Deviation(kind, label, name, at=0.0, **values))

    def strike(self, deviation: Deviation) -> None:
        """Let a deviation strike now, or as soon as it can. Raises InputError (BadFault) where the
        factory does not go on after failures and would have to."""
        self._injector.strike(deviation, float(self.simulation.world.time))

    def _see(self) -> None:
        """Before a timestep, see how far the robot gives way that was pushed last."""
        pushed, world = self.pushed, self.simulation.world
        if pushed is None or world.time >= pushed.end:
            world.hooks.before_step.remove(self._see)
            return
        off = self._condition.interference.off(pushed.robot) - pushed.before
        pushed.gave = max(pushed.gave, pushed.lever * abs(off))

    def _name(self, robot: int) -> str:
        return self.simulation.layout.factory.robots[robot].name
