"""The options that several commands share, and what they mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import wraps
from inspect import signature
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from factory.apps.runs.options import RunOptions
from factory.commands.paths import OUT as OUT
from factory.commands.paths import PATH as PATH
from factory.commands.paths import pag_files as pag_files
from factory.commands.requests import OutputOptions, PictureOptions, ProjectOptions
from factory.support.bounds import BOUNDS, TIMES
from factory.support.errors import FactoryError
from factory.support.settings import LEAST, MOST_BRANCHES

if TYPE_CHECKING:
    from factory.theory.problem.pag import PAG

F = TypeVar("F", bound=Callable[..., Any])


def cameras(ctx: click.Context, param: click.Parameter, begun: str) -> list[str]:
    """Completions of --camera in a shell: those of FILE, if that can be read."""
    from factory.film.picture import camera_names

    # Of a line that is not complete click keeps the arguments apart, and sets no parameter.
    files = [ctx.params.get("file"), *map(Path, ctx.args)]
    names = camera_names(_pag(next(filter(None, files), None), ctx.params["folders"]))
    return [name for name in names if name.startswith(begun)]


def panels(ctx: click.Context, param: click.Parameter, begun: str) -> list[str]:
    """Completions of --with in a shell."""
    return [words for words in ("net", "gantt", "net,gantt") if words.startswith(begun)]


def _pag(file: Path | None, folders: Sequence[Path]) -> PAG | None:
    """The PAG in a file or a log; None where it cannot be read."""
    from factory.apps.log import is_log, read_log
    from factory.apps.log.plan_file import read_plan
    from factory.apps.log.project_table import factory_of, project_of
    from factory.pipeline import all_templates
    from factory.support.files import is_plan
    from factory.theory.lang import load_pag

    try:
        if file is None:
            return None
        if is_log(file):
            return factory_of(read_log(file).header).pag
        if is_plan(file):
            return project_of(read_plan(file).table, file.parent).pag
        return load_pag(file, all_templates(folders))
    except FactoryError:
        return None


def options(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    """Several decorators as one."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def gathered(kind: type, name: str) -> Callable[[F], F]:
    """A decorator that passes the options that are fields of a dataclass, but for those that a
    command takes itself, to the command as one value, by this name."""

    def decorate(command: F) -> F:
        taken = signature(command).parameters
        names = [field.name for field in fields(kind) if field.name not in taken]

        @wraps(command)
        def call(**values: Any) -> Any:
            gathered_values = {key: values.pop(key) for key in names if key in values}
            return command(**values, **{name: kind(**gathered_values)})

        return cast("F", call)

    return decorate


OUTPUT = options(
    click.option("--json", "as_json", is_flag=True, help="Print one JSON document to stdout."),
    click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings."),
    click.option("-v", "--verbose", is_flag=True, help="Print more detail."),
    gathered(OutputOptions, "out"),
)
PROJECT = gathered(ProjectOptions, "options")
TEMPLATES = click.option(
    "--templates",
    "folders",
    multiple=True,
    type=PATH,
    help="Folder of additional operation templates, searched first (repeatable).",
)
SOURCE = options(click.argument("file", type=PATH, shell_complete=pag_files), TEMPLATES, PROJECT)


class Number(click.FloatRange):
    """A finite number; click's own ranges let nan pass."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        number = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


def bounded(name: str) -> click.ParamType[Any]:
    """The type of an option whose bounds are in BOUNDS."""
    low, high = BOUNDS[name]
    whole = isinstance(low, int)
    return click.IntRange(int(low), int(high)) if whole else Number(low, high, name in TIMES)


SECONDS = bounded("seconds")
SEEDS = bounded("seed")
UNITS = bounded("units")


class Timestep(click.ParamType[float | str]):
    """A number, or AUTO."""

    name = "number|auto"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        from factory.support.settings import is_auto

        return value if is_auto("timestep", value) else click.FLOAT.convert(value, param, ctx)


class Branch(click.ParamType[tuple[str, int]]):
    """A label and the number of its parallel branches: `sub2=3`."""

    name = "label=number"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, tuple):
            return value
        label, equals, number = value.rpartition("=")
        if not equals or not label.strip():
            self.fail(f"'{value}' is not a label with a number, such as sub2=3.", param, ctx)
        return label.strip(), click.IntRange(1, MOST_BRANCHES).convert(number, param, ctx)


class RobotCount(click.ParamType[int | str]):
    """A number of robots, or `least`."""

    name = "number|least"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        return value if value == LEAST else bounded("robots").convert(value, param, ctx)


MOTION = options(
    click.option("--speed", type=float, help="Robot speed [m/s]."),
    click.option("--acceleration", type=float, help="Robot acceleration [m/s²]."),
    click.option(
        "--force", type=float, help="Actuator force limit, as a multiple of the force needed."
    ),
    click.option(
        "--timestep",
        type=Timestep(),
        help="Timestep of the physics engine [s]; auto (default): the longest that drives allow.",
    ),
    click.option(
        "--substeps",
        type=click.IntRange(1),
        help="Timesteps per supervisor tick (default: as many as fit into 10 ms).",
    ),
    click.option(
        "--overlap",
        type=float,
        help="Largest overlap of two parts whose collisions are checked [m] (default: 0.0005).",
    ),
    click.option(
        "--stage/--no-stage",
        default=None,
        help="Move idle robots ahead to where they are needed next.",
    ),
)
FLOOR = options(
    click.option("--clearance", type=float, help="Minimum distance between moving bodies [m]."),
    click.option("--floor", help="Available floor, width x depth [m], for example 4x3."),
    click.option("--platen", is_flag=True, help="Let guidepaths bend, over a floor of tiles."),
    click.option("--tile", type=bounded("tile"), help="Size of a platen's tiles [m]."),
)
RELAY = options(
    click.option(
        "--relay",
        is_flag=True,
        help="Divide the guidepaths that limit the cycle time among several robots.",
    ),
    click.option(
        "--cycle",
        type=SECONDS,
        help="Target cycle time [s], met with few robots, and with relays where needed.",
    ),
    click.option(
        "--robots",
        type=RobotCount(),
        help="Maximum number of robots, tools included; `least`: the fewest that are found.",
    ),
    click.option(
        "--parallel",
        type=Branch(),
        multiple=True,
        help="Number of branches that make a label in turn, for example sub2=3 (repeatable).",
    ),
    click.option(
        "--arm",
        metavar="NAME",
        help="Let an arm place the parts: six, scara or an MJCF file; six=2 for two arms.",
    ),
    click.option("--order", metavar="PRODUCT,...", help="Sequence of a mix: truck,truck,van."),
    click.option(
        "--effort",
        type=bounded("effort"),
        help="Number of factories to lay out in the search for few robots (default: 8 to 100).",
    ),
    click.option(
        "--seconds",
        "limit",
        type=SECONDS,
        help="Time limit of the search for few robots [s]; a message says if it was reached"
        " (default: 100 for more than 1,000 labels, unless --effort is given; else none).",
    ),
)
WIP = click.option(
    "--wip",
    type=bounded("wip"),
    help="Work in progress: most copies of each part inside.",
)
RUNS = gathered(RunOptions, "asked")
JOBS = click.option(
    "--jobs", type=bounded("jobs"), help="Number of processes (default: one per core)."
)
ON = click.option(
    "--on",
    metavar="ADDRESS",
    help="Run on the workers of a Dask scheduler, for example tcp://10.0.0.1:8786.",
)
LIBRARY = click.option(
    "--library", type=PATH, envvar="LDRAWDIR", help="Folder of an LDraw parts library."
)
LENIENT = click.option(
    "--lenient",
    is_flag=True,
    help="Accept a run that makes its units, whatever the verdict on its bodies.",
)
STRICT = click.option("--strict", is_flag=True, help="Fail a run that 'succeeded, but ...'.")
DRAW = options(
    click.option("--seed", type=SEEDS, default=0, help="Random seed of --jitter."),
    click.option(
        "--jitter",
        type=bounded("jitter"),
        default=0.0,
        help="Draw each robot's speed and gain at random within ± this fraction.",
    ),
)
RUN = options(
    click.option(
        "--world",
        type=click.Choice(["mujoco", "ideal"]),
        default="mujoco",
        help="MuJoCo's physics, or the paper's ideal world.",
    ),
    click.option("--units", type=UNITS, default=1, help="Number of products to make."),
    DRAW,
    WIP,
    click.option(
        "--from", "start", help="Start from a legal marking: place names, comma-separated."
    ),
    click.option(
        "--fuse/--no-fuse",
        default=None,
        help="Merge parts joined for good into one rigid body (default: in large factories).",
    ),
    click.option("--max-time", type=SECONDS, help="Stop after this simulated time [s]."),
    RUNS,
)
FAULTS = options(
    click.option("--faults", type=PATH, help="What goes wrong: faults and disturbances (.toml)."),
    click.option("--spares", type=bounded("spares"), default=0, help="Number of spare robots."),
    click.option("--swap", type=SECONDS, help="Time to replace a dead robot [s]."),
)
PICTURE = options(
    click.option("--size", default="1280x720", help="Picture size, for example 1280x720."),
    click.option("--fps", type=bounded("fps"), default=30, help="Frames per second."),
    click.option(
        "--camera",
        default="tour",
        metavar="CAMERA",
        shell_complete=cameras,
        help="tour (of a film: the overview, cut to two hand-overs and the product), overview,"
        " orbit, top, product, part:LABEL to follow a part, or handover:LABEL for a close-up of its"
        " hand-over.",
    ),
    click.option(
        "--with",
        "panels",
        shell_complete=panels,
        help="Panels beside the 3-D view: net, gantt (modes over time) or net,gantt.",
    ),
    click.option("--title", default="", help="Title at the start of a film."),
    click.option("--poster", type=OUT, help="Write a still of a film's best moment (.png)."),
    click.option(
        "--renderer",
        type=click.Choice(["auto", "classic", "filament"]),
        default="auto",
        help="classic, or filament: physically based, needs Vulkan; auto: that for stills where it"
        " works.",
    ),
    gathered(PictureOptions, "shown"),
)


def address(port: int) -> Callable[[F], F]:
    """Where a server listens; `port`: the default."""
    ports, here = click.IntRange(0, 65535), "127.0.0.1"
    free = "Port to listen on; 0: any free port."
    local = "Address to listen on; local connections only by default."
    return options(
        click.option("--port", type=ports, default=port, help=free),
        click.option("--host", default=here, help=local),
        click.option("--expose", is_flag=True, help="Allow a HOST that other machines can reach."),
    )


OF_A_PICTURE = tuple(field.name for field in fields(PictureOptions))
"""The parameters of PICTURE."""
