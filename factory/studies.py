"""The public functions that show a factory and study it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from factory.stages import AnyPath, Stage, maybe, named, path_of, project_of
from factory.support.guard import guarding, will_write
from factory.support.settings import Settings

if TYPE_CHECKING:
    import gymnasium

    from factory.apps.analyze import Analysis
    from factory.apps.fidelity.record import Fidelity
    from factory.apps.report.page import RunReport
    from factory.apps.runs.executing import Tell
    from factory.apps.runs.pictures import Rendered
    from factory.apps.sweep.summary import Summary
    from factory.engine.simulation.run import Run
    from factory.film.picture import PanelName, RendererName
    from factory.support.bounds import WorldName


def _logged(product: Stage) -> Path | None:
    """The path of the log of a run; None where a product is given."""
    from factory.apps.log import is_log

    path = named(product)
    return path if path is not None and is_log(path) else None


@guarding
def render(
    product: Stage,
    output: AnyPath,
    *,
    size: tuple[int, int] = (1280, 720),
    camera: str = "tour",
    panels: Sequence[PanelName] = (),
    title: str = "",
    fps: float = 30,
    at: float | Literal["end"] = "end",
    poster: AnyPath | None = None,
    renderer: RendererName = "auto",
    units: int = 1,
    seed: int = 0,
    jitter: float = 0.0,
    wip: int | None = None,
    max_time: float | None = None,
    settings: Settings | None = None,
    progress: Tell | None = None,
) -> Rendered:
    """Film a run (.mp4), or take a still of it (.png) at a time [s] or at its end; of a log, of the
    run that is in it.

    `size` (width, height) [px]; `camera`: tour, overview, orbit, top, product, part:LABEL or
    handover:LABEL; `panels` beside the 3-D: net, gantt; `poster`: a still of a film's best moment;
    `renderer`: classic, filament, or auto, which takes filament for stills where it works.
    The others are those of `run`. Raises InputError, MissingError without GL, RunError.
    """
    from factory.apps.log import read_log
    from factory.apps.runs.options import RunOptions
    from factory.apps.runs.pictures import render as taken
    from factory.film.picture import Picture
    from factory.film.shot import Shot

    asked = RunOptions("mujoco", units, seed, jitter, wip, max_time=max_time)
    picture = Picture(size, camera, panels=tuple(panels), title=title, renderer=renderer)
    shot = Shot(path_of(output), picture, fps, at, maybe(poster))
    will_write(shot.output, shot.poster)
    log = _logged(product)
    source = read_log(log) if log else project_of(product, settings)
    return taken(source, shot, asked, progress=progress)


@guarding
def report(
    product: Stage,
    output: AnyPath | None = None,
    *,
    units: int | None = None,
    seed: int = 0,
    jitter: float = 0.0,
    wip: int | None = None,
    max_time: float | None = None,
    settings: Settings | None = None,
    progress: Tell | None = None,
) -> RunReport:
    """The page about a run of a product, or about the run in a log; a notebook shows it. Written to
    `output` where that is given. `units`: None for as many as it takes to measure a cycle time. The
    others are those of `run`. Raises InputError, RunError."""
    from factory.apps.report.page import report_on
    from factory.apps.runs.options import RunOptions
    from factory.engine.simulation.run import steady_from
    from factory.support.bounds import check_values
    from factory.support.files import write_text

    check_values({"units": units})
    asked = RunOptions("mujoco", 1, seed, jitter, wip, max_time=max_time)
    will_write(maybe(output))
    log = _logged(product)
    source = log or project_of(product, settings)
    if not isinstance(source, Path):
        asked = replace(asked, units=units or steady_from(source.plain.period))
    made = report_on(source, asked, progress=progress)
    if output is not None:
        write_text(path_of(output), made.text)
    return made


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
) -> Summary:
    """Run a product for every combination of the varied values ({"seed": range(100)}), keep the
    results in a database (SQLite) and summarise them. Called again, it continues where it stopped.

    `jobs`: processes, one per core by default; `retry`: failed runs are repeated. The others are
    those of `run`. Raises InputError, RunError.
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
    swept(recipe, axes, kept, jobs or cores(), retry)
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
    runs = range(seeds), units, jitter, project.settings, jobs or cores(), None, max_time
    return measure(project.layout, *runs)


def env(
    product: Stage,
    *,
    units: int = 4,
    jitter: float = 0.0,
    interval: float = 0.1,
    max_time: float = 300.0,
    worlds: int | None = None,
    render_mode: Literal["rgb_array"] | None = None,
    settings: Settings | None = None,
) -> gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any]:
    """The factory of a product as a Gymnasium environment, in which an agent commands the plant
    with setpoints, grips and jobs; several `worlds` as a vector environment.

    An episode makes `units` products, each with a reward of 1, in steps of `interval` [s], within
    `max_time` [s]. `factory.apps.environment.plant.FactoryEnv` says what is seen and commanded;
    `factory.apps.environment.programs.Programs` is the baseline. Raises InputError, MissingError
    without the extra `gym`.

    >>> import factory
    >>> plant = factory.env("examples/paper.pag", units=1)
    >>> seen, info = plant.reset(seed=0)
    >>> seen["position"].shape, seen["legal"].shape
    ((6,), (6, 8))
    """
    from factory.engine.simulation.request import RunRequest
    from factory.engine.simulation.simulation import Simulation
    from factory.support.version import optional

    gym = optional("gymnasium", "gymnasium", "an environment", "gym")
    from factory.apps.environment.plant import FactoryEnv

    project, shown = project_of(product, settings), render_mode is not None
    request = RunRequest(
        units=units,
        jitter=jitter,
        settings=project.settings,
        catalogue=project.catalogue,
        shown=shown,
    )
    first = Simulation(project.layout, request)

    def made() -> gymnasium.Env[Any, Any]:
        return FactoryEnv(first, interval, max_time, render_mode)

    return made() if worlds is None else gym.vector.SyncVectorEnv([made] * worlds)
