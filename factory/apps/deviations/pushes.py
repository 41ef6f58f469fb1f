"""Pushes: forces that act on bodies for a while, to whole timesteps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.api import MujocoWorld
from factory.apps.deviations.deviation import Vector
from factory.apps.deviations.interference import Interference


@dataclass(slots=True)
class Push:
    """A force on a body.

    Attributes:
        body: the body (index).
        force: in the directions of the world [N].
        start, end: when it acts [s].
    """

    body: int
    force: Vector
    start: float
    end: float


class Pushes:
    """The pushes of a world: those that act on one body add up. While one is due or acts, the world
    takes its timesteps singly."""

    def __init__(self, world: MujocoWorld, interference: Interference) -> None:
        self._world, self._interference = world, interference
        self._pushes: list[Push] = []

    def add(self, body: int, force: Vector, start: float, end: float) -> None:
        """Let a force [N] act on a body from a time to another [s], which may be now."""
        before_step = self._world.hooks.before_step
        if not self._pushes:
            before_step.insert(0, self._act)
        self._pushes.append(Push(body, force, start, end))
        self._act()

    def _act(self) -> None:
        """Before a timestep: set the forces that act in it, and forget the pushes that are over."""
        now, half = self._world.time, self._world.model.settings.step / 2
        forces = {push.body: np.zeros(3) for push in self._pushes}
        for push in self._pushes:
            if push.start - half <= now < push.end - half:
                forces[push.body] += push.force
        self._pushes = [push for push in self._pushes if now < push.end - half]
        for body, force in forces.items():
            self._interference.push(body, force)
        if not self._pushes and self._act in self._world.hooks.before_step:
            self._world.hooks.before_step.remove(self._act)
