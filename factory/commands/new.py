"""The command `new`: a small product to start from."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from factory.problem.pag import RESERVED
from factory.support.errors import Diagnostic, InputError

TEXTS = {"{name}.pag": "product.pag", "factory.toml": "factory.toml", "README.md": "README.md"}
"""Files of the new folder, and the texts in `factory/starter` that they are made of."""

LABELS = ("bell", "neck", "grip", "knob", "top", "stem")
"""What the parts of the product are called."""


def starter(name: str) -> dict[str, bytes]:
    """The files of a product called `name`, by their paths. Raises InputError (BadValue) for a name
    that no product can have."""
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


BELL = "0 50, 17 50, 22 30, 36 0, 40 0, 40 4, 26 30, 22 52, 16 60, 0 60"
GRIP = "0 0, 9 0, 12 15, 13 32, 10 52, 7 60, 0 60"
"""Radius and height along the outlines of turned parts [mm]."""


def turned(outline: str) -> bytes:
    """A binary STL of what a lathe makes of an outline, in millimetres."""
    import trimesh

    points = np.array([point.split() for point in outline.split(",")], float)
    body = trimesh.creation.revolve(points, sections=32)
    return bytes(body.export(file_type="stl"))
