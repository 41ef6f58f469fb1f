"""Lays out a cell, with its certificate.

What stands, and all that the carrier may take, is clear of the arms' transfers; what an arm does
nearer to the station is kept apart by standoffs, and by order places after passes: an arm has gone
before the carrier leaves (Theorem 19), and before another arm comes from where it waits with its
part, clear of all others (Theorem 20).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import get_args

import numpy as np

from factory.api import (
    Certificate,
    Diagnostic,
    Factory,
    Guidepath,
    Layout,
    Operation,
    RunError,
)
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.body import with_tool
from factory.apps.arms.cell import CellChains
from factory.apps.arms.curves import Leg, LegTable
from factory.apps.arms.joint_way import WayLimits
from factory.apps.arms.load import Load
from factory.apps.arms.model import ArmModel
from factory.apps.arms.obstacles import floor_of
from factory.apps.arms.planning import CERTAIN, ArmPlanner, ArmTour
from factory.apps.arms.sharing import SweptArm, clear_share
from factory.floor.layout.certificate import (
    ARM_BODY,
    POST_BODY,
    Exclusions,
    Precedence,
    Region,
)
from factory.floor.layout.coordinating import with_machines
from factory.floor.layout.dimensions import PAYLOADS
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.leaving import homes
from factory.floor.layout.hands.tips import TipName
from factory.floor.layout.shapes import payload_boxes
from factory.floor.layout.visits import Visit, visits_of
from factory.theory.nets.coordinated import Past
from factory.theory.problem.ids import OperationId, RobotId, carriage_axis

ASIDE = 0.0, 1.2, 1.8
"""Angles that are tried as `Arrangement.aside` [rad]."""

FAR = 0.41, 0.6, 0.8, 0.2
"""Shares that are tried as `Arrangement.far`."""

SLOWER = 1.0, 1.2, 1.44, 1.73, 2.07
"""How much longer ways are tried where a load is too much for a drive or a pad."""

ELSEWHERE = "Unreachable", "NoWay", "Layout"
"""Errors that an arm may not have where it stands nearer to the station, or farther from it."""

REACH = 0.2
"""The least coordinate of an arm's axis at which it places [m]."""

BEYOND = 0.001
"""How much further than it must an arm has gone where it counts as away [m]."""


def laid_out(
    factory: Factory, rails: Mapping[int, Layout], arm: ArmModel, pace: WayLimits
) -> Layout:
    """The layout of a cell with its certificate.

    Args:
        factory: carriers, their tools, and arms.
        rails: by carrier (index), the layout on rails of what it brings.
        arm: the kind of arm.
        pace: limits of the coordinate along their ways.

    Raises RunError: Unreachable, NoWay, ArmLoad, Layout.
    """
    refused: RunError | None = None
    for far in FAR:
        try:
            return _laid_out_at(factory, rails, arm, pace, far)
        except RunError as error:
            if not {*ELSEWHERE}.intersection(d.code for d in error.diagnostics):
                raise
            refused = refused or error
    assert refused is not None
    raise refused


def _laid_out_at(
    factory: Factory,
    rails: Mapping[int, Layout],
    arm: ArmModel,
    pace: WayLimits,
    far: float,
) -> Layout:
    """The layout with arms as far from the station as `Arrangement.far` says."""
    blocked, size = "", 0
    for aside in ASIDE:
        try:
            while True:
                cell = Arrangement(factory, rails, with_tool(arm.chain), aside, far, size)
                try:
                    return _with_legs(cell, arm, pace)
                except PadTooSmall:
                    size += 1
        except InEachOthersWay as error:
            blocked = blocked or str(error)
        except RunError:
            if not blocked:
                raise
    raise RunError(Diagnostic("Layout", blocked, None, "one arm: --arm NAME"))


class InEachOthersWay(Exception):
    """An arm is in another's way even at its feeder."""


class PadTooSmall(Exception):
    """A pad does not bear what a larger one would."""


def _with_legs(cell: Arrangement, arm: ArmModel, pace: WayLimits) -> Layout:
    """The layout of a cell. Raises InEachOthersWay."""
    bare = _layout(cell, {})
    planners = {n: ArmPlanner(cell, n, arm, bare, pace) for n in cell.arms}
    tours = {
        n: [_borne(cell, planner, tour, pace) for tour in planner.tours()]
        for n, planner in planners.items()
    }
    tours = _paired(tours)
    private = _private_parts(planners, tours)
    chains = _chains(cell, arm, planners, tours, private)
    layout = _layout(cell, tours, chains)
    asked = [*_orders(cell, tours, private), *_left(cell, tours, homes(layout))]
    apart = _exclusions(layout, asked, tours)
    return replace(layout, certificate=_certificate(cell, layout, apart))


def _borne(cell: Arrangement, planner: ArmPlanner, tour: ArmTour, pace: WayLimits) -> ArmTour:
    """A tour whose load the arm bears: its way is longer, so slower, where it must be; a pin holds
    what is too much for the pad. Raises RunError (ArmLoad), PadTooSmall."""
    burden, kinds = cell.burdens[tour.label], get_args(TipName)
    for grip in (replace(tour.grip, kind=name) for name in kinds):
        load = Load(planner.name, tour.label, burden, grip, cell.chain, tour.brings)
        for share in SLOWER:
            slow = replace(load, way=tour.brings.stretch(share))
            if slow.is_borne(pace, planner.damping):
                return replace(tour, grip=grip, brings=slow.way)
        larger = replace(slow, grip=replace(grip, radius=float(burden.pad.radius)))
        if grip.radius < larger.grip.radius and larger.is_borne(pace, planner.damping):
            raise PadTooSmall
    load.check(pace, planner.damping)
    return tour


def _paired(tours: Mapping[int, Sequence[ArmTour]]) -> dict[int, list[ArmTour]]:
    """The tours of all arms, each way to a place as long as that from it; all ways begin or end at
    the same coordinate at the feeders, where the longest begins at REACH."""
    lengths = {
        arm: [max(t.brings.length, _next(each, t.label).goes.length) for t in each]
        for arm, each in tours.items()
    }
    far = REACH + max(map(max, lengths.values()))
    return {
        arm: [
            replace(
                t,
                goes=t.goes.stretch(lengths[arm][n - 1] / t.goes.length),
                brings=t.brings.stretch(lengths[arm][n] / t.brings.length),
                begins=far - lengths[arm][n - 1],
                stop=far - lengths[arm][n],
            )
            for n, t in enumerate(each)
        ]
        for arm, each in tours.items()
    }


def _chains(
    cell: Arrangement,
    arm: ArmModel,
    planners: Mapping[int, ArmPlanner],
    tours: Mapping[int, Sequence[ArmTour]],
    private: Mapping[str, PrivateParts],
) -> CellChains:
    """What the cell says of its arms."""
    factory, legs, rows = cell.factory, list[Leg](), dict[tuple[int, int], int]()
    standoffs, clear, waits = dict[int, float](), dict[int, float](), dict[int, float]()
    for number, each in tours.items():
        damping = planners[number].damping
        for t in each:
            burden, leaf = cell.burdens[t.label], factory.by_label[t.label].index
            join = burden.join.index
            center = t.grip.local(burden.centre)
            rows[leaf, number], rows[join, number] = len(legs), len(legs) + 1
            legs.append(Leg(cell.chain, t.goes, t.begins, False, np.zeros(3), damping))
            legs.append(Leg(cell.chain, t.brings, t.stop, True, center, damping))
            standoffs[join] = round(t.brings.length - t.brings.hover + BEYOND, 6)
            clear[leaf] = round(t.brings.off + BEYOND, 6)
            if private:
                short = t.brings.length - private[t.label].comes + BEYOND
                waits[join] = max(standoffs[join], round(short, 6))
    return CellChains(
        factory,
        tuple(cell.arms),
        arm,
        cell.stands,
        cell.wells,
        {label: t.grip for each in tours.values() for t in each for label in cell.names(t.label)},
        LegTable(legs),
        rows,
        standoffs,
        clear,
        waits,
    )


def _layout(
    cell: Arrangement, tours: Mapping[int, Sequence[ArmTour]], chains: CellChains | None = None
) -> Layout:
    """The layout with the legs of these tours, if there are any yet."""
    factory, rails, (x, y) = cell.factory, cell.rails[0], cell.station
    every = [t for each in tours.values() for t in each]
    length = max((t.brings.length for t in every), default=1.0)
    arm = Guidepath((1.0, 0.0), (0.0, 1.0), (x, y), length, REACH, 0.0, 0.0, 0.0)
    paths, hands = dict.fromkeys(cell.arms, arm), dict[int, Hand | None]()
    for carrier, line in cell.lines.items():
        paths[carrier], hands[carrier] = line.path, line.hand_of(carrier)
        for tool in line.tools:
            paths[tool.robot], hands[tool.robot] = line.path_of(tool), line.hand_of(tool.robot)
    stations = [
        cell.lines[o.carrier].stop(o) if o.carrier in cell.lines and o.inputs else 0.0
        for o in factory.operations
    ]
    robots = range(len(factory.robots))
    visits = visits_of(factory, [paths[n] for n in robots], stations)
    for label, burden in cell.burdens.items():
        key = factory.by_label[label].index, cell.arm_of[label]
        at = arm.middle(visits[key].at)
        if burden.source is None:
            well = cell.wells[label]
            place, elevation = well.place, well.elevation
        else:
            place, elevation = cell.lines[burden.source].station, 0.0
        shift = place[0] - at[0], place[1] - at[1]
        visits[key] = Visit(visits[key].at, 0.0, 0.0, elevation, shift)
    for t in every:
        key = cell.burdens[t.label].join.index, cell.arm_of[t.label]
        visits[key] = replace(visits[key], at=t.stop, shift=(t.stop - REACH, 0.0))
    return replace(
        rails,
        factory=factory,
        guidepaths=tuple(paths[n] for n in robots),
        visits=visits,
        hands=tuple(hands.get(n) for n in robots),
        payloads=payload_boxes(factory, cell.product),
        floor=floor_of(cell),
        certificate=None,
        plain=None,
        chains=chains,
    )


@dataclass(frozen=True, slots=True)
class PrivateParts:
    """On which parts of its ways an arm is clear of all ways of all other arms.

    Attributes:
        comes: as far on its way with a part [m].
        leaves: from there on its way from where it has placed that part [m].
    """

    comes: float
    leaves: float


def _private_parts(
    planners: Mapping[int, ArmPlanner], tours: Mapping[int, Sequence[ArmTour]]
) -> dict[str, PrivateParts]:
    """The private parts of the ways of each part; none in a cell of one arm. Raises
    InEachOthersWay."""
    if len(tours) == 1:
        return {}
    comes, leaves = dict[int, list[SweptArm]](), dict[int, list[SweptArm]]()
    for arm, each in tours.items():
        comes[arm] = [planners[arm].swept(t.brings, t.label) for t in each]
        leaves[arm] = [planners[arm].swept(_next(each, t.label).goes) for t in each]
    private = dict[str, PrivateParts]()
    for arm, each in tours.items():
        others = [way for one in tours if one != arm for way in (*comes[one], *leaves[one])]
        for n, t in enumerate(each):
            first = clear_share(comes[arm][n], others)
            last = clear_share(leaves[arm][n].backwards, others)
            if not first or not last:
                name = planners[arm].name
                raise InEachOthersWay(f"{name} is in another's way where it takes '{t.label}'")
            length = t.brings.length
            private[t.label] = PrivateParts(first * length, (1.0 - last) * length)
    return private


@dataclass(frozen=True, slots=True)
class Away:
    """An order: an operation starts when an arm has gone from where it placed a part.

    Attributes:
        past: the pass by which it has.
        start: the operation (index) that waits.
        tokens: how much more often it may have started.
    """

    past: Past
    start: OperationId
    tokens: int


def _orders(
    cell: Arrangement, tours: Mapping[int, Sequence[ArmTour]], private: Mapping[str, PrivateParts]
) -> Iterator[Away]:
    """What keeps arms apart at the station, and from the carrier that leaves it."""
    factory = cell.factory
    of = {t.label: (arm, t) for arm, each in tours.items() for t in each}
    brought = {burden.join.index: label for label, burden in cell.burdens.items()}
    joins = sorted(
        (burden.join for burden in cell.burdens.values()), key=lambda o: factory.postorder[o.index]
    )

    def gone(join: Operation, at: float) -> Past:
        arm, tour = of[brought[join.index]]
        return Past(join.end, carriage_axis(RobotId(arm)), round(tour.stop + at + BEYOND, 6))

    for before, after in zip([joins[-1], *joins[:-1]], joins, strict=True):
        (one, left), (other, _) = (of[brought[o.index]] for o in (before, after))
        if one != other:
            past = gone(before, private[left.label].leaves)
            yield Away(past, after.index, int(after is joins[0]))
    for carrier in cell.lines:
        gear = [factory.operations[number] for number in factory.robots[carrier].operations]
        for join, then in pairwise(gear):
            if join.index in brought and then.index not in brought and then.carrier == carrier:
                arm, tour = of[brought[join.index]]
                off = _next(tours[arm], tour.label).goes.off
                yield Away(gone(join, off), then.index, 0)


def _left(
    cell: Arrangement, tours: Mapping[int, Sequence[ArmTour]], alone: Collection[int]
) -> Iterator[Away]:
    """What keeps arms apart from carriers that they take sub-assemblies from: these stay until what
    was taken is above them. Those that go home by themselves (`alone`) hold from below, or from
    behind, and leave what an arm has as they leave a product at the outfeed."""
    for arm, each in tours.items():
        for tour in each:
            burden = cell.burdens[tour.label]
            if burden.source is not None and burden.source not in alone:
                at = tour.stop + tour.brings.length - tour.brings.off - BEYOND
                past = Past(burden.join.start, carriage_axis(RobotId(arm)), round(at, 6), -1)
                yield Away(past, cell.factory.first(burden.source).index, 1)


def _exclusions(
    layout: Layout, asked: Sequence[Away], tours: Mapping[int, Sequence[ArmTour]]
) -> Exclusions:
    """The passes and order places that are asked for; arms go by themselves to over their next
    feeders. Raises RunError (Layout) where the net with them is not live."""
    backs = homes(layout)
    for arm, each in tours.items():
        backs[arm] = round(min(t.begins + t.goes.hover for t in each), 6)
    passes = tuple(dict.fromkeys(away.past for away in asked))
    net, operations = with_machines(layout, passes), layout.factory.operations
    event = {past: net.net.right[place] for past, (place, _) in net.passes.items()}
    called = [transition.name for transition in net.net.net.transitions]
    orders = tuple(
        Precedence(
            f"order:{called[event[away.past]]}:{operations[away.start].label}",
            called[event[away.past]],
            called[operations[away.start].start],
            away.tokens,
        )
        for away in asked
    )
    if with_machines(layout, passes, orders).deadlock:
        message = "the arms wait for each other for ever"
        raise RunError(Diagnostic("Layout", message, None, "one arm: --arm NAME"))
    return Exclusions(passes=passes, orders=orders, backs=tuple(backs.items()))


def _next(tours: Sequence[ArmTour], label: str) -> ArmTour:
    """The tour of an arm after that of a part."""
    labels = [t.label for t in tours]
    return tours[(labels.index(label) + 1) % len(labels)]


def _certificate(cell: Arrangement, layout: Layout, apart: Exclusions) -> Certificate:
    """The certificate of a cell."""
    rails = cell.rails[0].certificate
    assert rails is not None
    return replace(
        rails,
        clearance=CERTAIN,
        robots=tuple(robot.name for robot in cell.factory.robots),
        operations=tuple(operation.label for operation in cell.factory.operations),
        regions=tuple(_regions(cell, layout)),
        apart=apart,
    )


def _regions(cell: Arrangement, layout: Layout) -> Iterator[Region]:
    """The floor that machines take: the carrier's line, the arms up to their elbows, and their
    feeders."""
    for line in cell.lines.values():
        yield from line.regions
    for arm, stand in cell.stands.items():
        (x, y, z), half = stand.place, 0.25 * cell.ring.outer
        box = x - half, x + half, y - half, y + half
        yield Region(arm, PAYLOADS, ARM_BODY, box, (0.0, z + 0.7 * cell.ring.outer))
    for label, well in cell.wells.items():
        arm = cell.arm_of[label]
        yield Region(arm, PAYLOADS, POST_BODY, well.feeder.housing, (0.0, cell.top), label)
    shed = layout.shed
    yield Region(0, PAYLOADS, POST_BODY, shed, (0.0, cell.top))
