"""An agent that follows the robots' programs: what our supervisor does, by commands alone."""

from __future__ import annotations

import numpy as np

from factory.api import NOPART, Operation
from factory.apps.environment.plant import EnvAction, EnvObservation, FactoryEnv
from factory.support.arrays import Array

NEAR = 2e-4
"""An axis is at its goal within this [m]."""

SLOW = 9e-3
"""An axis stands below this speed [m/s]."""


class Programs:
    """The baseline of an environment: each robot does the operations of its gear in their order,
    every one as soon as the net allows, and goes ahead to the next as far as its corridor lets it.

    It reads nothing but observations; programs and goals are those of the factory. A new one is
    made for each episode."""

    def __init__(self, env: FactoryEnv) -> None:
        self._factory, self._goals = env.factory, [mode.goals for mode in env.simulation.modes]
        robots = len(env.factory.robots)
        self._done, self._grip = [0] * robots, [False] * robots
        self._since = [np.inf] * len(env.factory.operations)
        self._setpoint: Array | None = None

    def act(self, seen: EnvObservation, time: float) -> EnvAction:
        """The action for an observation at a time [s]."""
        if self._setpoint is None:
            self._setpoint = seen["position"].copy()
        for operation in self._factory.operations:
            there = seen["marked"][operation.place] and self._there(operation, seen)
            began = self._since[operation.index]
            self._since[operation.index] = min(began, time) if there else np.inf
        jobs = [self._job(robot, seen, time, self._setpoint) for robot in range(len(seen["job"]))]
        return {
            "setpoint": np.clip(self._setpoint, seen["low"], seen["high"]),
            "grip": np.array(self._grip, np.int8),
            "job": np.array(jobs, np.int64),
        }

    def _there(self, operation: Operation, seen: EnvObservation) -> bool:
        """Whether all axes of an operation stand at their goals."""
        axes = [*self._factory.moves[operation.index]]
        off = np.abs(seen["position"][axes] - self._goals[operation.index])
        return bool((off < NEAR).all() and (np.abs(seen["speed"][axes]) < SLOW).all())

    def _job(self, robot: int, seen: EnvObservation, time: float, setpoint: Array) -> int:
        """The job of a robot now; its setpoints and its grip are set."""
        numbers = self._factory.robots[robot].operations
        operation = self._factory.operations[numbers[self._done[robot] % len(numbers)]]
        number, legal = operation.index + 1, seen["legal"][robot]
        axes = self._factory.moves[operation.index]
        for axis, goal in zip(axes, self._goals[operation.index].tolist(), strict=True):
            if self._factory.robot_of(axis) == robot:
                setpoint[axis] = goal
        if seen["job"][robot] != number:
            return number if legal[number] else 0
        holds = operation.after[operation.robots.index(robot)] != NOPART
        if operation.carrier == robot:
            joined = all(seen["job"][other] == number for other in operation.robots)
            ready = joined and time >= self._since[operation.index] + operation.dwell
            if ready:
                self._grip[robot] = holds
            ends = ready and holds == bool(seen["held"][robot]) and legal[0]
        else:
            ends = not seen["marked"][operation.place]
            if ends:
                self._grip[robot] = holds
                ends = bool(legal[0])
        if not ends:
            return number
        self._done[robot] += 1
        return 0
