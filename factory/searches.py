"""The public functions that search: for the assembly of a product, for its Pareto-optimal
factories, and for that of its next revision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from factory.stages import AnyPath, Stage, maybe, path_of, project_of
from factory.support.guard import guarding
from factory.support.settings import Settings

if TYPE_CHECKING:
    from factory.apps.pareto import ParetoFront
    from factory.apps.planning.plan import Planned
    from factory.apps.revise.revision import Revision
    from factory.theory.problem.pag import PAG


def pareto(
    product: Stage,
    *,
    validate: int = 0,
    effort: int | None = None,
    seconds: float | None = None,
    layouts: bool = True,
    settings: Settings | None = None,
) -> ParetoFront:
    """The Pareto-optimal factories of a product in robots, cycle time and floor area.

    `validate`: number of points that are run in both worlds; `effort`: number of factories to lay
    out; `seconds`: time limit [s]; without `layouts` they are estimated. Raises InputError,
    RunError where no factory has a layout."""
    from factory.apps.pareto import Effort
    from factory.apps.pareto import pareto as searched
    from factory.apps.pareto.front import tried
    from factory.support.bounds import check_values
    from factory.support.errors import usage_error

    if validate and not layouts:
        raise usage_error("without layouts there is nothing to run", "leave out validate")
    check_values({"seconds": seconds})
    bounds = Effort(layouts, effort, inf if seconds is None else seconds)
    front = searched(project_of(product, settings), bounds)
    for number in front.spread(validate) if validate else ():
        front = front.with_trial(number, tried(front.points[number].project))
    return front


def revise(old: Stage, new: Stage, *, pin: Literal["all", "hands", "none"] = "all") -> Revision:
    """What stays of the factory of a product in that of its next revision, laid out so that most
    does; a notebook shows it as a picture. `pin`: what of the old layout is kept, or less where no
    layout has that. Raises InputError for shared robots, RunError where there is no layout."""
    from factory.apps.revise.revision import revised
    from factory.support.bounds import check_choice
    from factory.theory.nets.verify import proved

    check_choice("pin", pin, ("all", "hands", "none"))
    before = project_of(old)
    revision = revised(before, project_of(new, before.settings), pin)
    proved(revision.new.layout.factory.net)
    return revision


class PlannedAssembly(NamedTuple):
    """The assembly tree that was planned, as a PAG; the plan with its figures; the files that were
    written, that of the PAG first."""

    pag: PAG
    planned: Planned
    files: tuple[Path, ...]


@guarding
def plan(
    source: AnyPath,
    output: AnyPath,
    *,
    aim: Literal["cycle", "robots", "floor"] = "cycle",
    seconds: float | None = None,
    keep: Sequence[str] = (),
    replan: bool = False,
    allow: Sequence[str] = (),
    up: Literal["x", "y", "z", "-x", "-y", "-z"] | None = None,
    base: str = "",
    screws: Sequence[str] | None = (),
    hulls: bool = False,
    unit: Literal["m", "cm", "mm", "in", "ldu"] | None = None,
    in_place: bool = False,
    library: AnyPath | None = None,
    boxes: bool = False,
    templates: Sequence[AnyPath] = (),
) -> PlannedAssembly:
    """The assembly tree of parts that are in their places in the finished product, written as a PAG
    with its meshes into the folder `output`.

    `source`: a folder of meshes, a file with named bodies, an LDraw model, or a PAG, of whose tree
    the sub-trees `keep` stay, or all unless `replan`. `aim`: what to minimise; `seconds`: time to
    search; `allow`: parts that may pass through others, or pairs `a:b`, or depths `0.5mm`; `up`:
    the axis of the source that points up; `base`: what the others are assembled onto; `screws`:
    parts that are screws, None where none is; `hulls`: plan with convex hulls; `unit`: of lengths;
    `in_place`: the parts are not checked for their places; `library`: of LDraw parts, `boxes` for
    those without a shape. Raises InputError, of code CannotAssemble for parts that interlock.
    """
    from factory.apps.planning.outcome import refusal, write_planned
    from factory.apps.planning.plan import CannotAssemble, PlanOptions
    from factory.apps.planning.plan import plan as planned_for
    from factory.apps.planning.source import SourceOptions, read_source
    from factory.pipeline import all_templates, read
    from factory.support.bounds import AIMS, LENGTHS, UPS, check_choice, check_values
    from factory.support.errors import InputError
    from factory.theory.lang.overlaps import overlaps_in

    check_values({"seconds": seconds})
    check_choice("aim", aim, AIMS)
    for name, value, valid in (("up", up, tuple(UPS)), ("unit", unit, LENGTHS)):
        if value is not None:
            check_choice(name, value, valid)
    operations, file = all_templates(templates), path_of(source)
    fast = None if screws is None else tuple(screws)
    options = SourceOptions(unit, tuple(keep), replan, maybe(library), boxes, in_place, fast)
    placed = read_source(file, operations, options)
    meant, passing = overlaps_in(allow, {part.label for part in placed.parts})
    placed = replace(placed, allowed=(*placed.allowed, *meant))
    search = PlanOptions(aim, seconds, passing, hulls, UPS[up] if up else None, base, fast)
    planned = planned_for(placed, replace(search, templates=operations))
    if isinstance(planned, CannotAssemble):
        raise InputError(refusal(planned))
    files = write_planned(placed, planned, path_of(output), file, passing, operations)
    return PlannedAssembly(read(files[0], templates).pag, planned, files)
