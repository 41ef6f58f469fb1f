"""Assembly planning for parts in place: from a source to a tree, or a proof that there is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import monotonic
from typing import Any

import numpy as np

from factory.api import Diagnostic, InputError, Pace, Project, Settings, Template, all_templates
from factory.apps.planning.blocking import (
    CLASHES,
    DEEPER,
    LOCKED,
    SCRAPES,
    Blocking,
    blocking,
    rooms,
)
from factory.apps.planning.cannot import Direction, Interlock, Removal, removal
from factory.apps.planning.exact import Expected
from factory.apps.planning.falling import held_by, senseless
from factory.apps.planning.fastening import fasteners
from factory.apps.planning.judging import Join, Judged
from factory.apps.planning.laying import LaidOut, Layouts, OutOfTime
from factory.apps.planning.parts import InPlace, refuse_hidden
from factory.apps.planning.posing import (
    Pose,
    along,
    falling,
    loose,
    onto,
    posed,
    said,
    screwing,
    sharing,
    toppling,
)
from factory.apps.planning.searching import Aim, budget_of
from factory.apps.planning.seeking import Seeking
from factory.apps.planning.standing import feet
from factory.apps.planning.subsets import MOST, stances
from factory.apps.planning.writing import Tree, leaves, screws_in
from factory.floor.geometry.overlapping import Overlapping
from factory.support.allowance import Allowance
from factory.support.arrays import Array
from factory.support.errors import did_you_mean

DECOMPOSING = "decomposing parts into convex bodies"
"""The name of the stage after a tree is found: layouts and runs need these bodies, ways do not."""

LAYING = "laying out"
"""The name of the last stage of planning."""

GRACE = 1.0
"""If the time is over, what blocks what may still be computed for so long, and decomposition before
the first layout may still take so long [s]."""

HELD, AGAIN = 3, 1
"""So often trees of a few units are sought again in which what no hand can hold is joined
otherwise, and so many of these are laid out."""


@dataclass(frozen=True)
class PlanOptions:
    """`aim`: the objective; `seconds`: the search time, None for a number of candidates that is
    the same on any machine (`searching`); `allow`: units that may pass through others, or two,
    `a:b`, through each other; `hulls`: whether hulls may hide parts in their cavities; `up`: the
    axis and side of the file that is up, None for z unless the product tips over; `base`: the unit
    onto which all others come, "" for any; `screws`: units that are screws besides those that are
    recognised, None for no screws at all; `lay_out`: whether layouts decide, or estimates alone;
    `settings` and `templates` of the factory, None for those shipped; `told` is called with the
    stage, the progress, and a text; `stopped` tells whether the best tree so far is wanted at
    once."""

    aim: Aim = "cycle"
    seconds: float | None = None
    allow: tuple[str, ...] = ()
    hulls: bool = False
    up: Direction | None = None
    base: str = ""
    screws: tuple[str, ...] | None = ()
    lay_out: bool = True
    settings: Settings = field(default_factory=Settings)
    templates: Mapping[str, Template] | None = field(default=None, repr=False)
    told: Callable[[str, int, int | None, str], None] = field(default=lambda *_: None, repr=False)
    stopped: Callable[[], bool] = field(default=lambda: False, repr=False)


@dataclass(frozen=True, slots=True)
class PlannedJoin:
    """An operation of a plan: the units of the pile, and those that `come`; the `direction` (3,) in
    the source's frame in which these would leave; the least `clearance` [m] on that way (infinite
    if nothing is near, negative for parts drawn into each other); whether they, or the pile, are
    lowered; and whether they pass through each other."""

    pile: tuple[str, ...]
    come: tuple[str, ...]
    direction: tuple[float, float, float]
    clearance: float
    lowered: bool
    blocked: bool


@dataclass(frozen=True, slots=True)
class PlanFigures:
    """The figures of a plan: the number of operations; of those that are `blocked`, that have parts
    which were drawn into each other pass through each other (`through`) or get a little deeper
    (`left_out`), and that scrape; of sub-assemblies that are not connected (`apart`), would tip
    over (`tips`), are handed over to be turned (`relays`), of which something falls (`falls`), or
    that no hand can hold (`not_held`, None without layouts); of trees that were laid out; of
    robots; the cycle time expected from sizes and the predicted one [s], and the floor area [m²]
    (None without layouts)."""

    operations: int
    blocked: int
    through: int
    left_out: int
    scrape: int
    apart: int
    tips: int
    relays: int
    robots: int
    expected: float
    falls: int = 0
    not_held: int | None = None
    layouts: int = 0
    cycle: float | None = None
    area: float | None = None


@dataclass(frozen=True)
class Planned:
    """A `tree` of labels, as `writing.planned_product` takes it, the rotation (3, 3) of the product
    onto the floor, what gives its operations, its figures, and the laid-out `project` (None if
    estimates alone decided). `optimal`: whether it is proved that no tree is better in price and
    expected cycle; `hidden`: the pairs that overlap according to accepted hulls; `notes`: the
    orientation and other remarks; `screws`: the units that are screws, driven in or not; `lines`:
    those that share a robot, `alone`: why others do not."""

    tree: Tree = field(repr=False)
    orientation: Array
    joined: Callable[[], tuple[PlannedJoin, ...]] = field(repr=False, compare=False)
    figures: PlanFigures
    optimal: bool
    project: Project | None = field(default=None, repr=False, compare=False)
    hidden: tuple[Overlapping, ...] = field(default=(), repr=False)
    notes: tuple[str, ...] = ()
    screws: tuple[str, ...] = ()
    lines: tuple[tuple[str, ...], ...] = ()
    alone: tuple[str, ...] = ()

    @cached_property
    def operations(self) -> tuple[PlannedJoin, ...]:
        """Its operations, whose clearances are measured when they are asked for."""
        return self.joined()


@dataclass(frozen=True)
class CannotAssemble:
    """A proof that no tree of straight motions along the axes joins the parts: those that
    interlock. Without `removal`, or with its clashes accepted (`allow`), the rest can be joined.
    `needs`: the other directions (3,) in which parts with these labels could be separated, each set
    by itself."""

    interlocks: tuple[Interlock, ...]
    removal: Removal
    needs: tuple[tuple[tuple[str, ...], Array], ...] = field(default=(), compare=False)


def plan(source: InPlace, options: PlanOptions | None = None) -> Planned | CannotAssemble:
    """The best tree for a source's parts, or why there is none. Raises InputError if `allow` or
    `base` names no unit, or the product tips over with `up` upwards (Usage), or if hulls hide parts
    in their cavities (Hulls)."""
    asked = options or PlanOptions()
    budget = budget_of(len(source.units()), asked.seconds, asked.stopped)
    asked.told("computing what blocks what", 0, None, "")

    def watch() -> None:
        if budget.elapsed > budget.seconds + GRACE:
            message = "the time was over before it was known what blocks what: there is no tree"
            raise InputError(Diagnostic("Usage", message, None, "give it more --seconds, or none"))

    graphs = blocking(source, watch)
    named = (*asked.allow, *([asked.base] if asked.base else ()), *(asked.screws or ()))
    _check_named(named, graphs)
    pairs = graphs.hidden
    if not asked.hulls:
        refuse_hidden(source, pairs)
    graphs = graphs.allowing(asked.allow)

    def graph(source: InPlace) -> Blocking:
        return blocking(source, watch).allowing(asked.allow)

    screws = () if asked.screws is None else fasteners(source, asked.screws)
    pose = posed(source, graphs, asked.up, graph, screws)
    if pose.stuck:
        return CannotAssemble(pose.stuck, removal(graphs), pose.needs)
    planned = _planned(pose, asked, budget)
    figures = planned.figures
    notes = (*said(pose, planned.orientation), onto(leaves(planned.tree)[0]))
    notes += (*toppling(figures.tips), *falling(figures.falls, figures.operations - 1))
    notes += (*loose(figures.apart), *sharing(planned.lines), *planned.alone)
    notes += screwing(screws_in(planned.tree), planned.screws)
    return replace(planned, hidden=pairs if asked.hulls else (), notes=notes)


def _planned(pose: Pose, asked: PlanOptions, budget: Allowance) -> Planned:
    source = pose.source
    stands = feet([parts for _, parts in source.units()], along(pose.up))
    base = pose.graphs.labels.index(asked.base) if asked.base else -1
    graphs = replace(pose.graphs, feet=stands, base=base).standing(*pose.up)
    screws = _screws(source, graphs, asked)
    named, firm = tuple(graphs.labels[n] for n in screws), held_by(graphs, screws)
    templates = all_templates() if asked.templates is None else asked.templates
    expected, seen, laid = Expected(Pace.of(asked.settings)), [0], [0]

    def told(judged: Judged) -> None:
        seen[0] += 1
        words = f"{judged.robots} robots, about {judged.seconds:.1f} s"
        asked.told("searching for a tree", seen[0], None, words)

    search: tuple[Any, ...] = (screws, stances(pose.up), expected, templates, asked.aim, told)
    seeking: Seeking | None = Seeking(source, graphs, *search)
    assert seeking is not None
    sought = seeking.trees(budget)
    if asked.lay_out:
        asked.told(DECOMPOSING, 1, None, "")

    begun = monotonic()

    def decomposed(done: int, total: int) -> None:
        asked.told(DECOMPOSING, done, total, "meshes")
        if done < total and budget.left == 0.0 and monotonic() - begun > GRACE:
            raise OutOfTime

    layouts = Layouts(source, templates, asked.settings, decomposed)

    def said(best: LaidOut) -> None:
        laid[0] += 1
        words = f"{best.robots} robots, {best.seconds:.2f} s"
        asked.told(LAYING, laid[0], len(sought.all), words)

    try:
        if not asked.lay_out:
            made = _result(pose, layouts.of(sought.all[0]), sought.optimal, 0, firm)
            return replace(made, screws=named)
        best = layouts.best(sought.all, asked.aim, budget, said)
    except OutOfTime:
        drafted = layouts.drafted(sought.all[0])
        return replace(_result(pose, drafted, False, 0, firm), screws=named)
    for _ in range(HELD):
        seeking = seeking.without(layouts.unheld(best)) if seeking else None
        if seeking is None or budget.left == 0.0 or len(graphs) - len(screws) > MOST:
            break
        again = seeking.trees(replace(budget, spent=0))
        better = layouts.best(again.all[:AGAIN], asked.aim, budget, said, [best])
        if better is not best:
            best, sought = better, again
    return replace(_result(pose, best, sought.optimal, laid[0], firm), screws=named)


def _screws(source: InPlace, graphs: Blocking, asked: PlanOptions) -> tuple[int, ...]:
    """The units that are screws, those of one kind in a row; empty if there are no other units."""
    if asked.screws is None:
        return ()
    kinds = {part.label: part.kind for part in source.parts}
    labels = sorted(fasteners(source, asked.screws), key=lambda label: kinds.get(label, label))
    numbers = tuple(graphs.labels.index(label) for label in labels if label != asked.base)
    return numbers if len(numbers) < len(graphs) else ()


def _result(pose: Pose, laid: LaidOut, optimal: bool, layouts: int, firm: Blocking) -> Planned:
    judged = laid.judged
    figures = PlanFigures(
        operations=len(judged.joins),
        blocked=laid.blocked if layouts else judged.count(CLASHES),
        through=judged.count(LOCKED) - judged.count(CLASHES),
        left_out=judged.count(DEEPER) - judged.count(LOCKED),
        scrape=judged.count(SCRAPES) - judged.count(DEEPER),
        apart=judged.apart,
        tips=judged.tips,
        relays=judged.relays,
        robots=laid.robots if layouts else judged.robots,
        expected=judged.seconds,
        falls=senseless(firm, judged.tree)[0],
        not_held=laid.held if layouts else None,
        layouts=layouts,
        cycle=laid.seconds if layouts and np.isfinite(laid.seconds) else None,
        area=laid.area if layouts and np.isfinite(laid.area) else None,
    )

    def joined() -> tuple[PlannedJoin, ...]:
        axes = sorted({join.direction[0] for join in judged.joins})
        room = {axis: rooms(pose.source, axis) for axis in axes}
        return tuple(_join(join, pose, room[join.direction[0]]) for join in judged.joins)

    project = laid.project if layouts else None
    orientation = judged.stance.rotation @ pose.turn
    shared: dict[str, Any] = {"lines": laid.lines, "alone": laid.apart}
    return Planned(laid.tree, orientation, joined, figures, optimal, project, **shared)


def _join(join: Join, pose: Pose, room: Array) -> PlannedJoin:
    _, side = join.direction
    at = (join.come, join.pile) if side > 0 else (join.pile, join.come)
    least = float(room[np.ix_(*at)].min())
    x, y, z = (float(n) + 0.0 for n in pose.turn.T @ along(join.direction))
    pile, come = (tuple(pose.graphs.labels[n] for n in units) for units in (join.pile, join.come))
    return PlannedJoin(pile, come, (x, y, z), least, join.lowered, join.level >= LOCKED)


def _check_named(names: tuple[str, ...], graphs: Blocking) -> None:
    faults = [
        Diagnostic("Usage", f"there is no part or kept sub-assembly '{label}'", None, hint)
        for name in names
        for label in (name.split(":", 1) if name not in graphs.labels else ())
        if label not in graphs.labels
        for hint in [did_you_mean(label, list(graphs.labels), "labels")]
    ]
    if faults:
        raise InputError(faults)
