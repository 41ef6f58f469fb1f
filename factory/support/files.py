"""Reading files within bounds, and writing them atomically, under another name first."""

from __future__ import annotations

import errno
import os
import select
import shutil
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from factory.support.errors import Diagnostic, InputError
from factory.support.guard import about_to_write, declare, reading

__all__ = [
    "LOG",
    "MESH",
    "MIB",
    "NET",
    "TABLE",
    "head_of",
    "is_net",
    "own_names",
    "read_bytes",
    "unwritten",
    "write_all",
]

LOG = b"factory-log "
"""The first bytes of a log of a run, in every version."""

MIB = 1 << 20
"""A mebibyte [bytes]."""

TEXT, TABLE, NET, MESH = 32 * MIB, MIB, 256 * MIB, 256 * MIB
"""Upper bounds on the bytes of a file that is read: a text (PAG, operation, tree, bill, LDraw), a
table in TOML, a net or a certificate, a mesh. A text takes up to 150 times its bytes of memory, a
net 15 times. 10^6 labels are 20 MiB of text, and a net of 10,000 parts is 40 MiB."""


PATIENCE = 2.0
"""Time to wait for the first byte of a pipe that no process has open for writing [s]."""


def read_bytes(path: Path, most: int) -> bytes:
    """The content of a file or a pipe.

    Args:
        path: the file or pipe.
        most: upper bound on its size [bytes].

    A folder, a device or a larger file is refused before anything is read; a pipe when more has
    come, or when nothing writes to it. What was read is an input, which is not written over: raises
    InputError where it will be.

    Raises OSError where it cannot be read.
    """
    reading(path)
    status = os.stat(path)
    is_file, is_pipe = stat.S_ISREG(status.st_mode), stat.S_ISFIFO(status.st_mode)
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
    if not (is_file or is_pipe):
        raise OSError(errno.ENOTSUP, "it is neither a file nor a pipe", str(path))
    larger = OSError(errno.EFBIG, f"it is larger than {most // MIB} MiB, the most that is read")
    if is_file and status.st_size > most:
        raise larger
    content: list[bytes] = []
    left, step = most + 1, max(status.st_size + 1, MIB)
    with open(path, "rb", buffering=0, opener=_open) as stream:
        if is_pipe:
            select.select([stream], [], [], PATIENCE)
            os.set_blocking(stream.fileno(), True)
        while left and (chunk := stream.read(min(left, step))):
            content.append(chunk)
            left -= len(chunk)
    if not left:
        raise larger
    if is_pipe and not content:
        raise OSError(errno.EPIPE, "nothing is written to this pipe", str(path))
    return b"".join(content)


def _open(path: str, flags: int) -> int:
    """Open without waiting for the other end of a pipe."""
    return os.open(path, flags | os.O_NONBLOCK)


def head_of(path: Path, count: int) -> bytes:
    """The first bytes of a regular file; none where it is something else or cannot be read."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as stream:
            return stream.read(count)
    except (OSError, ValueError):
        return b""


NO_ROOM = "check the path, its permissions and the space on the disk"


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically. Raises OSError."""
    write_all({path: content})


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file atomically. Raises OSError."""
    write_bytes(path, text.encode())


def write_all(contents: Mapping[Path, bytes]) -> None:
    """Write files, and the folders they need: all of them or, where one cannot be written, none.

    Args:
        contents: the bytes of each file.

    A link is followed; a pipe or a device is written in place. The permissions of a file stay as
    they are.

    Raises OSError, and InputError (BadFile) where one is an input.
    """
    for path in contents:
        about_to_write(path)
    made: list[Path] = []
    partials: dict[Path, Path] = {}
    try:
        for path, content in contents.items():
            if path.exists() and not path.is_file() and not path.is_dir():
                path.write_bytes(content)
                continue
            target = Path(os.path.realpath(path))
            made += make_folder(target.parent)
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
            if target.is_symlink():
                raise OSError(errno.ELOOP, "it is a link to itself", str(path))
            partials[target] = partial = partial_of(target)
            partial.write_bytes(content)
            if target.exists():
                shutil.copymode(target, partial)
        for target, partial in partials.items():
            partial.replace(target)
    except BaseException as error:
        _remove(partials.values(), made)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)
        raise


def unwritten(path: Path, error: OSError) -> InputError:
    """The error of a file that could not be written to its end."""
    message = f"'{path}' cannot be written: {error.strerror or error}"
    return InputError(Diagnostic("BadFile", message, None, NO_ROOM))


def make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it; gives those that were missing, the outermost first."""
    made: list[Path] = []
    try:
        for missing in [f for f in (folder, *folder.parents) if not f.exists()][::-1]:
            missing.mkdir(exist_ok=True)
            made.append(missing)
    except OSError:
        _remove([], made)
        raise
    return made


def own_names(folder: Path, paths: Iterable[Path]) -> None:
    """Declare files in a folder whose names the program chooses, and check them: none is a link, an
    input, or named by the user too. Raises InputError (BadFile)."""
    paths = list(paths)
    below = {f for path in paths for f in (path, *path.parents) if folder in f.parents}
    hint = "remove it, or choose another folder"
    faults = [
        Diagnostic("BadFile", f"'{path}' is a link", None, hint)
        for path in sorted(below)
        if path.is_symlink()
    ]
    if faults := faults + declare(paths, chosen=True):
        raise InputError(faults)


def is_net(file: Path) -> bool:
    """Whether a file is meant as PNML: by its ending, or because it begins as XML does."""
    if file.suffix.lower() == ".pnml":
        return True
    return head_of(file, 100).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")


def is_plan(file: Path) -> bool:
    """Whether a file is meant as a plan: by its ending."""
    return file.suffix.lower() == ".json"


def user_cache() -> Path:
    """The user's folder for files that can be made again: in $XDG_CACHE_HOME, or ~/.cache."""
    folder = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(folder) if os.path.isabs(folder) else Path(os.path.expanduser("~")) / ".cache"
    return base / "klavins-factory"


def partial_of(path: Path) -> Path:
    """The hidden name beside a file under which this process writes it: unique, and no longer than
    a name may be."""
    digest = sha256(os.fsencode(path.name)).hexdigest()[:16]
    return path.with_name(f".{digest}.{os.getpid()}.part")


def _remove(files: Iterable[Path], folders: list[Path]) -> None:
    for file in files:
        file.unlink(missing_ok=True)
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()
