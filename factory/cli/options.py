"""The options that several commands share, and what they mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from factory.errors import Diagnostic, InputError

F = TypeVar("F", bound=Callable[..., Any])


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
    click.argument("file", type=click.Path(path_type=Path)),
    click.option(
        "--templates",
        "folders",
        multiple=True,
        type=click.Path(path_type=Path),
        help="A folder of further operations, searched first (repeatable).",
    ),
)
MOTION = options(
    click.option("--speed", type=float, help="Speed of a robot [m/s]."),
    click.option("--acceleration", type=float, help="Acceleration of a robot [m/s²]."),
    click.option("--force", type=float, help="Actuator limit, as a multiple of what is needed."),
    click.option("--timestep", type=float, help="The engine's timestep [s]."),
    click.option("--substeps", type=click.IntRange(1), help="Timesteps in a supervisor's tick."),
)
FLOOR = options(
    click.option("--clearance", type=float, help="Least distance between things [m]."),
    click.option("--floor", help="Width x depth of the floor there is [m], as 4x3."),
)
RUN = options(
    click.option("--world", type=click.Choice(["mujoco", "ideal"]), default="mujoco"),
    click.option("--units", type=click.IntRange(1), default=1, help="Products to make."),
    click.option("--seed", type=click.IntRange(0), default=0),
    click.option(
        "--jitter",
        type=click.FloatRange(0, 0.9),
        default=0.0,
        help="Draw each robot's speed and gain within ± this share.",
    ),
    click.option("--wip", type=click.IntRange(1), help="Copies of each part let in at once."),
    click.option(
        "--from", "start", help="Start from a legal marking: place names, comma-separated."
    ),
    click.option("--max-time", type=float, help="Stop after this simulated time [s]."),
)
PICTURE = options(
    click.option("--size", default="1280x720", help="Of the picture, as 1280x720."),
    click.option("--fps", type=click.IntRange(1, 120), default=30),
    click.option("--camera", default="overview", help="overview, top or product."),
)


def settings_of(file: Path, options: dict[str, Any]) -> Any:
    """Options before the `factory.toml` beside the PAG or in the current folder."""
    from factory.settings import load_settings

    names = ("speed", "acceleration", "force", "timestep", "substeps", "clearance")
    beside = file.parent / "factory.toml"
    settings = load_settings(beside if beside.is_file() else Path("factory.toml"))
    return settings.withoptions({name: options.get(name) for name in names})


def pair(text: str | None, option: str, example: str, number: type) -> tuple[Any, Any] | None:
    """`4x3` as two positive numbers."""
    if text is None:
        return None
    try:
        width, depth = (number(word) for word in text.lower().split("x"))
        if not (0 < width < float("inf") and 0 < depth < float("inf")):
            raise ValueError
    except ValueError:
        message = f"{option} takes two positive numbers, not '{text}'"
        raise InputError(
            Diagnostic("BadValue", message, None, f"for example {option} {example}")
        ) from None
    return width, depth


def plan(
    file: Path, folders: Sequence[Path], settings: Any, floor: str | None
) -> tuple[Any, Any, Any]:
    """PAG to layout; warnings on stderr. Gives source, factory and layout."""
    from factory.geometry import product_geometry
    from factory.layout.embedding import lay_out
    from factory.pipeline import read

    source = read(file, folders)
    factory = source.compile()
    product = product_geometry(source.pag)
    room = pair(floor, "--floor", "4x3", float)
    return source, factory, lay_out(factory, product, settings.clearance, room)


def writable(path: Path | None) -> None:
    """An output file must be writable: its folder there, itself no folder."""
    if path is None:
        return
    if path.is_dir():
        raise InputError(
            Diagnostic("File", f"'{path}' is a folder", None, "give the name of a file")
        )
    if not path.parent.is_dir():
        message = f"the folder '{path.parent}' does not exist"
        raise InputError(Diagnostic("File", message, None, f"mkdir -p {path.parent}"))
