"""Receipts of builds, in the user's cache: the digests of all inputs and outputs.

A build whose receipt still holds is left out: it would write the same files. A receipt that is
missing, damaged or out of date costs a build, never a wrong file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from factory.support.files import user_cache, write_text
from factory.support.version import release

KEPT = 200
"""The most receipts that are kept; the oldest are removed first."""

ENGINES = ("klavins-factory", "mujoco", "numpy", "scipy", "shapely", "trimesh")
"""Packages that a build depends on."""


def request(file: Path, wanted: Mapping[str, Any]) -> str:
    """The name of a receipt: a digest of the PAG's path, the options and the program's own files.
    A path counts as it is given and as it is resolved."""
    own = Path(__file__).resolve().parents[1]
    program = sorted(
        (str(path.relative_to(own)), path.stat().st_size, path.stat().st_mtime_ns)
        for path in own.rglob("*.*")
        if path.suffix in (".py", ".lark", ".xml")
    )
    versions = [f"{package} {found}" for package in ENGINES if (found := release(package))]
    given = {key: _named(value) for key, value in wanted.items()}
    parts = [_named(file), versions, program, given]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _named(value: object) -> object:
    if isinstance(value, tuple):
        return [_named(item) for item in value]
    return [str(value), os.path.abspath(value)] if isinstance(value, Path) else str(value)


def find(name: str) -> dict[str, Any] | None:
    """The document of a build whose receipt still holds; None where there is none."""
    try:
        receipt = json.loads(_place(name).read_text("utf-8"))
        files = {**receipt["inputs"], **receipt["outputs"]}
        if all(_digest(Path(path)) == digest for path, digest in files.items()):
            document: dict[str, Any] = receipt["document"]
            return document
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass
    return None


def keep(
    name: str, inputs: Iterable[Path], outputs: Iterable[Path], document: Mapping[str, Any]
) -> None:
    """Keep the receipt of a build if it can be written, and no input or output is a pipe or a
    device, which could not be read again."""
    read, written = list(inputs), list(outputs)
    plain = all(path.is_file() for path in written)
    if not written or not plain or not all(path.is_file() or path.is_dir() for path in read):
        return
    receipt = {
        "inputs": {os.path.abspath(path): _digest(path) for path in read},
        "outputs": {os.path.abspath(path): _digest(path) for path in written},
        "document": dict(document),
    }
    with suppress(OSError):
        place = _place(name)
        write_text(place, json.dumps(receipt) + "\n")
        receipts = sorted(place.parent.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in receipts[:-KEPT]:
            path.unlink(missing_ok=True)


def _digest(path: Path) -> str:
    """The digest of a file's content, or of the names in a folder. Raises OSError."""
    if path.is_dir():
        names = sorted(entry.name for entry in path.iterdir())
        return hashlib.sha256(json.dumps(names).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _place(name: str) -> Path:
    return user_cache() / "builds" / f"{name}.json"
