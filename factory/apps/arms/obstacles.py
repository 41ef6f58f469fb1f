"""What stands in the way of an arm of a cell, and the floor that the cell takes."""

from __future__ import annotations

from collections.abc import Iterator

from factory.api import Diagnostic, Layout, LayoutMachines, RunError, Solid
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.crew import RAILS
from factory.apps.arms.lines import Line, overlap, pedestal, upright
from factory.apps.arms.scene import StandingBox
from factory.support.arrays import Array
from factory.support.boxes import Box

BASE = 0.24
"""Height of what of an arm stands above its pedestal, at least [m]."""


def feeder_name(label: str) -> str:
    """What the feeder of a part is called."""
    return f"the feeder of '{label}'"


def placed_name(label: str, line: Line) -> str:
    """What a part on a line is called."""
    return f"'{label}' on {line.name}" if line.carrier else f"'{label}' in the product"


def limb_name(limb: str, line: Line) -> str:
    """What a limb of a carrier's hand is called."""
    return f"the {limb.rpartition('/')[2]} of {line.name}"


def obstacles(cell: Arrangement, arm: int, bare: Layout) -> Iterator[StandingBox]:
    """What stands in an arm's way, or may come there while it is on a transfer.

    Args:
        cell: where things stand.
        arm: the arm (index).
        bare: the layout without legs.
    """
    yield StandingBox("the floor", (-9.0, -9.0, -0.1), (9.0, 9.0, 0.0))
    for label, well in cell.wells.items():
        xlo, xhi, ylo, yhi = well.feeder.housing
        yield StandingBox(feeder_name(label), (xlo, ylo, 0.0), (xhi, yhi, well.feeder.high))
        yield from _part(cell.product.solids[label].presented(), f"'{label}'", cell.shown(label))
    for carrier, line in cell.lines.items():
        yield from line.standing
        for label, solid in line.rails.product.solids.items():
            yield from _part(solid, placed_name(label, line), cell.placed(carrier))
        yield from _hand_of(line, bare)
        yield from _feeder_of(cell, carrier, bare)
    box, top = LayoutMachines(bare).shed
    yield upright("the outfeed's shed", box, 0.0, top)
    yield upright("the outfeed", bare.outfeed, 0.0, cell.top)
    for other, stand in cell.stands.items():
        if other != arm:
            name = cell.factory.robots[other].name
            yield upright(f"the base of {name}", pedestal(stand), 0.0, stand.place[2] + BASE)


def _part(solid: Solid, name: str, off: Array) -> Iterator[StandingBox]:
    """The boxes round the convex pieces of a part."""
    ends = [(piece.min(axis=0), piece.max(axis=0)) for piece in solid.pieces if solid.mesh]
    for low, high in ends or [(solid.low, solid.high)]:
        xlo, ylo, zlo = (low + off).tolist()
        xhi, yhi, zhi = (high + off).tolist()
        yield StandingBox(name, (xlo, ylo, zlo), (xhi, yhi, zhi))


def _hand_of(line: Line, bare: Layout) -> Iterator[StandingBox]:
    """The limbs of a carrier's hand where it stands at the station."""
    path, (x, y) = bare.guidepaths[line.carrier], line.station
    (u, v), (s, t) = path.heading, path.side
    at = x - u * path.reach + s * path.offset, y - v * path.reach + t * path.offset
    for name, (low, high) in LayoutMachines(bare).limbs_at(line.carrier, at):
        yield StandingBox(limb_name(name, line), tuple(low.tolist()), tuple(high.tolist()))


def _feeder_of(cell: Arrangement, carrier: int, bare: Layout) -> Iterator[StandingBox]:
    """What stands of a carrier's feeder."""
    first = cell.factory.first(carrier).label
    feeder = LayoutMachines(bare).feeder(first)
    for name, box, bottom in (
        ("post", feeder.post, 0.0),
        ("boom", feeder.boom, feeder.low),
        ("housing", feeder.housing, feeder.low),
    ):
        yield upright(f"the {name} of '{first}'", box, bottom, feeder.high)


def check_room(cell: Arrangement, bare: Layout) -> None:
    """Check that no carrier's feeder stands in another's, or in the way of another carrier or tool,
    in a feeder of an arm or at an arm. Raises RunError (Layout)."""
    for carrier in cell.lines:
        others = [well.feeder.housing for well in cell.wells.values()]
        others += map(pedestal, cell.stands.values())
        for number, line in cell.lines.items():
            if number != carrier:
                others += [line.swept, *line.tool_boxes]
                others += map(_plan, _feeder_of(cell, number, bare))
        for one in _feeder_of(cell, carrier, bare):
            if any(overlap(_plan(one), box) for box in others):
                message = f"{one.name} has no room beside what else stands"
                raise RunError(Diagnostic("Layout", message, None, f"smaller parts; {RAILS}"))


def _plan(one: StandingBox) -> Box:
    """A box on the floor [m]."""
    return one.low[0], one.high[0], one.low[1], one.high[1]


def floor_of(cell: Arrangement) -> Box:
    """The floor that the cell takes [m]."""
    rails, path = cell.rails[0], cell.rails[0].guidepaths[0]
    xlo, xhi, ylo, yhi = rails.floor
    boxes = [well.feeder.housing for well in cell.wells.values()]
    boxes += map(pedestal, cell.stands.values())
    for line in cell.lines.values():
        boxes += [line.swept, *line.tool_boxes]
    behind = xlo - path.middle(path.length)[0]
    ends = [line.path.middle(line.path.length)[0] for line in cell.lines.values()]
    c = cell.clearance
    return (
        float(min(behind + min(ends), *(b[0] for b in boxes))) - c,
        float(max(xhi, *(b[1] for b in boxes))) + c,
        float(min(ylo, *(b[2] for b in boxes))) - c,
        float(max(yhi, *(b[3] for b in boxes))) + c,
    )
