"""The engine's model of a laid-out factory, with the bodies that a run needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from factory.engine.mjcf.timestep import timed
from factory.engine.simulation.request import RunRequest
from factory.engine.timing.pool import part_pool
from factory.floor.geometry.fused_bodies import FusedBodies, bodies_of, fused_copies
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.layout.bins import Bin, bins_of
from factory.floor.layout.layout import Layout
from factory.floor.robots.catalogue import load_catalogue
from factory.support.errors import Diagnostic
from factory.support.settings import Settings
from factory.theory.problem.robot_types import Catalogue

if TYPE_CHECKING:
    from factory.engine.mjcf.model import Finish, Model

SPARE = 2
"""So many copies more of each body are there where parts may be scrapped: they are back in their
feeders only when they have been cleared away."""


def modelled(layout: Layout, request: RunRequest, under_way: Mapping[str, int]) -> Model:
    """The model that a run takes."""
    from factory.engine.mjcf.model import build_model

    bodies = bodies_of(layout.factory, layout.product, request.fuse)
    copies, wip = _copies(layout, bodies, request.units, request.wip, under_way)
    bins: tuple[Bin, ...] = ()
    if request.recovers:
        copies = {label: count + SPARE for label, count in copies.items()}
        bins = bins_of(layout)
    catalogue, settings = request.catalogue or load_catalogue(), timed(request.settings, layout)
    made = build_model(layout, catalogue, copies, settings, bodies, request.shown, wip, bins)
    return replace(made, overlaps=_overlaps(layout))


def _overlaps(layout: Layout) -> tuple[Diagnostic, ...]:
    """Overlaps in a product, and collisions on the way to it, that are not allowed. Units of one
    product are alike, so one of each is examined."""
    factory = layout.factory
    if not factory.pag.is_shaped:
        return ()
    allowed, sequence = factory.pag.allowed, factory.sequence
    firsts = {sequence.index(product) for product in sequence}
    blocked = (
        o.approach.fault(o.label, o.inputs[-1], o.position, allowed)
        for o in factory.operations
        if o.approach is not None and o.turn in firsts
    )
    insides = factory.pag.insides if factory.period > 1 else ()
    overlapping = overlaps_of(layout.product, *insides).faults(allowed)
    return (*overlapping, *(fault for fault in blocked if fault is not None))


def physical_model(
    layout: Layout,
    units: int | None = None,
    settings: Settings | None = None,
    catalogue: Catalogue | None = None,
    wip: int | None = None,
    under_way: Mapping[str, int] | None = None,
    fuse: bool = False,
    shown: bool = True,
    finish: Finish | None = None,
) -> Model:
    """The MJCF model of a layout with the bodies that a number of units needs.

    Args:
        layout: the layout.
        units: number of units; None for any number.
        settings: those of the run; None for the defaults.
        catalogue: the robot types; None for those that are shipped.
        wip: most units inside at once; None for as many as the pool of parts has room for
            (`fitting_wip`).
        under_way: labels that are under way where the run begins, with their number.
        fuse: whether sub-assemblies are bodies, too; then few parts are enough.
        shown: whether it has what is only shown, too.
        finish: what changes its element before it becomes text; None for nothing.
    """
    from factory.engine.mjcf.model import build_model

    bodies = bodies_of(layout.factory, layout.product, fuse)
    copies, wip = _copies(layout, bodies, units, wip, under_way or {})
    catalogue, settings = catalogue or load_catalogue(), timed(settings or Settings(), layout)
    return build_model(layout, catalogue, copies, settings, bodies, shown, wip, (), finish)


def _copies(
    layout: Layout,
    bodies: FusedBodies,
    units: int | None,
    wip: int | None,
    under_way: Mapping[str, int],
) -> tuple[dict[str, int], int | None]:
    """Number of copies of each body, and the largest number of units inside at once."""
    from factory.engine.mjcf.model import fitting_wip, part_copies

    if bodies.wholes:
        return fused_copies(bodies, layout.factory, units), wip
    pool = part_pool(layout.factory)
    wip = wip or fitting_wip(pool, units)
    return part_copies(pool, units, wip, under_way), wip
