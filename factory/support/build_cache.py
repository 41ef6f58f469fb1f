"""What was built before: a receipt with the digests of all that went in and came out.

Where every one of them is still right, building again would write the same files, and is left out.
A receipt is kept in the user's cache; one that is missing, damaged or out of date costs a build,
never a wrong file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from factory.support.files import user_cache, write_text

KEPT = 200
"""So many receipts are kept: the oldest go first."""

ENGINES = ("klavins-factory", "mujoco", "numpy", "scipy", "shapely", "trimesh")
"""Packages that what is built depends on."""


def request(file: Path, wanted: Mapping[str, Any]) -> str:
    """The name of a receipt: the PAG and all that was asked for, and by which program. Paths are
    named as they are given, and from where."""
    own = Path(__file__).resolve().parents[1]
    program = sorted(
        (str(path.relative_to(own)), path.stat().st_size, path.stat().st_mtime_ns)
        for path in own.rglob("*.py")
    )
    given = {key: _named(value) for key, value in wanted.items()}
    parts = [_named(file), _versions(), program, given]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _named(value: object) -> object:
    if isinstance(value, tuple):
        return [_named(item) for item in value]
    return [str(value), os.path.abspath(value)] if isinstance(value, Path) else str(value)


def find(name: str) -> dict[str, Any] | None:
    """The document of a build that is still true, None where there is none."""
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
    """Keep the receipt of a build, if it can be; not of one into what is no plain file."""
    written = list(outputs)
    if not written or not all(path.is_file() for path in written):
        return
    receipt = {
        "inputs": {os.path.abspath(path): _digest(path) for path in inputs},
        "outputs": {os.path.abspath(path): _digest(path) for path in written},
        "document": dict(document),
    }
    with suppress(OSError):
        write_text(_place(name), json.dumps(receipt) + "\n")
        _trim(_place(name).parent)


def _digest(path: Path) -> str:
    """Of a file's content, or of the names in a folder. Raises OSError."""
    if path.is_dir():
        names = sorted(entry.name for entry in path.iterdir())
        return hashlib.sha256(json.dumps(names).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _place(name: str) -> Path:
    return user_cache() / "builds" / f"{name}.json"


def _trim(folder: Path) -> None:
    receipts = sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
    for path in receipts[:-KEPT]:
        path.unlink(missing_ok=True)


def _versions() -> list[str]:
    found = []
    for package in ENGINES:
        with suppress(PackageNotFoundError):
            found.append(f"{package} {version(package)}")
    return found
