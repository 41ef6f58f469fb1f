"""Disturbances put to work in a simulation that is ready to run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from factory.api import (
    Array,
    Diagnostic,
    Index,
    InputError,
    Limits,
    MujocoWorld,
    Simulation,
    did_you_mean,
)
from factory.apps.disturbance.interference import Interference, Measure
from factory.apps.disturbance.values import (
    Delay,
    Disturbance,
    Dragged,
    Friction,
    Gain,
    Mass,
    Noise,
    Push,
    Slowed,
)


def disturb(simulation: Simulation, *disturbances: Disturbance) -> Simulation:
    """The same simulation, disturbed; call it once, before `run`. With no disturbances it is
    untouched.

    Raises InputError (BadValue) in the ideal world, which has no bodies, and where a disturbance
    names a body, part or robot that is not there.
    """
    if not disturbances:
        return simulation
    world = simulation.world
    if not isinstance(world, MujocoWorld):
        raise _bad("the ideal world has nothing to disturb", "take the world mujoco")
    acting = _Acting(simulation, world)
    for disturbance in disturbances:
        acting.add(disturbance)
    if acting.pushes:
        world.hooks.before_step.insert(0, acting.push)
    return simulation


class _Acting:
    """The disturbances of one world, by names; `pushes`: bodies that are pushed at some time."""

    def __init__(self, simulation: Simulation, world: MujocoWorld) -> None:
        self.simulation, self.world = simulation, world
        self.interference = Interference(world)
        self.pushes: list[tuple[int, Push]] = []

    def add(self, disturbance: Disturbance) -> None:
        act, count = self.interference, self.world.motion.axes.tray
        match disturbance:
            case Push():
                self.pushes.append((self._body(disturbance.body), disturbance))
            case Mass():
                act.weigh(self._parts(disturbance.parts), disturbance.factor)
            case Gain():
                act.weaken(self._axes(disturbance.robots), disturbance.factor)
            case Friction():
                act.rub(self._axes(disturbance.robots), disturbance.newtons)
            case Noise():
                act.mismeasure(_noise(disturbance, count))
            case Delay():
                late = round(disturbance.seconds / self.world.model.settings.step)
                act.mismeasure(_late(deque(maxlen=late + 1)))
            case Slowed():
                limits, axes = self.simulation.limits, self._axes((disturbance.robot,))
                speed = np.array(limits.speed)
                speed[axes] *= disturbance.factor
                self.simulation.limit(Limits(speed, limits.acceleration))
            case Dragged():
                axes = self._axes((disturbance.robot,))
                act.drag(axes, disturbance.factor * self.simulation.limits.speed[axes])

    def push(self) -> None:
        """Before a timestep: the sum of the forces that act on each body in it."""
        now, half = self.world.time, self.world.model.settings.step / 2
        forces = {body: np.zeros(3) for body, _ in self.pushes}
        for body, push in self.pushes:
            if push.at - half <= now < push.at + push.duration - half:
                forces[body] += push.force
        for body, force in forces.items():
            self.interference.push(body, force)

    def _parts(self, labels: Iterable[str]) -> list[int]:
        """The bodies of all copies of some labels, of all for none."""
        copies = self.world.parts.holdings.body
        for label in labels:
            _known(label, copies, "part")
        return [int(body) for label in labels or copies for body in copies[label]]

    def _axes(self, robots: Iterable[str]) -> Index:
        """The axes of some robots, of all for none."""
        chosen = dict.fromkeys(robots)
        if not chosen:
            return np.arange(self.world.motion.axes.tray)
        number = {robot.name: robot.index for robot in self.simulation.layout.factory.robots}
        for name in chosen:
            _known(name, number, "robot")
        of_robot = self.world.motion.axes.of_robot
        return np.array(sorted(axis for name in chosen for axis in of_robot(number[name])), np.intp)

    def _body(self, name: str) -> int:
        m = self.world.m
        _known(name, [m.body(n).name for n in range(1, m.nbody)], "body")
        return int(m.body(name).id)


def _noise(noise: Noise, axes: int) -> Measure:
    draw = np.random.default_rng(noise.seed)

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        return q + noise.metres * draw.normal(size=axes), v + noise.speed * draw.normal(size=axes)

    return measure


def _late(kept: deque[tuple[Array, Array]]) -> Measure:
    """The oldest of the last measurements."""

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        kept.append((q, v))
        return kept[0]

    return measure


def _known(name: str, names: Iterable[str], kind: str) -> None:
    if name not in names:
        hint = did_you_mean(name, sorted(names), f"{kind} names")
        raise _bad(f"there is no {kind} '{name}' to disturb", hint)


def _bad(message: str, hint: str) -> InputError:
    return InputError(Diagnostic("BadValue", message, None, hint))
