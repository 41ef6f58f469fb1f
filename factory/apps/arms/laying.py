"""Lays out a cell, with its certificate.

What stands, and all that the carrier may take, is clear of the arms' transfers; what an arm does
nearer to the station is kept apart by standoffs, and by order places after passes: an arm has gone
before the carrier leaves (Theorem 19), and before another arm comes from where it waits with its
part, clear of all others (Theorem 20).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from factory.api import (
    Certificate,
    Diagnostic,
    Factory,
    Guidepath,
    Hand,
    Layout,
    LayoutMachines,
    LayoutSearch,
    Product,
    Region,
    RunError,
)
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.body import with_tool
from factory.apps.arms.cell import CellChains
from factory.apps.arms.curves import Leg, LegTable
from factory.apps.arms.joint_way import WayLimits
from factory.apps.arms.load import Load
from factory.apps.arms.model import ArmModel
from factory.apps.arms.obstacles import check_room, floor_of
from factory.apps.arms.orders import (
    BEYOND,
    InEachOthersWay,
    PrivateParts,
    next_tour,
    orders_at_sources,
    orders_of,
    private_parts,
    with_orders,
)
from factory.apps.arms.planning import CERTAIN, ArmPlanner, ArmTour

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


def laid_out(
    factory: Factory,
    product: Product,
    rails: Mapping[int, Layout],
    arm: ArmModel,
    pace: WayLimits,
) -> Layout:
    """The layout of a cell with its certificate.

    Args:
        factory: carriers, their tools, and arms.
        product: the solids.
        rails: by carrier (index), the layout on rails of what it brings.
        arm: the kind of arm.
        pace: limits of the coordinate along their ways.

    Raises RunError: Unreachable, NoWay, ArmLoad, Layout.
    """
    refused, cell = None, Arrangement(factory, product, rails, 0, with_tool(arm.chain), 0.0, 0.0)
    for far in FAR:
        try:
            return _laid_out_at(cell.otherwise(far=far), arm, pace)
        except RunError as error:
            if not {*ELSEWHERE}.intersection(d.code for d in error.diagnostics):
                raise
            refused = refused or error
    assert refused is not None
    raise refused


def _laid_out_at(cell: Arrangement, arm: ArmModel, pace: WayLimits) -> Layout:
    """The layout with arms as far from the station as `Arrangement.far` says."""
    blocked = ""
    for aside in ASIDE:
        try:
            while True:
                cell = cell.otherwise(aside=aside)
                try:
                    return _with_legs(cell, arm, pace)
                except PadTooSmall as error:
                    cell = cell.otherwise(size=error.size)
        except InEachOthersWay as error:
            blocked = blocked or str(error)
        except RunError:
            if not blocked:
                raise
    raise RunError(Diagnostic("Layout", blocked, None, "one arm: --arm NAME"))


class PadTooSmall(Exception):
    """A pad does not bear what a larger one does, that of another `size`."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.size = size


def _with_legs(cell: Arrangement, arm: ArmModel, pace: WayLimits) -> Layout:
    """The layout of a cell. Raises InEachOthersWay."""
    bare = _layout(cell, {})
    check_room(cell, bare)
    planners = {n: ArmPlanner(cell, n, arm, bare, pace) for n in cell.arms}
    tours, small = dict[int, list[ArmTour]](), list[int]()
    for n, planner in planners.items():
        tours[n] = []
        for tour in planner.tours():
            try:
                tours[n].append(_borne(cell, planner, tour, pace))
            except PadTooSmall as error:
                small.append(error.size)
    if small:
        raise PadTooSmall(max(small))
    tours = _paired(tours)
    private = private_parts(planners, tours)
    chains = _chains(cell, arm, planners, tours, private)
    layout = _layout(cell, tours, chains)
    alone = LayoutMachines(layout).homes
    asked = [*orders_of(cell, tours, private), *orders_at_sources(cell, tours, alone)]
    certified = replace(layout, certificate=_certificate(cell, layout))
    return with_orders(certified, asked, tours, alone)


def _borne(cell: Arrangement, planner: ArmPlanner, tour: ArmTour, pace: WayLimits) -> ArmTour:
    """A tour whose load the arm bears: its way is longer, so slower, where it must be; a pin holds
    what is too much for the pad. Raises RunError (ArmLoad), PadTooSmall."""
    burden = cell.burdens[tour.label]
    for grip in (tour.grip, replace(tour.grip, kind="pin")):
        load = Load(planner.name, tour.label, burden, grip, cell.chain, tour.brings)
        for share in SLOWER:
            slow = replace(load, way=tour.brings.stretch(share))
            if slow.is_borne(pace, planner.damping):
                return replace(tour, grip=grip, brings=slow.way)
        for size in range(cell.size + 1, cell.largest + 1):
            radius = cell.otherwise(size=size).covered(tour.label)
            larger = replace(slow, grip=replace(grip, radius=radius))
            if radius > grip.radius and larger.is_borne(pace, planner.damping):
                raise PadTooSmall(size)
    load.check(pace, planner.damping)
    return tour


def _paired(tours: Mapping[int, Sequence[ArmTour]]) -> dict[int, list[ArmTour]]:
    """The tours of all arms, each way to a place as long as that from it; all ways begin or end at
    the same coordinate at the feeders, where the longest begins at REACH."""
    lengths = {
        arm: [max(t.brings.length, next_tour(each, t.label).goes.length) for t in each]
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
    search = LayoutSearch(factory, cell.product)
    visits = search.visits([paths[n] for n in robots], stations)
    for label, burden in cell.burdens.items():
        key = factory.by_label[label].index, cell.arm_of[label]
        at = arm.middle(visits[key].at)
        if burden.source is None:
            well = cell.wells[label]
            place, elevation = well.place, well.elevation
        else:
            place, elevation = cell.lines[burden.source].stand(burden.takes), 0.0
        shift = place[0] - at[0], place[1] - at[1]
        visits[key] = replace(visits[key], lift=0.0, up=0.0, elevation=elevation, shift=shift)
    for t in every:
        key = cell.burdens[t.label].join.index, cell.arm_of[t.label]
        visits[key] = replace(visits[key], at=t.stop, shift=(t.stop - REACH, 0.0))
    return replace(
        rails,
        factory=factory,
        product=cell.product,
        guidepaths=tuple(paths[n] for n in robots),
        visits=visits,
        hands=tuple(hands.get(n) for n in robots),
        payloads=search.payloads,
        floor=floor_of(cell),
        certificate=None,
        plain=None,
        chains=chains,
    )


def _certificate(cell: Arrangement, layout: Layout) -> Certificate:
    """The certificate of a cell, without what keeps its machines apart."""
    rails = cell.rails[0].certificate
    assert rails is not None
    return replace(
        rails,
        clearance=CERTAIN,
        robots=tuple(robot.name for robot in cell.factory.robots),
        operations=tuple(operation.label for operation in cell.factory.operations),
        regions=tuple(_regions(cell, layout)),
        apart=replace(rails.apart, excluded=(), orders=(), passes=(), backs=(), faults=()),
    )


def _regions(cell: Arrangement, layout: Layout) -> Iterator[Region]:
    """The floor that machines take: the carrier's line, the arms up to their elbows, and their
    feeders."""
    for line in cell.lines.values():
        yield from line.regions
    for arm, stand in cell.stands.items():
        (x, y, z), half = stand.place, 0.25 * cell.ring.outer
        box = x - half, x + half, y - half, y + half
        yield Region(arm, Region.PAYLOADS, Region.ARM, box, (0.0, z + 0.7 * cell.ring.outer))
    for label, well in cell.wells.items():
        arm = cell.arm_of[label]
        yield Region(arm, Region.PAYLOADS, Region.POST, well.feeder.housing, (0.0, cell.top), label)
    shed = layout.shed
    yield Region(0, Region.PAYLOADS, Region.POST, shed, (0.0, cell.top))
