"""Choose the layout that users pay least for: the cycle time first, then the length of the
guidepaths, then the floor.

The first feasible layout is the simple construction: sides by a rule of thumb, subtrees as boxes
(`stretching`). Against it stand a few that are packed by their contours; each further one
gives more weight to the robots that are the slowest in the best so far.

A factory is packed by dynamic programming over the tree of guidepaths. A robot can lie on the floor
in four ways (its heading and its side, each of two directions along one axis), and its branch lies
as it does. Leaves first, each robot is packed once for each way that its carrier may ask for; then
the sides are read off from the output robot on.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from factory.floor.geometry.solids import Product
from factory.floor.layout.branches import carriers
from factory.floor.layout.certificate import Region
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.drafting import LayoutDraft
from factory.floor.layout.durations import Pace
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import bare
from factory.floor.layout.layout import Layout
from factory.floor.layout.outline import Outline
from factory.floor.layout.packing import WIDTHS, Packing, Task
from factory.floor.layout.shapes import (
    OUTPUT,
    Frame,
    Shape,
    Sides,
    headings,
    held_shape,
    oriented_shape,
    payload_boxes,
    symmetric_shapes,
    turned,
)
from factory.floor.layout.sides import admissible, admitted
from factory.floor.layout.stretching import Stretched, outgoing, stretch
from factory.floor.layout.sweeps import regions
from factory.support.boxes import Box, Point2, hull
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

EFFORT = 800
"""Robots times layouts that are looked at, four layouts at most."""

WAYS = ((True, 1.0), (False, 0.5), (True, 0.5), (False, 1.0))
"""Ways to look for a layout: with a corridor or without, and the weight of a robot's breadth."""

UNWEIGHTED = 2
"""The first so many take all robots to matter the same."""

LARGE = 1500
"""A factory of more robots is packed once, with the sides of the first feasible layout."""


def first_feasible(
    factory: Factory,
    product: Product,
    c: Clearance,
    wide: Collection[int] = (),
    hands: Hands | None = None,
) -> Layout:
    """The layout of the simple construction."""
    payloads = payload_boxes(factory, product)
    sides = _first_sides(factory, payloads, c)
    task = Task(factory, c, Pace(), (), wide=wide, hands=hands)
    lying = enumerate(zip(carriers(factory), headings(factory, sides), strict=True))
    shapes = [shape_of(task, payloads, robot, on, frame) for robot, (on, frame) in lying]
    stretched = stretch(factory, shapes, c, sides)
    return LayoutDraft(factory, product, c, payloads, shapes, stretched).layout()


def optimised(
    factory: Factory,
    product: Product,
    c: Clearance,
    pace: Pace,
    floor: Point2 | None = None,
    wide: Collection[int] = (),
    hands: Hands | None = None,
) -> Layout:
    """The best layout found, of those that fit a floor if there are any. Never worse than the first
    feasible one, but for a factory that is LARGE. `wide`: robots whose ways have room for relays;
    `hands`: those to choose from. Near linear, deterministic."""
    payloads = payload_boxes(factory, product)
    count = len(factory.robots)
    width = WIDTHS[factory.period > 1]
    task = Task(factory, c, pace, [1.0] * count, width=width, wide=wide, hands=hands)
    if count > LARGE:
        sides = _first_sides(factory, payloads, c)
        return _packed(replace(task, width=1), product, payloads, sides)
    best = first_feasible(factory, product, c, wide, hands)
    times = pace.gear_times(best)
    least = _score(best, pace.cycle_of(best), floor)
    for number, (corridor, breadth) in enumerate(WAYS[: max(1, EFFORT // count)]):
        weights = task.weights if number < UNWEIGHTED else _weights(times)
        way = replace(task, corridor=corridor, breadth=breadth, weights=weights)
        layout = _packed(way, product, payloads)
        gear_seconds = pace.gear_times(layout)
        score = _score(layout, pace.cycle_of(layout), floor)
        if score < least:
            best, times, least = layout, gear_seconds, score
    return best


def floor_of(layout: Layout) -> Box:
    """The floor that a layout takes."""
    swept = regions(layout)
    return bounds(swept, layout.clearance)


def bounds(occupied: Sequence[Region], clearance: float) -> Box:
    """The floor that regions take."""
    half, box = clearance / 2, hull([region.box for region in occupied])
    return box[0] - half, box[1] + half, box[2] - half, box[3] + half


def _score(layout: Layout, cycle: float, floor: Point2 | None) -> tuple[float, ...]:
    """The objective of a layout, smaller is better: excess over the floor [m], number of labels
    brought without a hand, `cycle` time [s], guidepaths [m], floor [m²]."""
    excess = 0.0
    if floor is not None:
        xlo, xhi, ylo, yhi = floor_of(layout)
        excess = max(xhi - xlo - floor[0], yhi - ylo - floor[1], 0.0)
    ends = [p for g in layout.guidepaths for p in (g.carriage(0.0), g.carriage(g.length))]
    x, y = zip(*ends, strict=True)
    area = (max(x) - min(x)) * (max(y) - min(y))
    lacking = sum(bare(layout.factory, robot, hand) for robot, hand in enumerate(layout.hands))
    terms = excess, lacking, cycle, layout.guidepath_length, area
    return tuple(round(value, 6) for value in terms)


def _first_sides(factory: Factory, payloads: Mapping[str, Box], c: Clearance) -> Sides:
    compact = stretch(factory, symmetric_shapes(factory, payloads, c), c).sides
    return admissible(factory, compact)


def _packed(
    task: Task, product: Product, payloads: Mapping[str, Box], sides: Sides | None = None
) -> Layout:
    stretched, shapes = arrange(task, payloads, sides)
    return LayoutDraft(task.factory, product, task.clearance, payloads, shapes, stretched).layout()


def _weights(times: Sequence[float]) -> list[float]:
    """The weight of each robot's time: 1 for the slowest."""
    longest = max(times)
    return [(1 + (time / longest) ** 4) / 2 for time in times]


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
    frames_of: list[tuple[Frame, ...]] = [(OUTPUT,)]
    for robot, carrier in list(enumerate(on))[1:]:
        both = (-1, +1) if sides is None else (sides[robot],)
        frames = [turned(frame, side) for frame in frames_of[carrier] for side in both]
        frames_of.append(tuple(dict.fromkeys(frames)))
    return frames_of


def _chosen(task: Task, table: Sequence[Mapping[Frame, Outline]]) -> tuple[Stretched, list[Shape]]:
    """The choices for the frames that follow from the output robot's."""
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
