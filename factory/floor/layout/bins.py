"""Bins for scrap, beside the B ends of guidepaths.

The carriage passes under the place where its payload is at B, so a bin stands beside its lane, low
enough for payloads to pass over it. A robot at B opens its hand, and a jet of air blows the payload
over there. A bin, and the way from hand to bin, keep clear of all regions of the layout. Where
there is no room there is no bin.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
import shapely
from shapely import STRtree

from factory.floor.layout.carrying_back import not_carried_back
from factory.floor.layout.certificate import BIN_BODY, PAYLOAD_BODY, STATIONS, Region
from factory.floor.layout.crowding import Crowding, separation
from factory.floor.layout.dimensions import ARMS, CARRIAGES, PAYLOADS
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import Pile, piles_of, regions
from factory.support.boxes import Box, Point2, hull, moved
from factory.theory.problem.pag import NOPART

PLATE = 0.002
"""Thickness of a bin's plates [m]."""

SILL = 0.03
"""How high the plate of a bin is over which things come in [m]."""

SLACK = 0.02
"""How much wider than what falls into it a bin is, on each side [m]."""

STEP = 0.02
"""Places for a bin are tried so far apart [m]."""

AHEAD, ASIDE = range(-1, 5), range(16)
"""So many places are tried along a guidepath, from B, and to each of its sides."""


@dataclass(frozen=True, slots=True)
class Bin:
    """The bin of a robot (index): its outer `box`, and the `labels` for which it is wide enough.
    `near`: the side over which things come in, a unit vector from the bin to the lane; `TOP`: how
    high its plates are [m]."""

    TOP: ClassVar[float] = 0.06

    robot: int
    box: Box
    labels: frozenset[str]
    near: Point2

    @property
    def middle(self) -> Point2:
        """Its middle (x, y) [m]."""
        xlo, xhi, ylo, yhi = self.box
        return (xlo + xhi) / 2, (ylo + yhi) / 2

    def holds(self, at: Point2) -> bool:
        """Whether a point is over the bin."""
        xlo, xhi, ylo, yhi = self.box
        return xlo <= at[0] <= xhi and ylo <= at[1] <= yhi


def bins_of(layout: Layout) -> tuple[Bin, ...]:
    """The bins for which there is room, at most one for each robot: wide enough for everything that
    it can carry back to B, else for the smallest."""
    by_label = piles_of(layout)
    taken, added = regions(layout), list[Region]()
    corners = np.array([region.box for region in taken])
    tree = STRtree(shapely.box(*corners[:, [0, 2, 1, 3]].T))
    barred, made = not_carried_back(layout), list[Bin]()
    for robot in range(len(layout.guidepaths)):
        held = _held(layout, robot, by_label, barred)
        held.sort(key=lambda one: (_size(one[1].box), one[0]))
        if not held:
            continue
        far = _reached(layout, held)
        near = [taken[n] for n in tree.query(shapely.box(*far)).tolist()] + added
        while held and not (bin_ := _placed(layout, robot, held, near)):
            held.pop()
        if held and bin_:
            made.append(bin_)
            added += _stands(bin_)
    return tuple(made)


Held = list[tuple[str, Pile]]
"""What a robot holds, by label, and where that is when the robot is at B."""


def _held(
    layout: Layout, robot: int, by_label: Mapping[str, Pile], barred: frozenset[tuple[int, str]]
) -> Held:
    path, result = layout.guidepaths[robot], dict[str, Pile]()
    for number in layout.factory.robots[robot].operations:
        operation = layout.factory.operations[number]
        label = operation.after[operation.robots.index(robot)]
        if label == NOPART or (robot, label) in barred:
            continue
        visit, pile = layout.visits[number, robot], by_label[label]
        result[label] = pile.carried(visit, path.middle(path.length))
    return [*result.items()]


def _placed(layout: Layout, robot: int, held: Held, near: Sequence[Region]) -> Bin | None:
    """The clear place for a bin that is nearest to B."""
    path, labels = layout.guidepaths[robot], frozenset(label for label, _ in held)
    (ux, uy), (tx, ty) = path.heading, path.side
    crowding, boxes = Crowding(layout), [pile.box for _, pile in held]
    half = [max(box[k + 1] - box[k] for box in boxes) / 2 + SLACK + PLATE for k in (0, 2)]
    xlo, xhi, ylo, yhi = hull(boxes)
    x, y = (xlo + xhi) / 2, (ylo + yhi) / 2
    wide = abs(tx) * half[0] + abs(ty) * half[1]
    for aside, ahead, side in product(ASIDE, sorted(AHEAD, key=abs), (-1, 1)):
        across, along = side * (wide + STEP * aside), STEP * ahead
        at = x + ux * along + tx * across, y + uy * along + ty * across
        box = at[0] - half[0], at[0] + half[0], at[1] - half[1], at[1] + half[1]
        one = Bin(robot, box, labels, (-side * tx, -side * ty))
        mine = [*_stands(one), *_flights(one, held)]
        if not any(_meet(crowding, a, b) for a in mine for b in near if a.layer == b.layer):
            return one
    return None


def _meet(crowding: Crowding, one: Region, other: Region) -> bool:
    """Whether two regions of one layer are nearer than they may be."""
    is_own = one.robot == other.robot and (one.kind in STATIONS) == (other.kind in STATIONS)
    if is_own or separation(one.box, other.box) >= crowding.least:
        return False
    return not crowding.may_meet(one, other)


def _reached(layout: Layout, held: Held) -> tuple[float, float, float, float]:
    """The rectangle that bins could come near: least x and y, greatest x and y [m]."""
    xlo, xhi, ylo, yhi = hull([pile.box for _, pile in held])
    far = 2 * _size((xlo, xhi, ylo, yhi)) + STEP * len(ASIDE) + 2 * (SLACK + PLATE)
    far += layout.clearance
    return xlo - far, ylo - far, xhi + far, yhi + far


def _size(box: Box) -> float:
    return max(box[1] - box[0], box[3] - box[2])


def _stands(one: Bin) -> list[Region]:
    return [
        Region(one.robot, layer, BIN_BODY, one.box, (0.0, one.TOP), min(one.labels))
        for layer in (CARRIAGES, ARMS)
    ]


def _flights(one: Bin, held: Held) -> Iterator[Region]:
    """The ways of payloads from the robot at B to over the bin."""
    for label, pile in held:
        xlo, xhi, ylo, yhi = pile.box
        by = one.middle[0] - (xlo + xhi) / 2, one.middle[1] - (ylo + yhi) / 2
        way = hull([pile.box, moved(pile.box, by)])
        yield Region(one.robot, PAYLOADS, PAYLOAD_BODY, way, pile.z, label)
