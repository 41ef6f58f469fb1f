"""Writing files whole: under another name first, then moved into place."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file so that no half of it is ever seen under its name. Raises OSError."""
    write_all({path: content})


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file whole."""
    write_bytes(path, text.encode())


def write_all(contents: Mapping[Path, bytes]) -> None:
    """Write files, and the folders they need: all of them or, where one cannot be written, none.

    A link is followed, and what is no plain file (a pipe, a device) is written in place. Raises
    OSError.
    """
    made: list[Path] = []
    partials: dict[Path, Path] = {}
    try:
        for path, content in contents.items():
            if path.exists() and not path.is_file() and not path.is_dir():
                path.write_bytes(content)
                continue
            target = path.resolve()
            made += make_folder(target.parent)
            if target.is_dir():
                raise IsADirectoryError(21, "it is a folder", str(path))
            partials[target] = partial = partial_of(target)
            partial.write_bytes(content)
        for target, partial in partials.items():
            partial.replace(target)
    except BaseException as error:
        _remove(partials.values(), made)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)
        raise


def make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it; gives the ones made, the outermost first."""
    missing = [f for f in (folder, *folder.parents) if not f.exists()][::-1]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def user_cache() -> Path:
    """Where what can be made again is kept for this user: in $XDG_CACHE_HOME, or ~/.cache."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~")) / ".cache"
    return base / "klavins-factory"


def partial_of(path: Path) -> Path:
    """The hidden name beside a file under which this process writes it."""
    return path.with_name(f".{path.name[:200]}.{os.getpid()}.part")


def _remove(files: Iterable[Path], folders: list[Path]) -> None:
    for file in files:
        file.unlink(missing_ok=True)
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()
