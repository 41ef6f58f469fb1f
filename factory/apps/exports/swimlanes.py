"""Layout of the drawing of a net: a lane for each robot's gear, time from left to right.

A transition is a bar across the lanes of its robots; a place lies in the lane of its robot, that of
an operation in the middle one of its robots. Where there are no robots a transition is a short bar.
The columns are the lengths of the longest paths
without tokens, so that every arc but those that close a circle goes to the right. The lanes of
robots that meet early are neighbours. Linear in the net, but for sorting.

A net without robots, which may have choice, is laid out from left to right: a transition lies
beside the places that lead to it alone, and a place beside the transitions that mark it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf

from factory.api import MarkedNet
from factory.apps.drawing.canvas import Point

COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00", "#56b4e9", "#7f3c8d", "#e73f74",
)  # fmt: skip
"""Colours of gears, distinguishable for the colour-blind (Okabe and Ito)."""

SHARED = "#333333"
"""Colour of places of several robots, or of none."""

PITCH, LANE = 120.0, 64.0
"""Distances of columns and of lanes."""

LEFT, TOP = 96.0, 64.0
"""Positions of the first column and the first lane."""

CLEAR, AWAY = 22.0, 8.0
"""Least distances of arcs from the middles of places, and from bars."""

OVERHANG = 18.0
"""Length of a bar beyond its outermost lanes, or beyond its middle."""


@dataclass(frozen=True, slots=True)
class Swimlanes:
    """Coordinates on a page, y downwards: the middles of the `places`, `x` and ends (`spans`) of
    the transitions' bars, y of the gears' `lanes`, and the size of the page."""

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
        """Where an arc from a height meets a transition's bar: in the middle of one that is not
        longer than a lane asks for, else at that height."""
        low, high = self.spans[event]
        if high - low <= 2 * OVERHANG + 1e-9:
            return self.middle(event)
        return self.x[event], min(max(y, low), high)

    def way(self, start: Point, end: Point) -> list[Point]:
        """Points of a line to the right from one point to another that avoids bars and places."""
        columns: dict[float, list[Point]] = {}
        for x, y in self.places:
            columns.setdefault(x, []).append((y - CLEAR, y + CLEAR))
        for x, (low, high) in zip(self.x, self.spans, strict=True):
            columns.setdefault(x, []).append((low - AWAY, high + AWAY))
        points = [start]
        for x in sorted(x for x in columns if start[0] < x < end[0]):
            share = (x - points[-1][0]) / (end[0] - points[-1][0])
            y = points[-1][1] + share * (end[1] - points[-1][1])
            points.append((x, _free(y, columns[x])))
        return [*points, end]

    def corners(self, start: Point, end: Point) -> list[Point]:
        """The points of a way without those between which it is level."""
        points = self.way(start, end)
        inner = zip(points, points[1:], points[2:], strict=False)
        return [start, *(b for a, b, c in inner if not a[1] == b[1] == c[1]), end]

    def forward(self, place: int, before: int) -> bool:
        """Whether a place is to the right of a transition that marks it."""
        return self.x[before] < self.places[place][0]


def _free(y: float, taken: Sequence[Point]) -> float:
    """The height nearest to y outside some intervals."""
    ends = [y, *(end for pair in taken for end in pair)]
    free = [end for end in ends if not any(low < end < high for low, high in taken)]
    return min(free, key=lambda end: abs(end - y))


def colour(owners: Sequence[int]) -> str:
    """Colour of a place of these gears (indices)."""
    return COLOURS[owners[0] % len(COLOURS)] if len(owners) == 1 else SHARED


def swimlanes(net: MarkedNet) -> Swimlanes:
    """The coordinates of a net; one without gears has its places one under the other."""
    owners = net.owners
    x = [LEFT + PITCH * (column + 0.5) for column in _columns(net)]
    order = _lane_order(net, x)
    row = {gear: number for number, gear in enumerate(order)}
    lanes = tuple(TOP + LANE * row[gear] for gear in range(len(net.gears)))
    across = [_across(net, place, x) for place in range(len(owners))]
    if net.gears:
        down = _heights(owners, across, lanes, _rows(net))
        spans = _spans(net, down, lanes, x)
    else:
        down, middles = _swept(net, across, x)
        spans = [(middle - OVERHANG, middle + OVERHANG) for middle in middles]
    width = max([*x, *across], default=LEFT) + PITCH
    height = max([*down, *lanes, *(low for low, _ in spans)], default=TOP) + TOP
    places = tuple(zip(across, down, strict=True))
    return Swimlanes(places, tuple(x), tuple(spans), lanes, width, height)


def _columns(net: MarkedNet) -> list[int]:
    """For each transition the length of the longest token-free path to it; 0 on a token-free
    circuit."""
    columns = [0] * len(net.net.transitions)
    for event in net.token_free.order:
        for place in net.net.postset[event]:
            if not net.tokens[place]:
                for after in net.net.places[place].right:
                    columns[after] = max(columns[after], columns[event] + 1)
    return columns


def _across(net: MarkedNet, place: int, x: Sequence[float]) -> float:
    """The x of a place: half a column before its first consumer."""
    before, after = net.net.places[place].left, net.net.places[place].right
    if after:
        return min(x[event] for event in after) - PITCH / 2
    return max((x[event] for event in before), default=LEFT) + PITCH / 2


def _lane_order(net: MarkedNet, x: Sequence[float]) -> list[int]:
    """The gears from top to bottom: below each robot those with which it shares operations, in
    order of time."""
    meetings: list[list[tuple[float, int]]] = [[] for _ in net.gears]
    for place, gears in enumerate(net.owners):
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
    owners: Sequence[Sequence[int]],
    across: Sequence[float],
    lanes: Sequence[float],
    order: Sequence[int],
) -> list[float]:
    """The y of each place: that of its lane, or of a free row below the lanes."""
    below = max(lanes, default=TOP - LANE) + LANE
    taken: dict[float, int] = {}
    heights = [0.0] * len(owners)
    for place in order:
        if gears := owners[place]:
            heights[place] = sorted(lanes[gear] for gear in gears)[(len(gears) - 1) // 2]
            continue
        number = taken.get(across[place], 0)
        taken[across[place]] = number + 1
        heights[place] = below + LANE * number
    return heights


def _swept(
    net: MarkedNet, across: Sequence[float], x: Sequence[float]
) -> tuple[list[float], list[float]]:
    """The y of each place and of each transition of a net without gears, column by column."""
    down, middles = [TOP] * len(across), [TOP] * len(x)
    for column in sorted({*across, *x}):
        wanted, row = dict[int, float](), TOP
        for place in (place for place in _rows(net) if across[place] == column):
            before = [middles[e] for e in net.net.places[place].left if x[e] < column]
            wanted[place] = sum(before) / len(before) if before else row
            row += 0.0 if before else LANE
        for place, y in apart(wanted, LANE).items():
            down[place] = y
        events = (event for event in range(len(x)) if x[event] == column)
        for event, y in apart({e: _beside(net, e, down) for e in events}, LANE).items():
            middles[event] = y
    return down, middles


def _beside(net: MarkedNet, event: int, down: Sequence[float]) -> float:
    """The mean y of the places that lead to a transition, of those that lead to it alone if there
    are any."""
    before = net.net.preset[event]
    alone = [place for place in before if len(net.net.places[place].right) == 1]
    heights = [down[place] for place in alone or before]
    return sum(heights) / len(heights) if heights else TOP


def _rows(net: MarkedNet) -> list[int]:
    """The places in the order of their rows: by the transitions that they lead to, those of fewer
    first."""
    after = [shape.right or shape.left or (0,) for shape in net.net.places]
    return sorted(range(len(after)), key=lambda place: (min(after[place]), len(after[place])))


def _spans(
    net: MarkedNet,
    down: Sequence[float],
    lanes: Sequence[float],
    x: Sequence[float],
) -> list[Point]:
    """Ends of each transition's bar."""
    rows: list[list[float]] = [[] for _ in net.net.transitions]
    for number, gear in enumerate(net.gears):
        for event in gear.transitions:
            if event >= 0:
                rows[event].append(lanes[number])
    alone = {event for event, row in enumerate(rows) if not row}
    for place, shape in enumerate(net.net.places):
        for event in {*shape.left, *shape.right}:
            if not net.owners[place] or event in alone:
                rows[event].append(down[place])
    for lone, height in _spread(alone, rows, x).items():
        rows[lone] = [height]
    return [(min(row, default=TOP) - OVERHANG, max(row, default=TOP) + OVERHANG) for row in rows]


def _spread(
    events: Iterable[int], rows: Sequence[Sequence[float]], x: Sequence[float]
) -> dict[int, float]:
    """The y of transitions without a lane: the mean of their places, at least a lane from others in
    their column."""
    columns: dict[float, dict[int, float]] = {}
    for event in events:
        height = sum(rows[event]) / max(len(rows[event]), 1)
        columns.setdefault(x[event], {})[event] = max(height, TOP)
    return {e: y for column in columns.values() for e, y in apart(column, LANE).items()}


def apart(wanted: Mapping[int, float], least: float) -> dict[int, float]:
    """Heights with at least the distance `least`, in the order of the `wanted` ones and no smaller
    than these."""
    heights: dict[int, float] = {}
    lowest = -inf
    for key in sorted(wanted, key=lambda key: (wanted[key], key)):
        heights[key] = lowest = max(wanted[key], lowest + least)
    return heights
