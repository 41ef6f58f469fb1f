"""The options that several commands share, and what they mean."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import wraps
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click
from click.shell_completion import CompletionItem

from factory.commands.requests import OutputOptions, PictureOptions, ProjectOptions, RunOptions
from factory.support.errors import FactoryError
from factory.support.settings import LEAST, LONGEST, MOST_BRANCHES

if TYPE_CHECKING:
    from factory.problem.pag import PAG

F = TypeVar("F", bound=Callable[..., Any])


PATH = click.Path(path_type=Path, readable=False)
"""A path as it is given; the stage that opens it reports its faults, as diagnostics."""


class PagPath(click.Path):
    """A path whose completions in the shell are PAG files and plans, and folders beside them; where
    there are none of these files, whatever the shell completes paths to."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        folder, begun = os.path.split(incomplete)
        try:
            names = sorted(n for n in os.listdir(folder or ".") if n.startswith(begun))
        except OSError:
            names = []
        shown = [os.path.join(folder, n) for n in names if begun or not n.startswith(".")]
        found = [name for name in shown if name.endswith((".pag", "plan.json"))]
        if not found:
            return super().shell_complete(ctx, param, incomplete)
        folders = [f"{name}/" for name in shown if os.path.isdir(name)]
        return [CompletionItem(name) for name in (*found, *folders)]


PAG_PATH = PagPath(path_type=Path, readable=False)


class Suggested(click.ParamType[str]):
    """A text; its completions in the shell are some usual ones."""

    name = "text"

    def __init__(self, *words: str) -> None:
        self.words = words

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        return [CompletionItem(word) for word in self.words if word.startswith(incomplete)]


class CameraName(click.ParamType[str]):
    """The name of a camera; its completions in the shell are those that FILE has, as far as FILE is
    given before and can be read."""

    name = "camera"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from factory.render.camera import camera_names

        # Of a line that is not complete click keeps the arguments apart, and sets no parameter.
        files = [ctx.params.get("file"), *map(Path, ctx.args)]
        names = camera_names(_pag(next(filter(None, files), None), ctx.params["folders"]))
        return [CompletionItem(name) for name in names if name.startswith(incomplete)]


def _pag(file: Path | None, folders: Sequence[Path]) -> PAG | None:
    """The PAG in a file or a log; None where it cannot be read."""
    from factory.lang import load_pag
    from factory.pipeline import all_templates
    from factory.record.log import is_log, read_log
    from factory.record.plan_file import read_plan
    from factory.record.project_table import factory_of, project_of
    from factory.support.files import is_plan

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
    """Gives a command the options that are fields of a dataclass as one value, by this name."""
    names = [field.name for field in fields(kind)]

    def decorate(command: F) -> F:
        @wraps(command)
        def call(**given: Any) -> Any:
            own = {key: given.pop(key) for key in names if key in given}
            return command(**given, **{name: kind(**own)})

        return cast("F", call)

    return decorate


OUTPUT = options(
    click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout."),
    click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings."),
    click.option("-v", "--verbose", is_flag=True, help="Say more."),
    gathered(OutputOptions, "out"),
)
PROJECT = gathered(ProjectOptions, "given")
SOURCE = options(
    click.argument("file", type=PAG_PATH),
    click.option(
        "--templates",
        "folders",
        multiple=True,
        type=PATH,
        help="A folder of further operations, searched first (repeatable).",
    ),
    PROJECT,
)


class Number(click.FloatRange):
    """A finite number; click's own ranges let nan pass."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        number = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


SECONDS = Number(0, LONGEST, min_open=True)
SEEDS = click.IntRange(0, 2**63 - 1)


class Timestep(click.ParamType[float | str]):
    """A number, or AUTO."""

    name = "number|auto"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        from factory.support.settings import is_auto

        return value if is_auto("timestep", value) else click.FLOAT.convert(value, param, ctx)


class Branch(click.ParamType[tuple[str, int]]):
    """A label, and how often the branch that brings it is to be there: `sub2=3`."""

    name = "label=number"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, tuple):
            return value
        label, equals, number = value.rpartition("=")
        if not equals or not label.strip():
            self.fail(f"'{value}' is no label with a number, as sub2=3.", param, ctx)
        return label.strip(), click.IntRange(1, MOST_BRANCHES).convert(number, param, ctx)


class RobotCount(click.ParamType[int | str]):
    """A number of robots, or `least`."""

    name = "number|least"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        return value if value == LEAST else click.IntRange(1).convert(value, param, ctx)


HANDS = click.option(
    "--hands/--no-hands",
    default=None,
    help="Robots hold by solid hands that are chosen from the geometry of the parts.",
)
MOTION = options(
    click.option("--speed", type=float, help="Speed of a robot [m/s]."),
    click.option("--acceleration", type=float, help="Acceleration of a robot [m/s²]."),
    click.option("--force", type=float, help="Actuator limit, as a multiple of what is needed."),
    click.option(
        "--timestep",
        type=Timestep(),
        help="The engine's timestep [s]; auto, the default: as long as the drives allow.",
    ),
    click.option(
        "--substeps",
        type=click.IntRange(1),
        help="Timesteps in a supervisor's tick (of 10 ms by default).",
    ),
    click.option(
        "--overlap",
        type=float,
        help="Parts that overlap by no more are tested against each other [m]; 0.0005 by default.",
    ),
    click.option(
        "--stage/--no-stage",
        default=None,
        help="Robots that wait empty-handed go ahead to where they are needed next.",
    ),
    HANDS,
)
FLOOR = options(
    click.option("--clearance", type=float, help="Least distance between things [m]."),
    click.option("--floor", help="Width x depth of the floor there is [m], as 4x3."),
)
RELAY = options(
    click.option(
        "--relay", is_flag=True, help="Share guidepaths that set the pace among several robots."
    ),
    click.option(
        "--cycle",
        type=SECONDS,
        help="The cycle time to be reached [s], with few robots; with relays where it takes them.",
    ),
    click.option(
        "--robots",
        type=RobotCount(),
        help="At most so many robots, tools included, as fast as found; or as few as found: least.",
    ),
    click.option(
        "--parallel",
        type=Branch(),
        multiple=True,
        help="So many branches make and bring a label in turn, as sub2=3 (repeatable).",
    ),
    click.option(
        "--deputies", is_flag=True, help="Robots can take over for others, where there is room."
    ),
    click.option(
        "--effort",
        type=click.IntRange(1, 10**6),
        help="To look for few robots: so many factories are laid out; 8 to 100 by default.",
    ),
    click.option(
        "--seconds",
        "limit",
        type=SECONDS,
        help="No factory is laid out after so long [s]; it is said where that ends the search.",
    ),
)
WIP = click.option(
    "--wip", type=click.IntRange(1, 10**9), help="Copies of each part let in at once."
)
RUNS = gathered(RunOptions, "asked")
LENIENT = click.option(
    "--lenient", is_flag=True, help="A run succeeds whatever its bodies do, if it makes its units."
)
DRAW = options(
    click.option("--seed", type=SEEDS, default=0, help="Of what jitter draws."),
    click.option(
        "--jitter",
        type=Number(0, 0.9),
        default=0.0,
        help="Draw each robot's speed and gain within ± this share.",
    ),
)
RUN = options(
    click.option(
        "--world",
        type=click.Choice(["mujoco", "ideal"]),
        default="mujoco",
        help="MuJoCo's physics, or the paper's ideal world.",
    ),
    click.option("--units", type=click.IntRange(1, 10**9), default=1, help="Products to make."),
    DRAW,
    WIP,
    click.option(
        "--from", "start", help="Start from a legal marking: place names, comma-separated."
    ),
    click.option(
        "--fuse/--no-fuse",
        default=None,
        help="Parts joined for good become one rigid body; by itself for large factories.",
    ),
    click.option("--max-time", type=SECONDS, help="Stop after this simulated time [s]."),
    RUNS,
)
FAULTS = options(
    click.option("--faults", type=PATH, help="What goes wrong in the run (.toml)."),
    click.option("--spares", type=click.IntRange(0, 10**6), default=0, help="Robots in the depot."),
    click.option("--swap", type=SECONDS, help="To replace a dead robot takes so long [s]."),
)
PICTURE = options(
    click.option("--size", default="1280x720", help="Of the picture, as 1280x720."),
    click.option("--fps", type=click.IntRange(1, 120), default=30, help="Pictures a second."),
    click.option(
        "--camera",
        type=CameraName(),
        default="overview",
        help="overview, orbit, top, product, part:LABEL to follow a part, or handover:LABEL to look"
        " from near by where it is taken.",
    ),
    click.option(
        "--with",
        "panels",
        type=Suggested("net", "gantt", "net,gantt"),
        help="Beside the 3-D: net, gantt or net,gantt (modes over time).",
    ),
    click.option("--title", default="", help="Shown at the beginning of a film."),
    click.option("--poster", type=PATH, help="A still of a film's best moment (.png)."),
    gathered(PictureOptions, "shown"),
)
OF_A_PICTURE = tuple(field.name for field in fields(PictureOptions))
"""The parameters of PICTURE."""
