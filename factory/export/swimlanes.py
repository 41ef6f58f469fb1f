"""Where the nodes of a net are drawn, and in which colour: a lane for each robot's gear, time from
left to right.

A transition is a bar across the lanes of its robots; a place lies in the lane of its robot, that of
an operation in the middle one of its robots. The columns are the lengths of the longest paths
without tokens, so that every arc but those that close a circle goes to the right. The lanes of
robots that meet early are neighbours. Linear in the net, but for sorting.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from factory.nets.marked import MarkedNet, token_free
from factory.support.canvas import Point

COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00", "#56b4e9", "#7f3c8d", "#e73f74",
)  # fmt: skip
"""Of gears, which the colour-blind can tell apart (Okabe and Ito)."""

SHARED = "#333333"
"""The colour of what belongs to several robots, or to none."""

PITCH, LANE = 120.0, 64.0
"""Distance of columns, and of lanes."""

LEFT, TOP = 96.0, 64.0
"""Where the first column and the first lane are."""

OVERHANG = 18.0
"""How far a bar goes beyond its outermost lanes."""


@dataclass(frozen=True, slots=True)
class Swimlanes:
    """Coordinates on a page, y downwards: the middle of each place, the `x` of each transition and
    from where to where its bar goes (`spans`), the `lanes` of the gears, the size of the page."""

    places: tuple[Point, ...]
    x: tuple[float, ...]
    spans: tuple[Point, ...]
    lanes: tuple[float, ...]
    width: float
    height: float

    def middle(self, event: int) -> Point:
        """The middle of a transition's bar."""
        low, high = self.spans[event]
        return self.x[event], (low + high) / 2

    def touch(self, event: int, y: float) -> Point:
        """The point of a transition's bar that is nearest to a height."""
        low, high = self.spans[event]
        return self.x[event], min(max(y, low), high)

    def forward(self, place: int, before: int) -> bool:
        """Whether a place is to the right of a transition that marks it."""
        return self.x[before] < self.places[place][0]


def colour(owners: Sequence[int]) -> str:
    """The colour of what belongs to these gears (indices)."""
    return COLOURS[owners[0] % len(COLOURS)] if len(owners) == 1 else SHARED


def owners_of(net: MarkedNet) -> list[list[int]]:
    """For each place the gears (indices) that it is in."""
    owners: list[list[int]] = [[] for _ in net.tokens]
    for number, gear in enumerate(net.gears):
        for place in gear.places:
            owners[place].append(number)
    return owners


def swimlanes(net: MarkedNet) -> Swimlanes:
    """The coordinates of a net; one without gears has its places one under the other."""
    owners = owners_of(net)
    x = [LEFT + PITCH * (column + 0.5) for column in _columns(net)]
    order = _lane_order(net, owners, x)
    row = {gear: number for number, gear in enumerate(order)}
    lanes = tuple(TOP + LANE * row[gear] for gear in range(len(net.gears)))
    across = [_across(net, place, x) for place in range(len(owners))]
    down = _heights(owners, across, lanes)
    spans = _spans(net, owners, down, lanes)
    width = max([*x, *across], default=LEFT) + PITCH
    height = max([*down, *lanes], default=TOP) + TOP
    places = tuple(zip(across, down, strict=True))
    return Swimlanes(places, tuple(x), tuple(spans), lanes, width, height)


def _columns(net: MarkedNet) -> list[int]:
    """For each transition the length of the longest path to it without tokens; 0 for those on a
    circle without."""
    columns = [0] * len(net.net.transitions)
    for event in token_free(net).order:
        for place in net.net.postset[event]:
            if not net.tokens[place]:
                for after in net.net.places[place].right:
                    columns[after] = max(columns[after], columns[event] + 1)
    return columns


def _across(net: MarkedNet, place: int, x: Sequence[float]) -> float:
    """A place stands half a column before what it leads to."""
    before, after = net.net.places[place].left, net.net.places[place].right
    if after:
        return min(x[event] for event in after) - PITCH / 2
    return max((x[event] for event in before), default=LEFT) + PITCH / 2


def _lane_order(net: MarkedNet, owners: Sequence[Sequence[int]], x: Sequence[float]) -> list[int]:
    """The gears from top to bottom: below each robot those it meets, the earliest first."""
    meetings: list[list[tuple[float, int]]] = [[] for _ in net.gears]
    for place, gears in enumerate(owners):
        if len(gears) > 1:
            when = min((x[event] for event in net.net.places[place].left), default=0.0)
            for gear in gears:
                meetings[gear] += [(when, other) for other in gears if other != gear]
    order: list[int] = []
    seen: set[int] = set()
    for first in range(len(net.gears)):
        stack = [first]
        while stack:
            gear = stack.pop()
            if gear not in seen:
                seen.add(gear)
                order.append(gear)
                stack += [other for _, other in sorted(meetings[gear], reverse=True)]
    return order


def _heights(
    owners: Sequence[Sequence[int]], across: Sequence[float], lanes: Sequence[float]
) -> list[float]:
    """The height of each place: its lane, else a row below that is free in that column."""
    below = max(lanes, default=TOP - LANE) + LANE
    taken: dict[float, int] = {}
    found = []
    for place, gears in enumerate(owners):
        if gears:
            found.append(sorted(lanes[gear] for gear in gears)[(len(gears) - 1) // 2])
            continue
        number = taken.get(across[place], 0)
        taken[across[place]] = number + 1
        found.append(below + LANE * number)
    return found


def _spans(
    net: MarkedNet,
    owners: Sequence[Sequence[int]],
    down: Sequence[float],
    lanes: Sequence[float],
) -> list[Point]:
    """From where to where each transition's bar goes."""
    rows: list[list[float]] = [[] for _ in net.net.transitions]
    for number, gear in enumerate(net.gears):
        for event in gear.transitions:
            if event >= 0:
                rows[event].append(lanes[number])
    for place, shape in enumerate(net.net.places):
        for event in (*shape.left, *shape.right):
            if not rows[event] or not owners[place]:
                rows[event].append(down[place])
    return [
        (min(found, default=TOP) - OVERHANG, max(found, default=TOP) + OVERHANG) for found in rows
    ]
