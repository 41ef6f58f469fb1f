"""Arrays that can be computed again, in the user's cache: a file an entry, named after all that it
depends on.

An entry that is missing or damaged costs a computation, never a wrong result. Where the entries of
a folder take more than MOST, those used longest ago are removed.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.support.files import user_cache, write_bytes
from factory.support.version import release

MOST = 500_000_000
"""The most bytes that the entries of a folder take together."""

Arrays = Mapping[str, NDArray[Any]]


def digest(*parts: object) -> str:
    """The name of an entry that depends on these: arrays, bytes, and what is printed differently
    where it differs."""
    found = hashlib.sha256()
    for part in parts:
        shape = (part.dtype, part.shape) if isinstance(part, np.ndarray) else ()
        content = part.tobytes() if isinstance(part, np.ndarray) else part
        content = content if isinstance(content, bytes) else repr(content).encode()
        found.update(f" {shape} {len(content)} ".encode())
        found.update(content)
    return found.hexdigest()


@cache
def program(folder: Path, *packages: str) -> str:
    """A digest of the modules in a folder, and of the versions of packages that they use."""
    modules = [path.read_bytes() for path in sorted(folder.glob("*.py"))]
    return digest(*modules, *map(release, packages))


def find(folder: str, name: str, keys: Iterable[str]) -> Arrays | None:
    """The arrays of an entry by these keys; None where there is none, or it is damaged."""
    path = _place(folder, name)
    try:
        with np.load(path, allow_pickle=False) as content:
            found = {key: content[key] for key in keys}
        os.utime(path)
        return found
    except Exception:  # numpy and zipfile raise anything on a broken file
        return None


def keep(folder: str, name: str, arrays: Arrays) -> None:
    """Write an entry, if it can be written, and remove the oldest ones where they are too many."""
    path, content = _place(folder, name), io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    with suppress(OSError):
        write_bytes(path, content.getvalue())
        _shrink(path.parent)


def _shrink(folder: Path) -> None:
    entries = [(entry.stat(), entry.path) for entry in os.scandir(folder)]
    spare = MOST - sum(stat.st_size for stat, _ in entries)
    for stat, path in sorted(entries, key=lambda entry: entry[0].st_mtime_ns):
        if spare >= 0:
            break
        os.unlink(path)
        spare += stat.st_size


PACKED = ("points", "counts")
"""The keys of several arrays of points (n, 3) that are kept as two."""


def packed(pieces: Sequence[NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Arrays of points as two."""
    counts = np.array([len(piece) for piece in pieces], np.int64)
    return {"points": np.concatenate([np.zeros((0, 3)), *pieces]), "counts": counts}


def unpacked(arrays: Arrays) -> tuple[NDArray[Any], ...]:
    """The arrays that `packed` made two of."""
    ends = np.cumsum(arrays["counts"])
    return tuple(np.split(arrays["points"], ends)[:-1])


def _place(folder: str, name: str) -> Path:
    return user_cache() / folder / f"{name}.npz"
