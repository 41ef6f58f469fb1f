"""What a log keeps of a run that can be gone on with: its checkpoints, and the run up to each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from factory.record.log.blocks import Arrays, bad_log, blocks, check_magic
from factory.record.log.reader import Log, header_in, log_in
from factory.support.errors import InputError
from factory.support.files import RECORD, mapped

BROKEN = (
    *(ValueError, KeyError, IndexError, TypeError, AttributeError),
    *(OverflowError, RecursionError, AssertionError, MemoryError),
)
"""What content raises that is not what it should be."""


@dataclass(frozen=True)
class KeptRun:
    """The run in a log: its `header`, the `model` (None where there is none), the byte at which its
    ticks `begin`, how many blocks of `ticks` there are, and its checkpoints in the order of time,
    each with the byte at which it ends."""

    path: Path
    header: Mapping[str, Any] = field(repr=False)
    model: Arrays | None = field(repr=False)
    begin: int
    ticks: int
    checkpoints: tuple[tuple[int, Arrays], ...] = field(repr=False)
    _data: memoryview = field(repr=False)

    def until(self, end: int) -> Log:
        """The log up to a byte. Raises BROKEN where that is damaged."""
        return log_in(self._data[:end])

    @property
    def whole(self) -> Log | None:
        """All of the log; None where a block is not what it should be."""
        try:
            return log_in(self._data)
        except BROKEN:
            return None


def kept_run(path: Path) -> KeptRun:
    """The run in a log that this process has claimed. Raises InputError (BadLog) where it is no
    log, or ends before its ticks begin."""
    try:
        data = mapped(path, RECORD)
    except OSError as error:
        raise InputError(bad_log(path, f"cannot be read: {error.strerror}")) from error
    check_magic(path, data)
    try:
        header, begin = header_in(data)
    except BROKEN as error:
        raise InputError(bad_log(path, f"is damaged: {error}")) from error
    model, ticks, found = None, 0, list[tuple[int, Arrays]]()
    try:
        for kind, arrays, end in blocks(data, begin):
            if kind == b"M" and model is None:
                model, begin = arrays, end
            elif kind == b"T":
                ticks += 1
            elif kind == b"C":
                found.append((end, arrays))
    except BROKEN:
        pass  # what is before is good
    if model is None and header["world"] != "ideal":
        raise InputError(bad_log(path, "is cut off in its model, before its run begins"))
    return KeptRun(path, header, model, begin, ticks, tuple(found), data)
