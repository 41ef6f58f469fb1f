"""The command `import`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from factory.api import Diagnostic, InputError
from factory.commands.options import LIBRARY, OUT, OUTPUT, PATH, TEMPLATES
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say
from factory.support.errors import usage_error
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.api import Template

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}


@click.command("import")
@click.argument("source", type=PATH)
@click.option("-o", "--output", type=OUT, help="Output folder (default: named after SOURCE).")
@LIBRARY
@click.option("--boxes", is_flag=True, help="Use boxes for parts without a shape.")
@click.option("--meshes", type=PATH, help="Folder of the meshes of a tree or a bill.")
@click.option(
    "--unit",
    type=click.Choice(list(UNITS)),
    default="m",
    help="Unit of a tree, a bill, their meshes.",
)
@click.option(
    "--mates",
    type=click.Choice(["many", "chain"]),
    default="many",
    help="Mate all inputs in one operation, or two at a time.",
)
@click.option(
    "--columns",
    "columns",
    multiple=True,
    metavar="NAME=TITLE",
    help="Title of a bill's column, as in name=Bezeichnung (repeatable).",
)
@TEMPLATES
@OUTPUT
def import_(
    out: OutputOptions,
    source: Path,
    output: Path | None,
    library: Path | None,
    boxes: bool,
    meshes: Path | None,
    unit: str,
    mates: str,
    columns: tuple[str, ...],
    folders: tuple[Path, ...],
) -> int:
    """Convert a model, tree or bill of materials to a PAG.

    SOURCE is an LDraw model (.ldr, .mpd), a tree of meshes (.json, .yaml), a bill of materials with
    levels (.csv), or a folder with one of these.
    """
    from factory.api import all_templates
    from factory.apps.importing import Options, import_product
    from factory.apps.importing.draft import Mates
    from factory.support.files import own_names, write_all

    for folder, option in ((library, "--library"), (meshes, "--meshes")):
        _require_folder(folder, option)
    chosen = _chosen(columns)
    options = Options(library, boxes, meshes, UNITS[unit], cast("Mates", mates), chosen)
    templates = all_templates(folders)
    with Waiting(f"reading {source.name}", out.silent):
        product = import_product(source, templates, options)
    folder = output or Path(product.name)
    writable_folder(folder)
    files = {folder / name: content for name, content in product.files.items()}
    own_names(folder, files)
    write_all(files)
    pag, meshes_made = next(iter(files)), len(files) - 1
    with Waiting("checking the shapes", out.silent):
        shapes = _shape_warnings(pag, templates)
    warnings = announced((*product.warnings, *shapes), out)
    parts = sum(1 for _ in product.pag.parts())
    if out.as_json:
        emit(
            {
                "pag": str(pag),
                "product": product.pag.root,
                "labels": len(product.pag),
                "parts": parts,
                "meshes": meshes_made,
                "files": [str(path) for path in files],
                "unused": list(product.unused),
                "warnings": warnings,
            }
        )
    else:
        operations = len(product.pag) - parts
        say(f"{pag}: parts {parts}, operations {operations}, meshes {meshes_made}")
        for allowed in product.pag.allowed:
            say(f"the source has no fits: overlaps up to {1e3 * allowed.depth:g} mm are allowed")
        if product.unused:
            say(f"columns that are not used: {', '.join(product.unused)}")
        for path in files if out.verbose else ():
            say(f"  {path}")
    return 0


def _chosen(columns: Sequence[str]) -> dict[str, str]:
    """The titles of columns by their names. Raises InputError (Usage)."""
    from factory.apps.importing.bill_header import TITLES

    chosen = dict[str, str]()
    for said in columns:
        name, equals, title = (part.strip() for part in said.partition("="))
        if not equals or not title or name not in TITLES or name in chosen:
            message = f"--columns '{said}' does not say the title of a column, or not the only one"
            raise usage_error(message, f"name=TITLE, where the name is one of {', '.join(TITLES)}")
        chosen[name] = title
    return chosen


def _shape_warnings(pag: Path, templates: Mapping[str, Template]) -> tuple[Diagnostic, ...]:
    """The warnings that `build` will give about the shapes of a written PAG."""
    from factory.api import load_pag, product_geometry
    from factory.floor.geometry.overlapping import overlaps_of

    try:
        made = load_pag(pag, templates)
        product = product_geometry(made)
        return (*product.warnings, *overlaps_of(product).faults(made.allowed))
    except InputError as error:
        return error.diagnostics


def _require_folder(folder: Path | None, option: str) -> None:
    if folder is not None and not folder.is_dir():
        message = f"{option}: there is no folder '{folder}'"
        raise InputError(Diagnostic("BadFile", message, None, "give the name of a folder"))
