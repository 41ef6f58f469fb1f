"""The command `new`: a small product to start from."""

from __future__ import annotations

import re
from pathlib import Path

import click

from factory.commands.options import OUT, OUTPUT
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.errors import Diagnostic, InputError

TEXTS = {"{name}.pag": "product.pag", "factory.toml": "factory.toml", "README.md": "README.md"}
"""Files of the new folder, and the texts in `factory/starter` that they are made of."""

LABELS = ("bell", "neck", "grip", "knob", "top", "stem")
"""Labels of the parts of the product."""

BELL = "0 50, 17 50, 22 30, 36 0, 40 0, 40 4, 26 30, 22 52, 16 60, 0 60"
GRIP = "0 0, 9 0, 12 15, 13 32, 10 52, 7 60, 0 60"
"""Radius and height along the outlines of turned parts [mm]."""


@click.command()
@click.argument("name", type=OUT)
@OUTPUT
def new(name: Path, out: OutputOptions) -> int:
    """Write a small example product to a new folder NAME."""
    from factory.support.files import write_all

    files = {name / path: content for path, content in starter(name.name).items()}
    if name.is_symlink() or (name.exists() and (name.is_file() or any(name.iterdir()))):
        message, hint = f"'{name}' is there already", "choose another name"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    writable_folder(name)
    write_all(files)
    if out.as_json:
        emit({"folder": str(name), "files": [str(path) for path in files]})
    else:
        say(f"{name}: {len(files)} files")
        for path in files if out.verbose else ():
            say(f"  {path}")
        say(f"  cd {name}")
        say(f"  factory run {name.name}.pag --units 3")
    return 0


def starter(name: str) -> dict[str, bytes]:
    """The files of a product called `name`, by their paths. Raises InputError (BadValue) for an
    invalid name."""
    from factory.theory.problem.pag import RESERVED

    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_\-]{0,60}", name) or name in (*RESERVED, *LABELS):
        message = f"'{name}' cannot be the name of a product"
        hint = "letters, digits, '_' and '-'; not the name of one of its parts"
        raise InputError(Diagnostic("BadValue", message, None, hint))
    folder = Path(__file__).resolve().parent / "starter"
    files = {
        path.replace("{name}", name): (folder / text).read_text("utf-8").replace("{name}", name)
        for path, text in TEXTS.items()
    }
    meshes = {"meshes/bell.stl": turned(BELL), "meshes/grip.stl": turned(GRIP)}
    return {path: text.encode() for path, text in files.items()} | meshes


def turned(outline: str) -> bytes:
    """Binary STL of the solid of revolution of an outline, in millimetres."""
    import numpy as np
    import trimesh

    points = np.array([point.split() for point in outline.split(",")], float)
    body = trimesh.creation.revolve(points, sections=32)
    return bytes(body.export(file_type="stl"))
