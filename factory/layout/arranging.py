"""Arrange a whole factory: dynamic programming over the tree of guidepaths.

A robot can lie on the floor in four ways (its heading and its side, each of two directions along
one axis), and its branch lies as it does. Leaves first, each robot is packed once for each way that
its carrier may ask for; then the sides are read off from the output robot on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from factory.layout.guidepath import Box
from factory.layout.layout import carriers
from factory.layout.outline import Outline
from factory.layout.packing import Packing, Task
from factory.layout.shapes import OUTPUT, Frame, Shape, Sides, held_shape, oriented_shape, turned
from factory.layout.sides import admitted
from factory.layout.stretching import Stretched, outgoing
from factory.plant.factory import Operation


def arrange(
    task: Task, payloads: Mapping[str, Box], sides: Sides | None = None
) -> tuple[Stretched, list[Shape]]:
    """Travels, stations and sides with the shapes that they give; with `sides` these alone are
    looked at. Linear."""
    factory, on = task.factory, carriers(task.factory)
    table: list[dict[Frame, Outline]] = [{} for _ in factory.robots]
    for robot, frames in reversed(list(enumerate(_frames(on, sides)))):
        for frame in frames:
            shape = shape_of(task, payloads, robot, on[robot], frame)

            def outline(guest: int, side: int, frame: Frame = frame) -> Outline:
                return table[guest][turned(frame, side)]

            def admits(operation: Operation, chosen: Sides, frame: Frame = frame) -> bool:
                if sides is not None:
                    return all(sides[robot] == side for robot, side in chosen.items())
                return admitted(operation, chosen, frame[1])

            table[robot][frame] = Packing(task, robot, shape, outline, admits).packed()
    return _chosen(task, table)


def shape_of(
    task: Task, payloads: Mapping[str, Box], robot: int, carrier: int, frame: Frame
) -> Shape:
    """The shape of a robot that lies in a frame, with its hand if hands are chosen."""
    lies = robot, carrier, frame, task.clearance, task.wide
    if task.hands is not None:
        return held_shape(task.hands, payloads, *lies)
    return oriented_shape(task.factory, payloads, *lies)


def _frames(on: Sequence[int], sides: Sides | None) -> list[tuple[Frame, ...]]:
    """The frames in which each robot may lie."""
    found: list[tuple[Frame, ...]] = [(OUTPUT,)]
    for robot, carrier in list(enumerate(on))[1:]:
        both = (-1, +1) if sides is None else (sides[robot],)
        frames = [turned(frame, side) for frame in found[carrier] for side in both]
        found.append(tuple(dict.fromkeys(frames)))
    return found


def _chosen(task: Task, table: Sequence[Mapping[Frame, Outline]]) -> tuple[Stretched, list[Shape]]:
    """What was chosen for the frames that the output robot's gives."""
    robots, operations = len(table), len(task.factory.operations)
    travel, stations, sides = [0.0] * robots, [0.0] * operations, Sides()
    frames, outlines = [OUTPUT] * robots, list[Outline]()
    for robot in range(robots):
        outlines.append(table[robot][frames[robot]])
        choice = outlines[-1].choice
        for number, station in choice.stations.items():
            stations[number] = station
        for guest, side in choice.sides.items():
            sides[guest], travel[guest] = side, choice.travels[guest]
            frames[guest] = turned(frames[robot], side)
    travel[0] = outgoing(outlines[0], task.clearance)
    return Stretched(travel, stations, sides), [outline.shape for outline in outlines]
