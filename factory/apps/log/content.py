"""The content of a log's file, of which what is asked for alone is read."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from weakref import finalize

from factory.support.files import MIB, read_bytes
from factory.support.guard import reading

AGAIN = "record it again: `factory run FILE.pag --log OUT`"
"""What helps where a log cannot be used."""


LARGE, RECORD = MIB, 4096 * MIB
"""A log of more bytes is read in pieces; one of more than RECORD is refused."""


class Stored:
    """The content of a file on the disk, of which what is asked for alone is read."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDONLY)
        self._size = os.fstat(self._file).st_size
        finalize(self, os.close, self._file)

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice) -> bytes:
        first, end, _ = part.indices(self._size)
        return os.pread(self._file, max(0, end - first), first)


Content = bytes | Stored
"""The bytes of a file; slices of it are bytes."""


def content_of(path: Path, most: int) -> Content:
    """The content of a file, or what comes through a pipe, as `read_bytes` gives it; of a large
    file what is asked for alone is read."""
    reading(path)
    status = os.stat(path)
    if stat.S_ISREG(status.st_mode) and LARGE < status.st_size <= most:
        return Stored(path)
    return read_bytes(path, most)
