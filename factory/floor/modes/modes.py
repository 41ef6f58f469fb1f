"""The modes of a laid-out factory: each operation's control law composed with the stretching f.

Stretching changes B - A alone, never r, eps or a speed (paper, section 5.1).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from math import isclose

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import first_feasible
from factory.support.arrays import Array
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings
from factory.theory.compiler.domains import EXAMPLE
from factory.theory.control.laws import Setting, hold, law_of
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import CARRIAGE
from factory.theory.problem.template import Point, Template


def operation_modes(layout: Layout, eps: float) -> tuple[Mode, ...]:
    """F_p, D_p and G_p of every operation, in arc length, computed once for a layout.

    Raises InputError (NotPrepared) where the operations before leave the robots outside the domain
    of a mode, or where one may hold another up for ever.
    """
    return layout.kept(_modes, eps)


def _modes(layout: Layout, eps: float) -> tuple[Mode, ...]:
    operations = layout.factory.operations
    modes = tuple(operation_mode(layout, operation, eps) for operation in operations)
    starts = operation_starts(layout)
    count = len(layout.factory.axes)
    limits = Limits(np.ones(count), np.ones(count))
    bundle = Bundle.of(modes, [limits.of(axes) for axes in layout.factory.moves])
    inside = bundle.in_domain(np.concatenate(starts))
    faults = [
        _unprepared(operation, within)
        for operation, mode, start, within in zip(operations, modes, starts, inside, strict=True)
        if not within or (mode.trapped and not mode.clear_from(start))
    ]
    if faults:
        raise InputError(faults)
    return modes


def check_modes(factory: Factory, users: Iterable[Template], product: Product) -> None:
    """Try the `users` own templates when they are compiled, on the first feasible layout: their
    goal balls, and which robots may hold up which, are measured in metres. The shipped ones need
    no trial.

    Raises InputError: BadTemplate for an F that is no control law, NotPrepared where an operation
    cannot reach its goal, or what is joined, or changes hands, does not come together.
    """
    for template in users:
        if law_of(template) is hold:
            message = (
                f"{template.name}: F = {template.law.name} moves no robot, so they never come to"
                " their goals"
            )
            raise InputError(Diagnostic("NotPrepared", message, template.law_position, EXAMPLE))
    settings = Settings()
    layout = first_feasible(factory, product, Clearance(settings.clearance, factory.carriage))
    operation_modes(layout, settings.eps)


def operation_starts(layout: Layout) -> list[Array]:
    """For each operation where its axes (k,) are when it starts: where the ones before left
    them."""
    return [np.array(layout.starts(o.index)) for o in layout.factory.operations]


def _unprepared(operation: Operation, inside: bool) -> Diagnostic:
    what = (
        "its robots may hold each other up for ever"
        if inside
        else "the operations before leave its robots outside its domain"
    )
    message = f"{operation.template.name}: '{operation.label}' cannot reach its goal; {what}"
    position = operation.template.law_position or operation.position
    return Diagnostic("NotPrepared", message, position, "let ~ join A ends to a B end or a station")


def operation_mode(layout: Layout, operation: Operation, eps: float) -> Mode:
    """The mode of one operation. The way of a robot that is not the carrier ends at its goal, or
    where it stood before if that is further: what is left of its guidepath is taken by the others.
    A carrier stands where its station is: beyond its B end, if it has several tours and its parts
    are held elsewhere on this one. A robot that brings something to a carrier that brings something
    too keeps its distance until the carrier stands: they would meet diagonally. So does one that is
    to lower what it brings: it does so when all others stand."""
    paths = [layout.guidepaths[robot] for robot in operation.robots]
    carrier = operation.template.carrier - 1
    gate, standoff = np.full(len(paths), -1), np.zeros(len(paths))
    if operation.before[carrier] != NOPART:
        for slot, label in enumerate(operation.before):
            if slot != carrier and label != NOPART:
                gate[slot], standoff[slot] = carrier, layout.standoff(operation, slot)
    elif any(layout.standoff(operation, slot) for slot in range(len(paths))):
        for slot, label in enumerate(operation.before):
            if label != NOPART and slot != operation.lowered:
                standoff[slot] = layout.standoff(operation, slot)
                gate[slot] = carrier if standoff[slot] else -1
    if operation.lowered >= 0 and gate[operation.lowered] < 0:
        others = (s for s, label in enumerate(operation.before) if label != NOPART)
        slot = operation.lowered
        gate[slot] = next(other for other in others if other != slot)
        standoff[slot] = layout.standoff(operation, slot)
    r = np.array([path.r for path in paths])
    station = layout.station(operation.index)
    stations = [
        station - path.reach if slot == carrier else np.nan for slot, path in enumerate(paths)
    ]
    ends = np.array([layout.ends(robot)[1] for robot in operation.robots])
    template, end = operation.template, np.array([path.length for path in paths])
    if template.before[carrier] != NOPART or not isclose(station, end[carrier], abs_tol=1e-9):
        template, end[carrier] = _inside(template), ends[carrier]
    if not all(path.travels for path in paths):
        template = replace(template, identifications=())  # no guidepath of another meets its axis
    setting = Setting(
        lower=np.array([layout.stop_offset(operation.index, s)[0] for s in range(len(paths))]),
        upper=end,
        r=r,
        eps=eps,
        station=np.array(stations),
        width=np.minimum(r, CARRIAGE),
        dwell=operation.dwell,
        gate=gate,
        standoff=standoff,
    )
    mode = law_of(template)(template, setting)
    mode = replace(mode, upper=np.maximum(mode.upper, ends))
    if operation.inputs and not layout.factory.drops(operation.index):
        guests = np.arange(len(paths)) != carrier
        furthest = np.minimum(mode.goals, layout.starts(operation.index)[: len(paths)])
        mode = replace(mode, lower=np.where(guests, furthest, mode.lower))
    return _with_lifts(mode, layout, operation)


def _with_lifts(mode: Mode, layout: Layout, operation: Operation) -> Mode:
    """The mode with the lifts that its robots raise, or lower: one that is lowered is up until its
    own robot stands, which stands after all others."""
    factory, count = layout.factory, len(operation.robots)
    axes = factory.moves[operation.index][count:]
    if not axes:
        return mode
    robots = [*map(factory.robot_of, axes)]
    strokes = np.array([layout.rise(robot) for robot in robots])
    goals = np.array(layout.goals(operation.index)[count:])
    ups = np.array([layout.visits[operation.index, robot].up for robot in robots])
    lowers = np.array([factory.lowers(robot) for robot in robots]) & (goals < ups)
    gates = np.array([_gate(layout, operation, robot) for robot in robots])
    return replace(
        mode,
        goals=np.append(mode.goals, goals),
        lower=np.append(mode.lower, np.zeros(len(axes))),
        upper=np.append(mode.upper, strokes),
        gate=np.append(mode.gate, np.where(lowers, gates, -1)),
        standoff=np.append(mode.standoff, np.where(lowers, ups - goals, 0.0)),
    )


def _gate(layout: Layout, operation: Operation, robot: int) -> int:
    """The slot of what has to stand before a robot lowers its lift: itself, which stands after all
    others; the carrier, for one that is fixed and need not turn."""
    path = layout.guidepaths[robot]
    alone = not path.travels and not path.travel
    return operation.template.carrier - 1 if alone else operation.robots.index(robot)


@lru_cache(maxsize=256)
def _inside(template: Template) -> Template:
    """A template with the B end of its carrier written as the station where the layout puts it:
    B = S + 2r."""
    j = template.carrier

    def moved(point: Point) -> Point:
        if point.robot == j and point.end == "B":
            return replace(point, end="S", multiple=point.multiple + 2)
        return point

    law = replace(template.law, goals=tuple(moved(p) for p in template.law.goals))
    identified = tuple(tuple(moved(p) for p in points) for points in template.identifications)
    return replace(template, law=law, identifications=identified)


def robot_limits(
    layout: Layout, settings: Settings, seed: int = 0, jitter: float = 0.0
) -> tuple[Limits, np.ndarray]:
    """Each axis's speed and acceleration, and the factor on its controller's gain: drawn for each
    robot within ± jitter by the seed, and the same for its lift. One that turns goes along at the
    end of its lever; round a corner no carriage is too fast for its acceleration."""
    count = len(layout.guidepaths)
    draw = np.random.default_rng(seed).uniform(1 - jitter, 1 + jitter, size=(2, count))
    robots = [axis.robot.index for axis in layout.factory.axes]
    levers = np.array([axis.motion.lever for axis in layout.factory.axes])
    speed = settings.speed * draw[0, robots] / levers
    for robot in layout.curves[0]:
        speed[robot] = layout.guidepaths[robot].fastest(speed[robot], settings.acceleration)
    return Limits(speed, settings.acceleration / levers), draw[1, robots]
