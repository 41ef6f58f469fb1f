"""The public functions that show a factory, and let an agent act in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from factory.stages import AnyPath, Stage, maybe, named, path_of, project_of
from factory.support.guard import guarding, will_write
from factory.support.settings import Settings

if TYPE_CHECKING:
    import gymnasium

    from factory.apps.report.page import RunReport
    from factory.apps.runs.executing import Tell
    from factory.apps.runs.pictures import Rendered
    from factory.film.picture import PanelName, RendererName


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
    from factory.engine.simulation.run import Run
    from factory.support.bounds import check_values
    from factory.support.files import write_text

    check_values({"units": units})
    asked = RunOptions("mujoco", 1, seed, jitter, wip, max_time=max_time)
    will_write(maybe(output))
    log = _logged(product)
    source = log or project_of(product, settings)
    if not isinstance(source, Path):
        asked = replace(asked, units=units or Run.steady_from(source.plain.period))
    made = report_on(source, asked, progress=progress)
    if output is not None:
        write_text(path_of(output), made.text)
    return made


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
    from factory.apps.runs.options import RunOptions
    from factory.engine.simulation.simulation import Simulation
    from factory.support.errors import usage_error
    from factory.support.version import optional

    gym = optional("gymnasium", "gymnasium", "an environment", "gym")
    from factory.apps.environment.plant import FactoryEnv

    if worlds is not None and worlds < 1:
        raise usage_error(f"{worlds} worlds", "give 1 or more, or None")
    project, asked = project_of(product, settings), RunOptions(units=units, jitter=jitter)
    first = Simulation(project.layout, asked.request(project, shown=render_mode is not None))

    def made() -> gymnasium.Env[Any, Any]:
        return FactoryEnv(first, interval, max_time, render_mode)

    return made() if worlds is None else gym.vector.SyncVectorEnv([made] * worlds)
