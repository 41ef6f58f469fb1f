"""How the robots of an operation come together, which the net says nothing about: they are in one
place of it, where the mode's field keeps payloads apart (`floor/modes/`).

At the end all robots stand at their goals. Whether payloads collide there is judged in
`floor/mating/`; hands must not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import permutations

import numpy as np

from factory.floor.layout.certificate import MILLI, Fault, fault
from factory.floor.layout.coordinating import without_bodies
from factory.floor.layout.layout import Layout
from factory.floor.layout.nearness import Distances, judged
from factory.floor.layout.outfeed import dip_of, slot_of
from factory.floor.layout.presence import ACROSS, ALONG, ROUNDING, Presence
from factory.floor.layout.staying import Staying
from factory.floor.layout.sweeps import Pile
from factory.theory.plant.approaches import MARGIN
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

TOLERANCE = 1e-6
"""Distances are compared to this [m]: a thousandth of what a layout is rounded to."""

EVEN = 1e-4
"""Products end at one height if they differ by no more than this [m]: the tray is 0.4 mm under the
lowest, and a run fails where it is 0.5 mm under one."""


def meeting_faults(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Waits that are too far back, lowered payloads that are too low, and products that end at
    different heights."""
    yield from _late(layout)
    yield from _raised(layout, by_label)
    yield from _uneven(layout, by_label)


def _late(layout: Layout) -> Iterator[Fault]:
    """Faults where a robot would have to wait for the carrier of an operation farther away than
    where it comes from."""
    for operation in layout.factory.making:
        for slot, robot in enumerate(operation.robots):
            before, visit = layout.ways[operation.index, robot]
            short = layout.standoff(operation, slot)
            room = before.at - visit.at - short
            if short and room < -TOLERANCE:
                name = layout.factory.robots[robot].name
                message = (
                    f"{name} waits for '{operation.label}' {-room * 1000:.1f} mm behind the last"
                    " station of its guidepath: it could never start"
                )
                yield fault(layout.factory, message, robot, lacking=-room)


def _raised(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Faults where a lowered input does not come above the other inputs."""
    for operation in layout.factory.making:
        if operation.lowered < 0:
            continue
        guest = operation.robots[operation.lowered]
        low = by_label[operation.before[operation.lowered]].z[0]
        low += layout.visits[operation.index, guest].elevation
        pile = layout.visits[operation.index, operation.carrier].elevation
        for robot, label in zip(operation.robots, operation.before, strict=True):
            if robot == guest or label == NOPART:
                continue
            over = low - by_label[label].z[1] - pile
            if over < MARGIN - TOLERANCE:
                name = layout.factory.robots[guest].name
                message = (
                    f"{name} comes {over * 1000:.1f} mm over '{label}' in '{operation.label}';"
                    f" {MARGIN * 1000:g} mm are needed"
                )
                yield fault(layout.factory, message, guest, lacking=MARGIN - over)


def _uneven(layout: Layout, by_label: Mapping[str, Pile]) -> Iterator[Fault]:
    """Faults where products of different units end at different heights: the tray takes all at
    one."""
    factory = layout.factory
    lows = {product: by_label[product].z[0] for product in factory.products}
    if len(lows) > 1:
        slot = slot_of(layout)
        lows = {product: low + dip_of(layout, slot, product) for product, low in lows.items()}
    lowest = min(lows, key=lows.__getitem__)
    for product, low in lows.items():
        if (above := low - lows[lowest]) > EVEN + TOLERANCE:
            message = (
                f"'{product}' ends {above * 1000:.2f} mm higher than '{lowest}', and the outfeed's"
                " tray takes both at one height: move its parts down"
            )
            yield fault(factory, message, factory.dropoff.carrier, lacking=above)


def collisions(layout: Layout) -> Iterator[Fault]:
    """Faults where robots come nearer than they may in an operation of both."""
    factory = layout.factory
    robots = Staying(layout, without_bodies(factory.net), {})
    for operation in factory.making:
        for one, other, needed in (*_ends(robots, operation), *_waits(robots, operation)):
            if (nearest := judged(one, other, needed)) is not None:
                lacking, i, j = nearest
                message = (
                    f"{one.name(i)} of {one.machine} and {other.name(j)} of {other.machine} come"
                    f" {lacking * MILLI:.2f} mm nearer than they may at the end of"
                    f" '{operation.label}'"
                )
                yield fault(factory, message, one.robot, other.robot, lacking=lacking)


Pair = tuple[Presence, Presence, Distances]
"""Two robots, and what their bodies need."""


def _ends(robots: Staying, operation: Operation) -> Iterator[Pair]:
    """Two robots at the end, the first without its payload, the second with it; of a robot that
    waits for its carrier the last stretch counts, and of a lift that is lowered its stroke."""
    end = cache(partial(_end, robots, operation))
    carrier = operation.robots.index(operation.carrier)
    for pair in permutations(range(len(operation.robots)), 2):
        one, other = (end(slot, carrier in pair) for slot in pair)
        yield replace(one, bodies=robots.own(one.robot)), other, (ACROSS,) * 3


def _end(robots: Staying, operation: Operation, slot: int, comes: bool) -> Presence:
    """A robot with its payload at the end of an operation, and on the stretch before that where it
    `comes` to its carrier and has waited for it."""
    layout, robot, label = robots.layout, operation.robots[slot], operation.before[slot]
    visit, bodies = layout.visits[operation.index, robot], robots.own(robot)
    end, low = visit.at, visit.lift
    high, far = low, end
    if layout.factory.lowers(robot) and layout.factory.delivers(robot, operation.index):
        high = visit.up
    if comes and (slot != operation.lowered or operation.pile != NOPART):
        far += layout.standoff(operation, slot)
    if label != NOPART:
        bodies += robots.held(robot, operation.index, label)
    sweeps = ((far, end), (high, high)), ((end, end), (high, low))
    return Presence(robot, layout.factory.robots[robot].name, (), bodies, sweeps)


def _waits(robots: Staying, operation: Operation) -> Iterator[Pair]:
    """A payload on its way to where it waits for the carrier, and what that brings."""
    apart = robots.layout.clearance - 2 * (ALONG + ROUNDING)
    carrier = operation.robots.index(operation.carrier)
    for slot, label in enumerate(operation.before):
        if NOPART not in (operation.pile, label) and slot not in (carrier, operation.lowered):
            one, other = (_brought(robots, operation, each) for each in (slot, carrier))
            yield one, other, (-np.inf, apart, -np.inf)


def _brought(robots: Staying, operation: Operation, slot: int) -> Presence:
    """The payload of a robot on its way to an operation, up to its standoff."""
    layout, robot = robots.layout, operation.robots[slot]
    before, visit = layout.ways[operation.index, robot]
    short = layout.standoff(operation, slot)
    sweep = (before.at, visit.at + short), (before.lift, visit.lift)
    bodies = robots.held(robot, operation.index, operation.before[slot])
    return Presence(robot, layout.factory.robots[robot].name, (), bodies, (sweep,))
