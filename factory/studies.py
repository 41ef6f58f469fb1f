"""The public functions that study a factory, revise it, and plan the assembly of a product."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from factory.stages import AnyPath, Stage, maybe, path_of, project_of
from factory.support.guard import guarding, will_write
from factory.support.settings import Settings

if TYPE_CHECKING:
    from factory.apps.analyze import Analysis
    from factory.apps.fidelity.record import Fidelity
    from factory.apps.pareto import ParetoFront
    from factory.apps.planning.plan import Planned
    from factory.apps.revise.revision import Revision
    from factory.apps.sweep.summary import Summary
    from factory.engine.simulation.run import Run
    from factory.support.bounds import WorldName
    from factory.theory.problem.pag import PAG


def analyze(
    product: Stage,
    *,
    units: int = 20,
    world: WorldName = "mujoco",
    seed: int = 0,
    jitter: float = 0.0,
    wip: int | None = None,
    second: Sequence[str] = (),
    faster: Mapping[str, float] | None = None,
    shorter: Mapping[str, float] | None = None,
    measured: Run | AnyPath | None = None,
    settings: Settings | None = None,
) -> Analysis:
    """The cycle time of a factory by its timed net, what limits it, and what would relieve it.

    What if: a `second` robot like each of some, robots that are `faster` or whose ways are
    `shorter` by percent ({"r4": 20}). `measured`: a run, or the log of one, to compare with, under
    its seed, jitter and, of a log, settings. Raises InputError, RunError.

    >>> import factory
    >>> factory.analyze("examples/paper.pag").bottlenecks
    ('r3',)
    """
    from factory.apps.analyze import Timing, analyse
    from factory.apps.analyze.analysing import change_of
    from factory.apps.analyze.measured import Conditions, conditions, logged_record, record_of
    from factory.apps.log import read_log
    from factory.apps.runs.options import RunOptions
    from factory.engine.simulation.run import Run
    from factory.theory.nets.verify import proved

    asked = RunOptions(world, units, seed, jitter, wip)
    run = measured if isinstance(measured, Run) else None
    log = None if measured is None or run else read_log(path_of(measured))
    project = project_of(product, conditions(log.header).settings if log else settings)
    made = Conditions(project.settings, world, seed, jitter, wip)
    if run is not None:
        made = replace(made, seed=run.seed, jitter=run.jitter)
    elif log is not None:
        made = conditions(log.header)
    layout = project.layout
    proved(layout.factory.net)
    timing = Timing(layout, made.settings, made.world, made.seed, made.jitter)
    change = change_of(layout.factory, second, faster, shorter)
    record = None if run is None else record_of(run)
    if log is not None:
        record = logged_record(str(measured), log, layout.factory)
    count = len(record.dropoffs) if record else asked.units
    return analyse(timing, count, made.wip, change, record)


@guarding
def sweep(
    product: Stage,
    database: AnyPath,
    vary: Mapping[str, Iterable[float | str]],
    *,
    world: WorldName | None = None,
    units: int | None = None,
    seed: int | None = None,
    jitter: float | None = None,
    wip: int | None = None,
    max_time: float | None = None,
    fuse: bool | None = None,
    jobs: int | None = None,
    retry: bool = False,
    settings: Settings | None = None,
    on: str | None = None,
) -> Summary:
    """Run a product for every combination of the varied values ({"seed": range(100)}), keep the
    results in a database (SQLite) and summarise them. Called again, it continues where it stopped.

    `jobs`: processes, one per core by default; `on`: address of a Dask scheduler, whose workers are
    taken instead; `retry`: failed runs are repeated. The others are those of `run`. Raises
    InputError, RunError.
    """
    from factory.apps.sweep.grid import read_axes
    from factory.apps.sweep.pool import cores
    from factory.apps.sweep.recipe import recipe_of
    from factory.apps.sweep.summary import summarise
    from factory.apps.sweep.sweeping import sweep as swept
    from factory.support.bounds import WORLDS, check_choice, check_values

    shared = {"units": units, "seed": seed, "jitter": jitter, "wip": wip}
    check_values({**shared, "max_time": max_time, "jobs": jobs})
    if world is not None:
        check_choice("world", world, WORLDS)
    axes = read_axes([f"{key}={','.join(map(str, values))}" for key, values in vary.items()])
    kept = path_of(database)
    will_write(kept)
    project = project_of(product, settings)
    recipe = recipe_of(project, axes, {**shared, "world": world}, max_time, fuse)
    swept(recipe, axes, kept, jobs or cores(), retry, on=on)
    return summarise(kept)


def fidelity(
    product: Stage,
    *,
    seeds: int = 5,
    units: int | None = None,
    jitter: float = 0.3,
    jobs: int | None = None,
    max_time: float | None = None,
    settings: Settings | None = None,
) -> Fidelity:
    """How close MuJoCo is to the ideal world, from runs in both over so many `seeds`, each of so
    many `units`, None for as many as show the cycle time. `jobs`: processes, one per core by
    default. The others are those of `run`. Raises InputError, RunError."""
    from factory.apps.fidelity import measure
    from factory.apps.sweep.pool import cores
    from factory.support.bounds import check_values
    from factory.theory.nets.verify import proved

    check_values({"units": units, "jitter": jitter, "max_time": max_time, "jobs": jobs})
    project = project_of(product, settings)
    proved(project.layout.factory.net)
    return measure(
        project.layout,
        range(seeds),
        units,
        jitter,
        project.settings,
        jobs or cores(),
        max_time=max_time,
    )


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
    from factory.pipeline import read
    from factory.support.bounds import AIMS, LENGTHS, UPS, check_choice, check_values
    from factory.support.errors import InputError
    from factory.theory.lang.overlaps import overlaps_in
    from factory.theory.lang.template_reader import all_templates

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
