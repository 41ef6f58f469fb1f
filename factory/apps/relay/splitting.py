"""A layout with relays: each way that is cut becomes the guidepaths of several robots.

Guarantees that what is carried goes where it went: the guidepaths of robots that relay each other
lie in one line, their carriages in two lanes beside it by turns.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from factory.api import NOPART, Catalogue, Factory, Guidepath, Layout, LayoutSearch, Node, Template
from factory.apps.relay.in_line import InLine, hands_in_line
from factory.apps.relay.ways import Way
from factory.theory.compiler.relays import with_relays


@dataclass(frozen=True, slots=True)
class Piece:
    """The piece of another robot's guidepath that a robot has: from `start` to `end`, distances
    from its B end [m]; the operations (by their labels without relays) that it does there."""

    robot: int
    start: float
    end: float


def split(
    layout: Layout,
    ways: Mapping[str, Way],
    numbers: Mapping[str, int],
    templates: Mapping[str, Template],
    catalogue: Catalogue,
) -> Layout:
    """The layout with a given number of relays on the way of each label. Linear."""
    before = layout.factory
    factory = with_relays(before, numbers, templates, catalogue)
    cut = {r: list(_pieces(layout, r, ways, factory)) for r in range(len(before.robots))}
    hands, turned = _hands(layout, factory, cut)
    search = LayoutSearch(factory, layout.product, layout.clearance)
    paths: dict[int, Guidepath] = {}
    starts: dict[int, float] = {}
    for robot, pieces in cut.items():
        spread = search.size.spread * (-1 if robot in turned else 1)
        for number, piece in enumerate(reversed(pieces)):
            lane = spread * (-1) ** number if len(pieces) > 1 else 0.0
            paths[piece.robot] = _path(layout.guidepaths[robot], piece, lane)
            starts[piece.robot] = piece.start
    stations = [0.0] * len(factory.operations)
    for operation in before.making:
        made = factory.by_label[operation.label]
        station = layout.guidepaths[operation.carrier].length - layout.station(operation.index)
        stations[made.index] = round(station - starts[made.carrier], 3)
    guidepaths = tuple(paths[robot.index] for robot in factory.robots)
    return replace(
        layout,
        factory=factory,
        guidepaths=guidepaths,
        visits=search.visits(guidepaths, stations),
        hands=hands,
        payloads=search.payloads,
        certificate=None,
    )


def _hands(layout: Layout, factory: Factory, cut: Mapping[int, Sequence[Piece]]) -> InLine:
    """The hands of robots with relays; none where they are not chosen."""
    if not layout.hands:
        return (), set()
    origins = {piece.robot: robot for robot, pieces in cut.items() for piece in pieces}
    lines = {r: [p.robot for p in reversed(pieces)] for r, pieces in cut.items() if len(pieces) > 1}
    relays = {o.index for o in factory.making if origin_of(o.label) != o.label}
    return hands_in_line(layout, factory, [origins[r.index] for r in factory.robots], lines, relays)


def _pieces(
    layout: Layout, robot: int, ways: Mapping[str, Way], factory: Factory
) -> Iterator[Piece]:
    """The pieces of one guidepath, from B to A."""
    start, before = 0.0, layout.factory
    for number in before.robots[robot].operations:
        operation = before.operations[number]
        slot = operation.robots.index(robot)
        chosen = factory.by_label[operation.label].robots[slot]
        label = operation.after[slot]
        if label == NOPART or label not in factory.plan.relays:
            continue
        for relay, cut in enumerate(ways[label].cuts(factory.plan.relays[label])):
            yield Piece(chosen, start, cut)
            start, chosen = cut, factory.by_label[Node.relay_label(label, relay)].carrier
    yield Piece(chosen, start, layout.guidepaths[robot].travel)


def _path(path: Guidepath, piece: Piece, lane: float) -> Guidepath:
    """The guidepath of a piece, in a lane displaced to the side."""
    back = path.travel - piece.end
    a = tuple(round(a - u * back, 3) for a, u in zip(path.a, path.heading, strict=True))
    return replace(
        path,
        a=(a[0], a[1]),
        travel=round(piece.end - piece.start, 3),
        offset=round(path.offset + lane, 3),
        aside=-lane,
    )


def origin_of(label: str) -> str:
    """Label before hand-overs."""
    origin, _, last = label.rpartition("/")
    return origin if last.startswith(Node.RELAY) else label
