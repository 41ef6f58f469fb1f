"""The options that several commands share, and what they mean."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from factory.support.errors import Diagnostic, InputError

if TYPE_CHECKING:
    from factory.layout.request import Ground

F = TypeVar("F", bound=Callable[..., Any])


PATH = click.Path(path_type=Path, readable=False)
"""A path as it is given; what is wrong with it the stage that opens it says, as a diagnostic."""


class PagPath(click.Path):
    """A path whose completions in the shell are PAG files, and folders beside them; where there are
    no PAG files, whatever the shell completes paths to."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        folder, begun = os.path.split(incomplete)
        try:
            names = sorted(n for n in os.listdir(folder or ".") if n.startswith(begun))
        except OSError:
            names = []
        shown = [os.path.join(folder, n) for n in names if begun or not n.startswith(".")]
        found = [name for name in shown if name.endswith(".pag")]
        if not found:
            return super().shell_complete(ctx, param, incomplete)
        folders = [f"{name}/" for name in shown if os.path.isdir(name)]
        return [CompletionItem(name) for name in (*found, *folders)]


PAG_PATH = PagPath(path_type=Path, readable=False)


def options(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


OUTPUT = options(
    click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout."),
    click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings."),
    click.option("-v", "--verbose", is_flag=True, help="Say more."),
)
SOURCE = options(
    click.argument("file", type=PAG_PATH),
    click.option(
        "--templates",
        "folders",
        multiple=True,
        type=PATH,
        help="A folder of further operations, searched first (repeatable).",
    ),
)


class Number(click.FloatRange):
    """A finite number; click's own ranges let nan pass."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        number = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class Timestep(click.ParamType[float | str]):
    """A number, or AUTO."""

    name = "number|auto"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        from factory.support.settings import is_auto

        return value if is_auto("timestep", value) else click.FLOAT.convert(value, param, ctx)


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
        "--stage/--no-stage",
        default=None,
        help="Robots that wait empty-handed go ahead to where they are needed next.",
    ),
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
        type=Number(0, min_open=True),
        help="The cycle time that relays are to reach [s]; as short as they can by default.",
    ),
)
WIP = click.option(
    "--wip", type=click.IntRange(1, 10**9), help="Copies of each part let in at once."
)
DRAW = options(
    click.option("--seed", type=click.IntRange(0), default=0, help="Of what jitter draws."),
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
    click.option(
        "--max-time", type=Number(0, min_open=True), help="Stop after this simulated time [s]."
    ),
)
PICTURE = options(
    click.option("--size", default="1280x720", help="Of the picture, as 1280x720."),
    click.option("--fps", type=click.IntRange(1, 120), default=30, help="Pictures a second."),
    click.option(
        "--camera",
        default="overview",
        help="overview, orbit, top, product, or part:LABEL to follow a part.",
    ),
    click.option(
        "--with", "panels", help="Beside the 3-D: net, gantt or net,gantt (modes over time)."
    ),
    click.option("--title", default="", help="Shown at the beginning of a film."),
    click.option("--poster", type=PATH, help="A still of a film's best moment (.png)."),
)
OF_A_PICTURE = ("size", "fps", "camera", "panels", "title", "poster")
"""The parameters of PICTURE."""


def settings_of(file: Path, options: dict[str, Any]) -> Any:
    """Options before the environment, that before the `factory.toml` beside the PAG or in the
    current folder."""
    from factory.support.settings import environment
    from factory.support.user_defaults import defaults_for

    names = ("speed", "acceleration", "force", "timestep", "substeps", "clearance")
    given = {name: options.get(name) for name in names}
    if (stage := options.get("stage")) is not None:
        given["stage"] = int(stage)
    settings = defaults_for(file).settings().with_options(environment())
    return settings.with_options(given)


def for_a_pag(file: Path, kind: str, *but: str) -> None:
    """Options of a command that mean nothing for a FILE that is no PAG but, say, a log: all that
    are given `but` these, and those of OUTPUT. Raises InputError (Usage) with every one; what a
    user has set beforehand is not meant for this file alone."""
    context = click.get_current_context()
    given = [
        max(option.opts, key=len)
        for option in context.command.params
        if option.name is not None
        and option.name not in (*but, "file", "as_json", "quiet", "verbose")
        and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
    ]
    if given:
        messages = [f"{option} is for a PAG; '{file}' is {kind}" for option in given]
        raise InputError(Diagnostic("Usage", told, None, "leave it out") for told in messages)


def pair(text: str | None, option: str, example: str, number: type) -> tuple[Any, Any] | None:
    """`4x3` as two positive numbers."""
    if text is None:
        return None
    try:
        width, depth = (number(word) for word in text.lower().split("x"))
        if "_" in text or not (0 < width < float("inf") and 0 < depth < float("inf")):
            raise ValueError
    except ValueError:
        message = f"{option} takes two positive numbers, not '{text}'"
        raise InputError(
            Diagnostic("BadValue", message, None, f"for example {option} {example}")
        ) from None
    return width, depth


def plan(
    file: Path,
    folders: Sequence[Path],
    settings: Any,
    floor: str | None,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> tuple[Any, Any, Any]:
    """PAG to layout; warnings on stderr. Gives source, factory and layout. `options`: those of
    RELAY, where a command has them."""
    from factory.pipeline import read

    source = read(file, folders)
    factory, product = source.compile(), source.product
    layout = ground(floor, options).lay_out(factory, product, settings)
    return source, layout.factory, layout


def ground(floor: str | None, options: Mapping[str, Any]) -> Ground:
    """What FLOOR and RELAY ask for. Raises InputError (Usage)."""
    from factory.layout.request import Ground

    room = pair(floor, "--floor", "4x3", float)
    return Ground(room, bool(options.get("relay")), options.get("cycle"))


def writable(file: Path | None, *outputs: Path | None) -> None:
    """Output files must be such that they can be written: their folder there and writable,
    themselves no folder, all different, and none the input. Raises InputError (BadFile) with every
    fault."""
    taken = {} if file is None else {os.path.realpath(file): "the input"}
    faults = []
    for path in outputs:
        if path is None:
            continue
        trouble = _unwritable(path)
        place = os.path.realpath(path)
        if trouble is None and place in taken:
            trouble = f"'{path}' is {taken[place]}", "give another name"
        if trouble is not None:
            faults.append(Diagnostic("BadFile", trouble[0], None, trouble[1]))
        elif path.exists() and not path.is_file():
            continue
        taken[place] = "given twice"
    if faults:
        raise InputError(faults)


def _unwritable(path: Path) -> tuple[str, str] | None:
    """What is wrong with an output file, and what would mend it."""
    folder = path.parent
    if path.is_dir():
        return f"'{path}' is a folder", "give the name of a file"
    if not folder.exists():
        return f"the folder '{folder}' does not exist", f"mkdir -p {folder}"
    if not folder.is_dir():
        return f"'{folder}' is not a folder", "choose another place"
    if not os.access(path if path.exists() else folder, os.W_OK):
        return f"'{path}' may not be written", "choose another place, or change its permissions"
    return None


def writable_folder(path: Path | None) -> None:
    """A folder to be written into, or made. Raises InputError (BadFile)."""
    if path is None:
        return
    there = next(f for f in (path, *path.absolute().parents) if f.exists())
    if not there.is_dir():
        message, hint = f"'{there}' is a file, not a folder", "-o takes the name of a folder"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if not os.access(there, os.W_OK | os.X_OK):
        message, hint = f"'{there}' may not be written", "choose another place"
        raise InputError(Diagnostic("BadFile", message, None, hint))
