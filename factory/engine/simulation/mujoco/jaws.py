"""The jaws of grippers: they close on what a robot takes where it dwells, and open where it has
released it. Down is closed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.jaws import clamps_of, jaw_ticks
from factory.engine.mjcf.model import Model
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.engine.simulation.mujoco.strokes import Strokes, Stroking
from factory.support.arrays import Index
from factory.support.engine import mujoco
from factory.theory.plant.gripping import JAW_ACCELERATION, JAW_SPEED, takes
from factory.theory.plant.operation import Operation


class Jaws:
    """The jaws of a model's robots, each once for every payload that it closes on.

    Args:
        arrays: the arrays of the model.
        d: the engine's data.
        model: the MJCF model.
        sleep: what wakes them.
    """

    def __init__(self, arrays: ModelArrays, d: mujoco.MjData, model: Model, sleep: Sleep) -> None:
        m, self._factory, settings = arrays.m, model.factory, model.settings
        self._rows: dict[tuple[int, int], Index] = {}
        self._closed, self._closing = dict[int, Index](), set[int]()
        self._moves: Stroking | None = None
        self._faces: dict[int, list[int]] = {}
        called, closed = list[str](), list[float]()
        for robot, clamp in clamps_of(model.layout):
            faces = (names.jaw_face(robot.name, jaw.name) for jaw in clamp.jaws)
            self._faces[robot.index] = [m.geom(face).id for face in faces]
            for tour, each in enumerate(clamp.closed):
                self._rows[robot.index, tour] = len(called) + np.arange(len(each))
                called += [names.jaw(robot.name, jaw.name) for jaw in clamp.jaws]
                closed += each
        if not called:
            return
        joint = np.array([m.joint(name).id for name in called])
        actuators = np.array([m.actuator(name).id for name in called])
        body, limits = m.jnt_bodyid[joint], (JAW_SPEED, JAW_ACCELERATION)
        inertia = m.body_subtreemass[body] + m.dof_armature[m.jnt_dofadr[joint]]
        drives = Drives(arrays, d, actuators, inertia.round(9))

        def load(chosen: Index, down: bool) -> None:
            """A payload rests on the pad: jaws move nothing but themselves."""

        ends, ticks = (np.array(closed), np.zeros(len(closed))), jaw_ticks(model.layout, settings)
        strokes = Strokes.of(drives, load, ends, limits, ticks, settings)
        self._moves = Stroking(d, drives, sleep, body, m.jnt_qposadr[joint], load, strokes)

    def begin(self, held: Callable[[int], Collection[str]]) -> None:
        """At the start jaws are closed where a robot (index) holds something, the labels that are
        `held`, and open elsewhere."""
        for robot, tour in self._rows:
            closed = any(self._factory.tour_with(robot, label) == tour for label in held(robot))
            if self._moves is not None and (closed or robot not in self._closed):
                self._moves.place(self._rows[robot, tour], closed)
            if closed:
                self._closed[robot] = self._rows[robot, tour]

    def close(self, operations: Iterable[Operation]) -> None:
        """Close the jaws of robots on what they are to take in operations."""
        for operation in operations:
            for robot in operation.robots:
                rows = self._rows.get((robot, self._factory.turns[operation.index, robot]))
                if rows is None or robot in self._closed or not takes(operation, robot):
                    continue
                assert self._moves is not None
                self._moves.send(rows, down=True)
                self._closed[robot] = rows
                self._closing.add(robot)

    def taken(self, operations: Iterable[Operation]) -> dict[int, list[int]]:
        """Operations have ended: what jaws have closed on in them is held. The geoms of these, by
        robot (index)."""
        robots = [r for o in operations for r in o.robots if r in self._closing]
        self._closing.difference_update(robots)
        return {robot: self._faces[robot] for robot in robots}

    def tend(self, held: Callable[[int], Collection[str]]) -> None:
        """Open jaws that hold nothing."""
        if self._moves is None:
            return
        self._moves.settle()
        for robot in [r for r in self._closed if r not in self._closing and not held(r)]:
            self._moves.send(self._closed.pop(robot), down=False)

    def show(self) -> None:
        """Write the present setpoints of what moves."""
        if self._moves is not None:
            self._moves.show()
