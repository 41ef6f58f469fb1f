"""Whether f embeds the quotient workspace W: guidepaths meet at their junctions and cross nowhere.

A carriage's centre follows the segment f([A + 2r, B]): it stops 2r before A, and its payload
reaches to the junction. So no two segments may have a point in common, and at a junction the
product's middles must be one point. All lengths are whole millimetres, and every comparison is
between integers.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import dist

import numpy as np
import shapely
from numpy.typing import NDArray

from factory.floor.layout.branches import carriers, delivery
from factory.floor.layout.certificate import Fault, fault
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.support.arrays import Index
from factory.support.boxes import Point2
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

CHUNK = 512
"""Boxes looked up at a time, so that a heap of them all in one place takes no more memory."""

Grid = tuple[int, int]
"""A point of the floor in whole millimetres."""


def embedding_faults(layout: Layout) -> Iterator[Fault]:
    """What keeps f from being an embedding: ends off the grid of millimetres, visits off a
    guidepath, junctions that ~ asks for but f does not make, and crossings that it makes but ~ does
    not ask for. Near linear."""
    for robot, carrier in enumerate(carriers(layout.factory)):
        yield from _off_grid(layout, robot)
        yield from _junction(layout, robot, carrier)
    yield from _crossings(layout)


def _grid(point: Point2) -> Grid:
    return round(point[0] * 1000), round(point[1] * 1000)


def _off_grid(layout: Layout, robot: int) -> Iterator[Fault]:
    factory, path = layout.factory, layout.guidepaths[robot]
    name = factory.robots[robot].name
    corners = path.corners
    within = (v for at in corners for v in path.corner(at))
    ends = *path.a, *path.carriage(path.reach), *path.carriage(path.length), *within
    if corners and not _rounded(corners, path):
        message = (
            f"{name}: the corners of its guidepath are not {2000 * path.rounding:g} mm apart, and"
            f" {1000 * path.rounding:g} mm from its ends"
        )
        yield fault(factory, message, robot)
    elif not all(abs(v * 1000 - round(v * 1000)) < 1e-3 for v in ends):
        message = f"{name}: its guidepath, {ends[2:4]} to {ends[4:]}, is not in whole millimetres"
        yield fault(factory, message, robot)
    elif path.travels and not (path.travel > 0 and path.reach > 0):
        message = f"{name}: its guidepath has no length (it receives and delivers at {path.a})"
        yield fault(factory, message, robot)
    stops = layout.stops(robot) or [0.0]
    beyond = max(-min(stops), max(stops) - path.length)
    if beyond > 1e-6:
        message = f"{name} stands {beyond * 1000:.1f} mm beyond the end of its guidepath"
        yield fault(factory, message, robot, lacking=beyond)


def _junction(layout: Layout, robot: int, carrier: int) -> Iterator[Fault]:
    """A of a robot is the station of its operation on its carrier's path, and they meet at right
    angles."""
    path, factory = layout.guidepaths[robot], layout.factory
    name = factory.robots[robot].name
    u, t = path.heading, path.side
    if path.left == 0 or sorted(map(abs, u)) != [0.0, 1.0] or sorted(map(abs, t)) != [0.0, 1.0]:
        message = f"{name}: heading {u} and side {t} are no axes at right angles"
        yield fault(factory, message, robot)
        return
    if carrier < 0:
        return
    for tour in factory.tours[robot]:
        yield from _ends_at(layout, robot, factory.operations[tour[-1]])


def _ends_at(layout: Layout, robot: int, operation: Operation) -> Iterator[Fault]:
    """What is wrong with a robot's guidepath at its A end, in an operation."""
    path, factory, number = layout.guidepaths[robot], layout.factory, operation.index
    carrier, name, (u, t) = operation.carrier, factory.robots[robot].name, (path.heading, path.side)
    on, other = layout.guidepaths[carrier], factory.robots[carrier].name
    in_line = len(operation.robots) == 2 and len(operation.inputs) == 1 and t == on.side
    end = delivery(factory, robot)
    along = on.heading if end is None else layout.guidepaths[end.carrier].heading
    if t != along and not (in_line and u == on.heading):
        message = f"{name}: its side {t} is not {other}'s heading {along}: it is mirrored"
        yield fault(factory, message, robot, carrier)
    slot = operation.robots.index(robot)
    wanted = on.middle(layout.station(number) + layout.stop_offset(number, slot)[1])
    off = dist(path.a, wanted)
    if off > 1e-6:
        message = (
            f"{name} ends {off * 1000:.1f} mm away from the junction of '{operation.label}'"
            f" on {other}'s guidepath"
        )
        yield fault(factory, message, robot, carrier, lacking=off)
        return
    visit = layout.visits[number, robot]
    (x, y), (more, beside) = path.middle(visit.at), visit.shift
    stand = layout.visits[number, carrier]
    above = visit.height + visit.lift - stand.height - stand.lift
    off = dist((x + more, y + beside, above), (*layout.meeting(operation), 0.0))
    if operation.before[slot] != NOPART and off > 1e-6:
        message = (
            f"{name} brings '{operation.before[slot]}' to {off * 1000:.1f} mm from its place in"
            f" '{operation.label}': the goals of {operation.template.name} do not meet"
        )
        yield fault(factory, message, robot, carrier, lacking=off)


def _crossings(layout: Layout) -> Iterator[Fault]:
    """Segments along the axes meet where their bounding boxes do."""
    legs = [(i, leg) for i, path in enumerate(layout.guidepaths) for leg in _legs(path)]
    points = np.array([leg for _, leg in legs], np.int64).reshape(-1, 2, 2)
    low, high = points.min(axis=1), points.max(axis=1)
    for first, second in touching(low, high):
        (i, _), (j, _) = legs[first], legs[second]
        if i == j or layout.share_stem(i, j):
            continue
        x, y = (int(v) / 1000 for v in np.maximum(low[first], low[second]))
        names = [layout.factory.robots[robot].name for robot in (i, j)]
        message = f"the guidepaths of {names[0]} and {names[1]} cross at ({x:g}, {y:g})"
        yield fault(layout.factory, message, i, j)


def _legs(path: Guidepath) -> Iterator[tuple[Grid, Grid]]:
    """The ends of the legs of a guidepath between the points of delivering and receiving."""
    corners = map(path.corner, path.corners)
    points = [_grid(p) for p in (path.carriage(path.reach), *corners, path.carriage(path.length))]
    yield from pairwise(points)


def _rounded(corners: list[float], path: Guidepath) -> bool:
    """Whether the corners of a guidepath are far enough from each other and its ends for their
    rounding."""
    apart = np.diff([path.reach - path.rounding, *corners, path.length + path.rounding])
    return bool((apart >= 2 * path.rounding - 1e-9).all())


def touching(low: NDArray[np.int64], high: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """The pairs i < j of closed boxes with corners low, high (n, 2) that have a point in common."""
    for first, second in near(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])):
        yield from zip(first.tolist(), second.tolist(), strict=True)


def near(cells: NDArray[np.object_], *predicate: object) -> Iterator[tuple[Index, Index]]:
    """The pairs i < j of shapes whose boxes overlap, or for which a `predicate` of STRtree.query
    holds, in order, computed for CHUNK shapes at a time."""
    tree = shapely.STRtree(cells)
    for start in range(0, len(cells), CHUNK):
        first, second = tree.query(cells[start : start + CHUNK], *predicate)
        kept = first + start < second
        first, second = first[kept] + start, second[kept]
        order = np.lexsort((second, first))
        yield first[order], second[order]
