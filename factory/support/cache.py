"""Results that can be computed again, in the user's cache: a file per entry.

The name of an entry is a digest of everything that the entry depends on. Its file holds the SHA-256
of the content, then the content, and is written atomically: an entry that is missing or damaged
costs a computation, never a wrong result. Where the entries of a folder take more than MOST, the
least recently used ones are removed.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.support.files import user_cache, write_bytes
from factory.support.tables import SIMPLE, fields_of
from factory.support.version import release

__all__ = ["digest"]

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Arrays = Mapping[str, NDArray[Any]]

MOST = 500_000_000
"""The most bytes that the entries of a folder take together."""

SUFFIX = ".entry"
"""The ending of the files of entries."""

ENGINES = ("klavins-factory", "mujoco", "numpy", "scipy", "shapely", "trimesh")
"""Packages that a build depends on."""

BUILDS = "builds"
"""The folder of the receipts of builds."""


_spare: dict[Path, int] = {}
"""The bytes that there is room for in each folder, since this process last looked."""


def digest(*parts: object) -> str:
    """The name of an entry that depends on these: arrays, bytes, and values whose `repr` differs
    where they differ."""
    total = hashlib.sha256()
    for part in parts:
        shape: tuple[Any, ...] = ()
        if hasattr(part, "dtype"):  # an array; numpy itself may not be loaded
            shape, part = (part.dtype, part.shape), part.tobytes()  # type: ignore[attr-defined]
        content = part if isinstance(part, bytes) else repr(part).encode()
        total.update(f" {shape} {len(content)} ".encode())
        total.update(content)
    return total.hexdigest()


def content(value: Any, seen: dict[int, str] | None = None) -> object:
    """What `digest` tells a value by, whatever holds it: a digest of a dataclass by the fields that
    are compared, and of an array; a tuple, a mapping or a sorted list of what is in a tuple, a
    mapping or a set; else the value itself. `seen`: the digests of dataclasses that the value
    shares with others, by their identities."""
    kind: Any = type(value)
    if kind in SIMPLE:
        return value
    seen = {} if seen is None else seen
    if held := fields_of(kind):
        if id(value) not in seen:
            parts = [content(getattr(value, each.name), seen) for each in held if each.compare]
            seen[id(value)] = digest(kind.__qualname__, *parts)
        return seen[id(value)]
    if isinstance(value, Mapping):
        return {content(key, seen): content(one, seen) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return tuple([content(one, seen) for one in value])
    if isinstance(value, set | frozenset):
        return sorted([repr(content(one, seen)) for one in value])
    return digest(value) if hasattr(value, "dtype") else value


@cache
def program(folders: tuple[Path, ...], *packages: str) -> str:
    """A digest of the modules in some folders, and of the versions of packages that they use."""
    modules = [path.read_bytes() for folder in folders for path in sorted(folder.glob("*.py"))]
    return digest(*modules, *map(release, packages))


def load(folder: str, name: str) -> bytes | None:
    """The content of an entry; None where there is none, or it is damaged."""
    path = _path(folder, name)
    try:
        whole = path.read_bytes()
    except OSError:
        return None
    checksum, content = whole[:32], whole[32:]
    if hashlib.sha256(content).digest() != checksum:
        return None
    with suppress(OSError):
        os.utime(path)
    return content


def store(folder: str, name: str, content: bytes) -> None:
    """Write an entry, if it can be written, and remove the oldest ones where they are too many."""
    path = _path(folder, name)
    with suppress(OSError):
        write_bytes(path, hashlib.sha256(content).digest() + content)
        left = _spare.get(path.parent, 0) - len(content)
        _spare[path.parent] = left if left >= 0 else _shrink(path.parent)


def _path(folder: str, name: str) -> Path:
    return user_cache() / folder / (name + SUFFIX)


def _shrink(folder: Path) -> int:
    """Remove the oldest entries beyond MOST; how many more bytes there is room for."""
    entries = [(entry.stat(), entry.path) for entry in os.scandir(folder)]
    spare = MOST - sum(stat.st_size for stat, _ in entries)
    for stat, path in sorted(entries, key=lambda entry: entry[0].st_mtime_ns):
        if spare >= 0:
            break
        os.unlink(path)
        spare += stat.st_size
    return spare


def load_arrays(folder: str, name: str) -> Arrays | None:
    """The arrays of an entry by their keys; None where there is none, or it is damaged."""
    import numpy as np

    content = load(folder, name)
    if content is None:
        return None
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


def store_arrays(folder: str, name: str, arrays: Arrays) -> None:
    """Write an entry of arrays, if it can be written."""
    import numpy as np

    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    store(folder, name, content.getvalue())


def packed(pieces: Sequence[NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Several arrays of points (n, 3) as two arrays."""
    import numpy as np

    counts = np.array([len(piece) for piece in pieces], np.int64)
    return {"points": np.concatenate([np.zeros((0, 3)), *pieces]), "counts": counts}


def unpacked(arrays: Arrays) -> tuple[NDArray[Any], ...]:
    """The arrays that `packed` made two of."""
    import numpy as np

    return tuple(np.split(arrays["points"], np.cumsum(arrays["counts"]))[:-1])


def build_name(file: Path, wanted: Mapping[str, Any]) -> str:
    """The name of the receipt of a build: a digest of the PAG's path, the options and the program's
    own files. A path counts as it is given and as it is resolved."""
    package = Path(__file__).resolve().parents[1]
    modules = sorted(
        (str(path.relative_to(package)), path.stat().st_size, path.stat().st_mtime_ns)
        for path in package.rglob("*.*")
        if path.suffix in (".py", ".lark", ".xml")
    )
    options = {key: _printable(value) for key, value in wanted.items()}
    return digest(_printable(file), [*map(release, ENGINES)], modules, options)


def _printable(value: object) -> object:
    if isinstance(value, tuple):
        return [_printable(item) for item in value]
    return [str(value), os.path.abspath(value)] if isinstance(value, Path) else str(value)


def find_build(name: str) -> dict[str, Any] | None:
    """The document of a build whose inputs and outputs are as they were, so that it would write the
    same files; None where there is none."""
    content = load(BUILDS, name)
    if content is None:
        return None
    receipt = json.loads(content)
    with suppress(OSError):
        if all(_file_digest(Path(path)) == old for path, old in receipt["files"].items()):
            document: dict[str, Any] = receipt["document"]
            return document
    return None


def keep_build(
    name: str, inputs: Iterable[Path], outputs: Iterable[Path], document: Mapping[str, Any]
) -> None:
    """Keep the receipt of a build: the digests of its inputs and outputs. None is kept where one of
    these is a pipe or a device, which could not be read again."""
    read, written = list(inputs), list(outputs)
    regular = all(path.is_file() for path in written)
    if not written or not regular or not all(path.is_file() or path.is_dir() for path in read):
        return
    with suppress(OSError):
        files = {os.path.abspath(path): _file_digest(path) for path in (*read, *written)}
        receipt = {"files": files, "document": dict(document)}
        store(BUILDS, name, json.dumps(receipt).encode())


def _file_digest(path: Path) -> str:
    """The digest of a file's content, or of the names in a folder. Raises OSError."""
    if path.is_dir():
        return digest(sorted(entry.name for entry in path.iterdir()))
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
