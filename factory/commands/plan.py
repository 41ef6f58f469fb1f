"""The command `plan`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import OUTPUT, PATH, SECONDS, Number
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say
from factory.support.progress import StepBar, Waiting

if TYPE_CHECKING:
    from factory.planning.parts import InPlace
    from factory.planning.writing import PlannedProduct

UNITS = ("m", "cm", "mm", "in", "ldu")
"""The names of units of length; `ldu` is that of LDraw, 0.4 mm."""

AIMS = ("cycle", "robots", "floor")


@click.command()
@click.argument("source", type=PATH)
@click.option("-o", "--output", type=PATH, help="The folder to write; named after SOURCE without.")
@click.option(
    "--for",
    "aim",
    type=click.Choice(AIMS),
    default="cycle",
    help="What the tree is chosen for: a short cycle, few robots, a small floor.",
)
@click.option("--seconds", type=SECONDS, default=60.0, help="To look for a better tree [s].")
@click.option("--keep", multiple=True, help="A sub-tree of a PAG that stays (repeatable).")
@click.option("--replan", is_flag=True, help="Throw the tree of a PAG away.")
@click.option(
    "--allow",
    multiple=True,
    help="A part that may pass through others, where there is no other way (repeatable).",
)
@click.option(
    "--tolerance", type=Number(0), help="How deep parts may overlap on their way [m]; that of check."
)
@click.option("--unit", type=click.Choice(UNITS), help="Of lengths; found out without.")
@click.option("--library", type=PATH, envvar="LDRAWDIR", help="An LDraw parts library.")
@click.option("--boxes", is_flag=True, help="LDraw parts whose shape is missing become boxes.")
@click.option("--look/--no-look", default=True, help="Write an exploded view, and its film.")
@click.option(
    "--templates",
    "folders",
    multiple=True,
    type=PATH,
    help="A folder of further operations, searched first (repeatable).",
)
@OUTPUT
def plan(
    out: OutputOptions,
    source: Path,
    output: Path | None,
    aim: str,
    seconds: float,
    keep: tuple[str, ...],
    replan: bool,
    allow: tuple[str, ...],
    tolerance: float | None,
    unit: str | None,
    library: Path | None,
    boxes: bool,
    look: bool,
    folders: tuple[Path, ...],
) -> int:
    """Find an assembly tree for the parts of SOURCE, which are where they are in the finished
    product, and write it as a PAG with its meshes. SOURCE is a folder of meshes, a file with named
    bodies (.glb, .3mf, .step), an LDraw model (.ldr, .mpd), or a PAG whose tree is thrown away."""
    from factory.pipeline import all_templates
    from factory.planning.source.reading import SourceOptions, read_source
    from factory.planning.stacking import stacked
    from factory.planning.writing import planned_product
    from factory.support.files import own_names, write_all

    templates = all_templates(folders)
    writable_folder(output)
    with Waiting(f"reading {source.name}", out.silent):
        found = read_source(source, templates, SourceOptions(unit, keep, replan, library, boxes))
    folder = output or Path(found.name)
    writable_folder(folder)
    warnings = announced(found.warnings, out)
    if not out.silent:
        for note in found.notes:
            say(f"  {note}")
    with StepBar("looking for a tree", out.silent, seconds):
        tree = stacked(found)
    made = planned_product(found, tree, None, source.name)
    files = {folder / name: content for name, content in made.files.items()}
    own_names(folder, files, [source])
    write_all(files)
    pictures = _pictures(next(iter(files)), out) if look else {}
    if out.as_json:
        emit(_document(found, made, [*files, *pictures], warnings))
    elif not out.quiet:
        _tell(made, [*files, *pictures], out)
    return 0
