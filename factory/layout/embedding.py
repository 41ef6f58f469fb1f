"""Lay out a factory: choose sides with symmetric payloads, then stretch with the real ones.

Guarantees what `factory.layout.clearance` proves, and carries the proof: no two robots that are not
coupled by a mode can touch, nor their payloads. All lengths are whole millimetres, so that a
written model loses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor

from factory.errors import Diagnostic, RunError
from factory.factory import Factory
from factory.geometry import Product
from factory.layout.clearance import certify
from factory.layout.dimensions import Clearance
from factory.layout.plan import Box, Extent, Guidepath, Layout, Point2
from factory.layout.shapes import (
    carriers,
    exact_shapes,
    payload_boxes,
    project,
    symmetric_shapes,
)
from factory.layout.sides import admissible
from factory.layout.stretching import Shape, Sides, Stretched, stretch, up
from factory.layout.sweeps import ALWAYS, KINDS, OUTFEED, STATIONS, Region, hull, piles, regions
from factory.mating.judged import judged

SHED = 0.1
"""Length of the open part of the outfeed beyond the product, and of what its end has to spare
[m]."""


def lay_out(
    factory: Factory,
    product: Product,
    clearance: float = 0.02,
    floor: Point2 | None = None,
) -> Layout:
    """The layout of a factory with its clearance certificate. Raises RunError (Layout) where it
    does not fit a floor of the given width and depth, saying by how much and where, or where an
    operation's template asks for what cannot be kept clear."""
    draft = _draft(judged(factory, product), product, Clearance(clearance))
    layout = draft.layout()
    draft.stretched.travel[0] = round(draft.stretched.travel[0] - _spare(layout), 3)
    layout = draft.layout()
    certificate = certify(layout)
    if not certificate.holds:
        raise RunError(fault.diagnostic() for fault in certificate.faults)
    half, box = clearance / 2, hull([region.box for region in certificate.regions])
    bounds = (box[0] - half, box[1] + half, box[2] - half, box[3] + half)
    layout = replace(layout, floor=bounds, certificate=certificate)
    if floor is not None:
        _check_floor(layout, certificate.regions, floor)
    return layout


def headings(factory: Factory, sides: Sides) -> list[tuple[Point2, Point2]]:
    """(u, t) of each robot: a robot on side +1 of its carrier heads against the carrier's t."""
    axes: list[tuple[Point2, Point2]] = [((1.0, 0.0), (0.0, 1.0))] * len(factory.robots)
    for robot, carrier in enumerate(carriers(factory)):
        if carrier >= 0:
            (u, t), side = axes[carrier], sides[robot]
            axes[robot] = ((-side * t[0], -side * t[1]), u)
    return axes


@dataclass(frozen=True, slots=True)
class _Draft:
    """All that is needed to place the robots of a factory on a floor."""

    factory: Factory
    product: Product
    clearance: Clearance
    payloads: dict[str, Box]
    axes: list[tuple[Point2, Point2]]
    shapes: list[Shape]
    stretched: Stretched

    def layout(self) -> Layout:
        """The layout that its lengths give; the floor it takes is not known yet."""
        guidepaths = self._guidepaths()
        return Layout(
            self.factory,
            self.product,
            self.clearance.c,
            guidepaths,
            tuple(self.stretched.stations),
            self.payloads,
            _outfeed(guidepaths[0], self.shapes[0].last, self.clearance),
        )

    def _guidepaths(self) -> tuple[Guidepath, ...]:
        """Places every robot, carriers first: its A is a station of its carrier."""
        paths: list[Guidepath] = []
        for robot, carrier in enumerate(carriers(self.factory)):
            (u, t), shape, a = self.axes[robot], self.shapes[robot], (0.0, 0.0)
            if carrier >= 0:
                number = self.factory.robots[robot].operations[-1]
                on = paths[carrier]
                a = on.middle(on.length - self.stretched.stations[number])
            a = (round(a[0], 3), round(a[1], 3))
            travel = self.stretched.travel[robot]
            paths.append(
                Guidepath(u, t, a, travel, shape.reach, shape.offset, shape.arm, shape.nest)
            )
        return tuple(paths)


def _draft(factory: Factory, product: Product, c: Clearance) -> _Draft:
    payloads = payload_boxes(factory, product)
    compact = stretch(factory, symmetric_shapes(factory, payloads, c), c).sides
    sides = admissible(factory, compact)
    axes = headings(factory, sides)
    shapes = exact_shapes(factory, payloads, axes, sides, c)
    stretched = stretch(factory, shapes.__getitem__, c, sides)
    return _Draft(factory, product, c, payloads, axes, shapes, stretched)


def _outfeed(path: Guidepath, last: Extent, c: Clearance) -> Box:
    """The conveyor: under the product at A and ahead, twice the product's length and some. It is
    no wider than the product, so that what keeps clear of the one keeps clear of the other."""
    ahead = 2 * last[1] - last[0] + 3 * SHED
    return path.world((last[0] - c.c / 2, ahead, last[2], last[3]), path.a)


def _spare(layout: Layout) -> float:
    """How much shorter the output robot's path can be: the outfeed has to be clear of what is
    beside its own course, of the product in the making, and of no more [whole mm]."""
    start, _, low, high = layout.outfeed
    c = layout.clearance
    ahead = [
        region.box[1]
        for region in regions(layout, piles(layout.factory, layout.product))
        if region.kind != OUTFEED
        and (region.robot != 0 or region.mode == ALWAYS)
        and region.box[2] < high + c
        and region.box[3] > low - c
        and not _runs_under(region)
    ]
    spare = start - c - max(ahead)
    return min(floor(spare * 1000 + 1e-6) / 1000, layout.guidepaths[0].travel - up(c))


def _runs_under(region: Region) -> bool:
    """Whether a region is that of the output robot itself, which comes as far as A."""
    return region.robot == 0 and KINDS[region.kind] in ("carriage", "mast", "arm")


def _check_floor(layout: Layout, found: tuple[Region, ...], wanted: Point2) -> None:
    xlo, xhi, ylo, yhi = layout.floor
    size = (xhi - xlo, yhi - ylo)
    if size[0] <= wanted[0] and size[1] <= wanted[1]:
        return
    excess = "; ".join(
        f"{size[i] - wanted[i]:.3f} m too {word}, from {_at_edge(layout, found, 2 * i)}"
        f" to {_at_edge(layout, found, 2 * i + 1)}"
        for i, word in ((0, "wide (along the output robot's path)"), (1, "deep (across it)"))
        if size[i] > wanted[i]
    )
    message = f"the factory takes {size[0]:.3f} x {size[1]:.3f} m of floor: {excess}"
    longest = max(range(len(layout.guidepaths)), key=lambda i: layout.guidepaths[i].length)
    robot = layout.factory.robots[longest]
    fits = "x".join(f"{ceil(length * 100 - 1e-6) / 100:g}" for length in size)
    hint = (
        f"it fits --floor {fits}; the longest guidepath is that of {robot.name}"
        f" ({layout.guidepaths[longest].length:.3f} m)"
    )
    raise RunError(Diagnostic("Layout", message, robot.position, hint))


def _at_edge(layout: Layout, found: tuple[Region, ...], edge: int) -> str:
    """What reaches the farthest at one edge of the floor, in words."""
    outwards = 1 if edge % 2 else -1
    region = max(found, key=lambda r: outwards * r.box[edge])
    if region.kind == OUTFEED:
        return "the outfeed"
    name = layout.factory.robots[region.robot].name
    if region.kind in STATIONS:
        return f"the feeder of '{region.label}' ({name})"
    return f"{name}'s {KINDS[region.kind]}"


__all__ = ["headings", "lay_out", "project"]
