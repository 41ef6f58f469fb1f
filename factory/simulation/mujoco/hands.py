"""What robots hold, and the welds by which they hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from factory.mjcf import names
from factory.mjcf.grips import grips_of
from factory.mjcf.model import Model
from factory.simulation.mujoco.welds import Welds
from factory.support.engine import mujoco


@dataclass(slots=True)
class Grasp:
    """The `bodies` that a robot holds, by label, and the `unit` that they are for."""

    unit: int
    bodies: dict[str, int]


class Grasps:
    """The hands of all robots: `of[robot]` for each that holds something (index); `grip`: the weld
    by which a robot holds a label; `changes`: how often any has taken something or let go."""

    def __init__(self, m: mujoco.MjModel, model: Model, welds: Welds) -> None:
        self.of: dict[int, Grasp] = {}
        self.changes = 0
        self._welds, self._mass = welds, model.carried.mass
        robots = model.factory.robots
        self.grip = {
            (grip.robot, grip.label): m.equality(names.grip(robots[grip.robot].name, grip.label)).id
            for grip in grips_of(model.layout, model.carried)
        }

    def take(self, robot: int, unit: int, bodies: Mapping[str, int]) -> None:
        """A robot takes bodies over: their gaps are measured."""
        self._welds.grip({self.grip[robot, label]: body for label, body in bodies.items()})
        self._hold(robot, unit, bodies)

    def begin_with(self, robot: int, unit: int, bodies: Mapping[str, int]) -> None:
        """A robot has bodies that come from no other hand."""
        self._welds.join({self.grip[robot, label]: body for label, body in bodies.items()})
        self._hold(robot, unit, bodies)

    def _hold(self, robot: int, unit: int, bodies: Mapping[str, int]) -> None:
        self.changes += 1
        self._welds.hold(bodies.values(), robot + 1)
        self.of.setdefault(robot, Grasp(unit, {})).bodies.update(bodies)

    def let_go(self, robot: int) -> Grasp:
        """A robot lets go of all that it holds, and says what that was."""
        self.changes += 1
        hand = self.of.pop(robot)
        self._welds.loose([self.grip[robot, label] for label in hand.bodies])
        return hand

    def loads(self) -> dict[int, float]:
        """What each robot that holds something carries [kg]."""
        return {r: sum(self._mass[label] for label in hand.bodies) for r, hand in self.of.items()}
