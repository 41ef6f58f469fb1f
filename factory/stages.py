"""The public functions that make a factory and run it.

Each takes a product at any stage (`Stage`): the path of a PAG or of a plan.json, a PAG, a factory
or a layout; what is made of it already is not made again.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from factory.support.errors import usage_error
from factory.support.guard import guarding, reading, will_write
from factory.support.settings import Settings

if TYPE_CHECKING:
    import networkx as nx

    from factory.apps.exports import Made
    from factory.apps.exports.build import Built
    from factory.apps.exports.subject import Source
    from factory.apps.runs.executing import Tell
    from factory.engine.simulation.run import Run
    from factory.floor.layout.layout import Layout
    from factory.pipeline import Project
    from factory.support.bounds import WorldName
    from factory.theory.nets.petri import Marking
    from factory.theory.nets.verdict import Verdict
    from factory.theory.plant.factory import Factory
    from factory.theory.problem.pag import PAG

AnyPath: TypeAlias = "str | PathLike[str]"
Stage: TypeAlias = "AnyPath | PAG | Factory | Layout | Project"
"""A product at any stage."""


def project_of(
    product: Stage, settings: Settings | None = None, templates: Sequence[AnyPath] = ()
) -> Project:
    """The project of a product at any stage. A plan that is laid out again is a warning of Python.
    Raises InputError, of code Usage for what is no product."""
    from factory.apps.log.plan_file import read_plan
    from factory.floor.layout.layout import Layout
    from factory.pipeline import Project, all_templates, read
    from factory.support.files import is_plan
    from factory.theory.plant.factory import Factory
    from factory.theory.problem.pag import PAG

    pag = product.factory.pag if isinstance(product, Layout) else getattr(product, "pag", product)
    if isinstance(pag, PAG):
        reading(*pag.files)
    if isinstance(product, Project):
        return product if settings is None else product.with_settings(settings)
    if isinstance(product, PAG):
        return Project(product, all_templates(templates), settings=settings or Settings())
    if isinstance(product, Factory | Layout):
        return Project.of_made(product, settings)
    file = path_of(product)
    if not is_plan(file):
        return read(file, templates, settings)
    plan = read_plan(file)
    return plan.project(
        settings or plan.settings, plan.ground, lambda d: warnings.warn(str(d), stacklevel=3)
    )


def path_of(path: object) -> Path:
    """A path. Raises InputError (Usage) for another value."""
    if isinstance(path, str | PathLike):
        return Path(path)
    message = f"{path!r:.60} is no path"
    raise usage_error(
        message, "a product is a path, or a PAG, a factory or a layout of this package"
    )


def named(product: object) -> Path | None:
    """The file of a product that is given by its path; None for any other."""
    return Path(product) if isinstance(product, str | PathLike) else None


def maybe(path: AnyPath | None) -> Path | None:
    """A path where one is given."""
    return None if path is None else path_of(path)


def load_pag(path: AnyPath, templates: Sequence[AnyPath] = ()) -> PAG:
    """The product assembly graph in a file.

    `templates`: folders with further operations, searched before the shipped ones. Raises
    InputError with every error of the file.
    """
    return project_of(path_of(path), templates=templates).pag


def compile(
    product: Stage,
    templates: Sequence[AnyPath] = (),
    robots: int | Literal["least"] | None = None,
    cycle: float | None = None,
    *,
    parallel: Mapping[str, int] | None = None,
    effort: int | None = None,
    seconds: float | None = None,
    settings: Settings | None = None,
) -> Factory:
    """The factory (R, ~, N) that makes a product (paper, section 5).

    With at most so many `robots`, or with few for a `cycle` time [s], it is searched for: by laying
    out at most so many factories (`effort`), within so many `seconds`. `parallel`: for each of
    some labels how often the branch that brings it is there. Raises InputError.
    """
    from factory.apps.few_robots.aim import Aim, usual_seconds
    from factory.apps.few_robots.search import allocated
    from factory.apps.few_robots.sharing import with_branches

    project, branches = project_of(product, settings, templates), tuple((parallel or {}).items())
    usual = usual_seconds(len(project.pag), effort)
    aim = Aim(robots, cycle, effort, usual if seconds is None else seconds, branches)
    if branches and not aim.asks:
        return with_branches(project, branches).plain
    return allocated(project, aim).plain


def verify(product: Stage) -> Verdict:
    """The proof that a factory's net is a gear net, live, safe, reversible and legally marked, or
    witnesses of what fails."""
    from factory.theory.nets.verify import verify as prove

    return prove(project_of(product).plain.net)


def to_networkx(product: Stage) -> nx.DiGraph:
    """The assembly tree of a PAG or of one in a file, or the net of a factory, as a digraph of
    networkx.

    Nodes of a tree are labels, with `kind` (`part` or `assembly`), `operation` and `source`. Nodes
    of a net are places p0, p1, ... and transitions t0, t1, ..., with `kind`, `name` and `source`;
    places also with `mode`, `label`, `size`, `tokens` and `robots`.

    >>> import factory, networkx
    >>> sorted(networkx.ancestors(factory.to_networkx("examples/paper.pag"), "sub2"))
    ['part1', 'part2', 'sub1']
    >>> net = factory.to_networkx(factory.compile("examples/paper.pag"))
    >>> [net.nodes[p]["name"] for p in net.predecessors("t0")]
    ['r1:nopart', 'r2:part3', 'r3:sub2']
    """
    from factory.apps.exports.graphs import to_networkx as graph_of
    from factory.theory.plant.factory import Factory
    from factory.theory.problem.pag import PAG

    if isinstance(product, PAG | Factory):
        return graph_of(product)
    project = project_of(product)
    return graph_of(project.factory if "layout" in project.__dict__ else project.pag)


def lay_out(
    product: Stage,
    clearance: float | None = None,
    floor: tuple[float, float] | str | None = None,
    relay: bool = False,
    cycle: float | None = None,
    *,
    tile: float | None = None,
    settings: Settings | None = None,
) -> Layout:
    """The stretched tree of guidepaths (paper, section 5.1), sized by the parts' real geometry.

    `clearance` and `floor` (width, depth) in [m]; a floor also as a command takes it, "4x3".
    `relay`: several robots share guidepaths that set the pace, to reach a `cycle` time [s] or the
    least there can be; the layout's factory has
    more robots then. `tile`: they go over a platen of tiles of this size [m], on guidepaths that
    may bend. With none of these the layout is that of the product's plan.json, or the layout
    itself. Raises InputError for a mesh that cannot be read, RunError where the factory does not
    fit the floor.
    """
    from factory.apps.runs.options import check_together
    from factory.floor.layout.request import WIDEST, Ground
    from factory.support.bounds import pair

    check_together({"--relay": relay, "--platen": tile is not None})
    project = project_of(product, settings)
    if clearance is not None:
        project = project.with_settings(replace(project.settings, clearance=clearance))
    if isinstance(floor, str):
        floor = pair(floor, "floor", "4x3", float, WIDEST)
    elif isinstance(floor, list):
        floor = tuple(floor)
    ground = Ground(floor, relay, cycle if relay else None, tile)
    if ground != Ground() or settings is not None:
        project = project.with_ground(ground if ground != Ground() else project.ground)
    return project.layout


@guarding
def run(
    product: Stage,
    world: WorldName = "mujoco",
    units: int = 1,
    seed: int = 0,
    jitter: float = 0.0,
    settings: Settings | None = None,
    max_time: float | None = None,
    *,
    wip: int | None = None,
    start: str | Marking | None = None,
    fuse: bool | None = None,
    distributed: bool = False,
    lenient: bool = False,
    strict: bool = False,
    faults: AnyPath | None = None,
    spares: int = 0,
    swap: float | None = None,
    demand: AnyPath | int | None = None,
    log: AnyPath | None = None,
    monitor: bool | None = None,
    progress: Tell | None = None,
) -> Run:
    """Run the net over a world until `units` products are dropped off.

    `seed` and `jitter` draw each robot's speed and gain within ± jitter; `max_time` [s] of
    simulated time; `wip`: most copies of each part inside; `start`: a legal marking, or the names
    of its places, separated by commas; `fuse`: whether parts joined for good become one body, None
    where that pays; `distributed`: robots run their own programs; `lenient`: what its bodies do
    does not count; `strict`: a run fails whose success is qualified; `faults`: a file of what goes
    wrong, `spares`: robots in reserve, `swap`: how long an exchange takes [s]; `demand`: a file of
    the orders for a mix, or a seed that draws them; `log`: a file for every tick; `monitor`: True
    for one that observes every tick, False for none, None for one that observes events; `progress`
    is told the simulated time [s] and the units made, after some ticks. Raises RunError for a run
    that stalls or takes longer, InputError for a wrong value and where the engine refuses a mesh.
    """
    from factory.apps.runs.options import RunOptions, check_ideal
    from factory.apps.runs.running import check_run, run_project
    from factory.engine.simulation.run import require

    asked = RunOptions(world, units, seed, jitter, wip, start, fuse, max_time, distributed, lenient)
    asked = replace(asked, faults=maybe(faults), spares=spares, swap=swap, strict=strict)
    asked = replace(asked, demand=None if demand is None else str(demand))
    if world == "ideal":
        check_ideal(fuse, bool(monitor))
    will_write(maybe(log))
    project = project_of(product, settings)
    check_run(project, asked)
    return require(run_project(project, asked, True, maybe(log), None, monitor, progress))


@guarding
def build(
    product: Stage,
    output: AnyPath | None = None,
    *,
    mjcf: AnyPath | None = None,
    units: int | None = None,
    wip: int | None = None,
    settings: Settings | None = None,
) -> Built:
    """The MJCF model of a factory, with parts for so many `units` (None: for ever) of which `wip`
    are inside at once; written at `mjcf`, and with the floor plan, the net, the programs and the
    proofs into the folder `output`, where these are given. Raises InputError, RunError.

    >>> import factory
    >>> built = factory.build("examples/paper.pag")
    >>> built.model.bodies, built.files
    (11, ())
    """
    from factory.apps.exports.build import BuildRequest
    from factory.apps.exports.build import build as build_files
    from factory.support.bounds import check_values
    from factory.theory.nets.verify import proved

    check_values({"units": units, "wip": wip})
    request = BuildRequest(maybe(mjcf), maybe(output), units, wip)
    will_write(request.mjcf)
    project = project_of(product, settings)
    request.claim(project.name)
    return build_files(project, proved(project.layout.factory.net), request)


@guarding
def export(
    product: Stage,
    form: str,
    output: AnyPath | None = None,
    of: str = "",
    *,
    settings: Settings | None = None,
    exporters: Sequence[AnyPath] = (),
) -> Made:
    """A factory, or the log or the net (PNML) in a file, in a format for other tools: a text, bytes
    or the contents of several files by name; written to `output` where that is given. `of`: what is
    exported where a format offers a choice. `factory export --help` lists the formats; `exporters`:
    folders with further ones. Raises InputError.

    >>> import factory
    >>> factory.export("examples/paper.pag", "dot").splitlines()[0]
    'digraph factory {'
    """
    from factory.apps.exports.writing import export as exported
    from factory.apps.exports.writing import exporter, read_source
    from factory.support.files import write_all

    chosen = exporter(form, of, [*map(path_of, exporters)])
    will_write(maybe(output))
    file = named(product)
    source: Source | None = None if file is None else read_source(file)
    if file is None or source is None:
        source = project = project_of(product, settings)
        file = project.file
    made, files = exported(chosen, file, source, maybe(output), of)
    write_all(files)
    return made
