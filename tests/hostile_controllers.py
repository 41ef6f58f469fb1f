"""Controllers that mean harm, for tests: they drive axes, grips and jobs by chance, or change what
a program commands."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np

from factory.apps.plc.signals import Commands, Controller, Sensed
from factory.floor.layout.layout import Layout

SOON = 0.4
"""Mean time between two changes of mind [s]."""


class HostileController:
    """Changes the commands of a controller by chance, drawn from a `seed`: targets anywhere on the
    guidepaths and beyond, jobs and grips of any kind. Of a program, it changes a few robots at a
    time."""

    def __init__(self, layout: Layout, seed: int, program: Controller | None = None) -> None:
        self._draw, self._program = Random(seed), program
        strokes = [high for _, high in layout.spans[len(layout.guidepaths) :]]
        self._ways = [*(path.length for path in layout.guidepaths), *strokes]
        self._jobs = len(layout.factory.operations)
        self._robots = len(layout.factory.robots)
        self._next, self._last = 0.0, None if program else self._idle()
        self._changes = dict[tuple[str, int], float]()

    def _idle(self) -> Commands:
        return Commands(np.zeros(len(self._ways)), (False,) * self._robots, (0,) * self._robots)

    def scan(self, sensed: Sensed) -> Commands:
        draw = self._draw
        if self._program is not None:
            self._last = self._program.scan(sensed)
        elif not self._next:
            self._last = replace(self._idle(), target=sensed.position.copy())
        if sensed.time >= self._next:
            self._next = sensed.time + draw.expovariate(1 / SOON)
            self._changes = {} if self._program else self._changes
            for _ in range(draw.randint(1, 3)):
                self._change()
        return self._changed()

    def _change(self) -> None:
        draw = self._draw
        kind = draw.choice(["target", "target", "target", "job", "grip"])
        if kind == "target":
            axis = draw.randrange(len(self._ways))
            at = draw.choice([0.0, 1.0, draw.random(), draw.random(), -1e308, 1e308, 3.0])
            self._changes[kind, axis] = at * self._ways[axis] if abs(at) <= 3.0 else at
        else:
            most = self._jobs + 2 if kind == "job" else 2
            self._changes[kind, draw.randrange(self._robots)] = draw.randrange(most)

    def _changed(self) -> Commands:
        assert self._last is not None
        target, grip, job = self._last.target.copy(), [*self._last.grip], [*self._last.job]
        for (kind, which), value in self._changes.items():
            if kind == "target":
                target[which] = value
            elif kind == "job":
                job[which] = int(value)
            else:
                grip[which] = bool(value)
        return Commands(target, tuple(grip), tuple(job))
