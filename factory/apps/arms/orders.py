"""What keeps the arms of a cell apart from each other, and from carriers: the parts of their ways
that are theirs alone, and the order places that are asked for where they are not (Theorems 19 and
20)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from factory.api import Diagnostic, Layout, LayoutMachines, Operation, Past, RunError
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.planning import ArmPlanner, ArmTour
from factory.apps.arms.sharing import SweptArm, clear_share

BEYOND = 0.001
"""How much further than it must an arm has gone where it counts as away [m]."""


class InEachOthersWay(Exception):
    """An arm is in another's way even at its feeder."""


@dataclass(frozen=True, slots=True)
class PrivateParts:
    """On which parts of its ways an arm is clear of all ways of all other arms.

    Attributes:
        comes: as far on its way with a part [m].
        leaves: from there on its way from where it has placed that part [m].
    """

    comes: float
    leaves: float


def private_parts(
    planners: Mapping[int, ArmPlanner], tours: Mapping[int, Sequence[ArmTour]]
) -> dict[str, PrivateParts]:
    """The private parts of the ways of each part; none in a cell of one arm. Raises
    InEachOthersWay."""
    if len(tours) == 1:
        return {}
    comes, leaves = dict[int, list[SweptArm]](), dict[int, list[SweptArm]]()
    for arm, each in tours.items():
        comes[arm] = [planners[arm].swept(t.brings, t.label) for t in each]
        leaves[arm] = [planners[arm].swept(next_tour(each, t.label).goes) for t in each]
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
        start: the operation that waits.
        tokens: how much more often it may have started.
    """

    past: Past
    start: Operation
    tokens: int


def orders_of(
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
        return Past.of_carriage(join.end, arm, round(tour.stop + at + BEYOND, 6))

    for before, after in zip([joins[-1], *joins[:-1]], joins, strict=True):
        (one, left), (other, _) = (of[brought[o.index]] for o in (before, after))
        if one != other:
            leaves = private[left.label].leaves
            if cell.lines[after.carrier].steps:  # the carrier goes on under it
                leaves = max(leaves, next_tour(tours[one], left.label).goes.off)
            yield Away(gone(before, leaves), after, int(after is joins[0]))
    for carrier in cell.lines:
        gear = [factory.operations[number] for number in factory.robots[carrier].operations]
        for join, then in pairwise(gear):
            if join.index in brought and then.index not in brought and then.carrier == carrier:
                arm, tour = of[brought[join.index]]
                off = next_tour(tours[arm], tour.label).goes.off
                yield Away(gone(join, off), then, 0)


def orders_at_sources(
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
                past = Past.of_carriage(burden.join.start, arm, round(at, 6), -1)
                yield Away(past, cell.factory.first(burden.source), 1)


def with_orders(
    layout: Layout,
    asked: Sequence[Away],
    tours: Mapping[int, Sequence[ArmTour]],
    alone: Mapping[int, float],
) -> Layout:
    """The layout whose certificate has the passes and order places that are asked for; arms go by
    themselves to over their next feeders, carriers to where they are `alone` [m]. Raises RunError
    (Layout) where the net with them is not live."""
    assert layout.certificate is not None
    backs = {**alone}
    for arm, each in tours.items():
        backs[arm] = round(min(t.begins + t.goes.hover for t in each), 6)
    orders = [(away.past, away.start, away.tokens) for away in asked]
    apart = LayoutMachines(layout).kept_apart(orders, backs)
    if apart.faults:
        message = "the arms wait for each other for ever"
        raise RunError(Diagnostic("Layout", message, None, "one arm: --arm NAME"))
    return replace(layout, certificate=replace(layout.certificate, apart=apart))


def next_tour(tours: Sequence[ArmTour], label: str) -> ArmTour:
    """The tour of an arm after that of a part."""
    labels = [t.label for t in tours]
    return tours[(labels.index(label) + 1) % len(labels)]
