"""The blocks of a log file: named arrays packed, compressed, and checked when they are read. States
are unpacked on demand, so that the memory of a reader does not grow with them.

A block is one letter, the length of its content and its CRC-32 (`<cII`), then the content, zlib.
Unpacked, that is the length (`<I`) of a JSON directory [[name, dtype, shape], ...], the directory,
and the arrays' bytes in a row."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Diagnostic, InputError
from factory.apps.log.content import AGAIN, Content
from factory.support.files import LOG

STATES = ("qpos", "qvel", "ctrl")

KEPT = 4
"""Upper bound on the unpacked blocks in memory, of about a simulated second each."""


class Unpacking:
    """Unpacks the states in the blocks of ticks that begin at the given bytes of a file, with the
    numbers of rows of each."""

    def __init__(self, data: Content, begins: Sequence[int], counts: Sequence[int]) -> None:
        self._data, self._begins = data, begins
        self._first = np.cumsum([0, *counts])
        self._block = lru_cache(maxsize=KEPT)(self._unpack)

    def row(self, name: str, number: int) -> NDArray[np.float64]:
        """The state (width,) in a row of the whole log, locked, apart from its block."""
        block = int(np.searchsorted(self._first, number, side="right")) - 1
        state: NDArray[np.float64] = self._block(block)[name][number - self._first[block]].copy()
        state.setflags(write=False)
        return state

    def _unpack(self, block: int) -> Arrays:
        begin, count = self._begins[block], int(self._first[block + 1] - self._first[block])
        _, length, _ = HEAD.unpack(self._data[begin : begin + HEAD.size])
        arrays = unpacked(self._data[begin + HEAD.size : begin + HEAD.size + length])
        there = [name for name in STATES if f"{name}_first" in arrays]
        return {name: unpack_rows(name, arrays, count) for name in there}


@dataclass(frozen=True, slots=True)
class StoredRows:
    """The rows of a state, by `numbers` (n,) of rows of the whole log, unpacked on demand."""

    unpacking: Unpacking = field(repr=False)
    name: str
    width: int
    numbers: NDArray[np.int64] = field(repr=False)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows, and width."""
        return len(self.numbers), self.width

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, rows: int | slice | NDArray[Any]) -> NDArray[np.float64]:
        """A row (width,), or an array of several (n, width), as of an array."""
        numbers = self.numbers[rows]
        if np.ndim(numbers) == 0:
            return self.unpacking.row(self.name, int(numbers))
        chosen = [self.unpacking.row(self.name, number) for number in numbers.tolist()]
        return np.array(chosen).reshape(len(chosen), self.width)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[np.float64]:
        return self[:].astype(dtype or np.float64, copy=bool(copy))


StateRows = NDArray[np.float64] | StoredRows
"""The rows (n, width) of a state."""


def without_states(arrays: Arrays) -> Arrays:
    """The other arrays of a block, copied: views would keep the whole block in memory."""
    return {k: v.copy() for k, v in arrays.items() if k.partition("_")[0] not in STATES}


def locked(values: Any) -> Any:
    """The array, read-only from now on."""
    values.setflags(write=False)
    return values


Arrays = dict[str, NDArray[Any]]

MAGIC = LOG + b"2\n"
"""How a log begins, with the number of its format."""

HEAD = struct.Struct("<cII")
LENGTH = struct.Struct("<I")
DENSEST = 200
"""Upper bound on the bytes of an unpacked block over its packed bytes. Models take 20, ticks 10; a
block made to fill the memory takes 1,000."""

KINDS = ("|u1", "<i4", "<f8")


def block(kind: bytes, arrays: Mapping[str, NDArray[Any]], level: int = 1) -> bytes:
    """Named arrays as one block."""
    plain = {name: np.ascontiguousarray(a) for name, a in arrays.items()}
    entries = [[name, a.dtype.newbyteorder("<").str, list(a.shape)] for name, a in plain.items()]
    directory = json.dumps(entries).encode()
    body = b"".join(
        [LENGTH.pack(len(directory)), directory, *(a.tobytes() for a in plain.values())]
    )
    content = zlib.compress(body, level)
    return HEAD.pack(kind, len(content), zlib.crc32(content)) + content


def blocks(data: Content, at: int) -> Iterator[tuple[bytes, Arrays, int]]:
    """The blocks in a file from byte `at` on, up to the first that is cut off or damaged, each with
    the byte at which the next begins."""
    while at + HEAD.size <= len(data):
        kind, length, check = HEAD.unpack(data[at : at + HEAD.size])
        content = data[at + HEAD.size : at + HEAD.size + length]
        if len(content) != length or zlib.crc32(content) != check:
            return
        at += HEAD.size + length
        yield kind, unpacked(content), at


def is_cut(data: Content, at: int) -> bool:
    """Whether a file ends within the block that begins at byte `at`."""
    if at + HEAD.size > len(data):
        return True
    return at + HEAD.size + int(HEAD.unpack(data[at : at + HEAD.size])[1]) > len(data)


def unpacked(content: bytes) -> Arrays:
    """The arrays of a block. Raises ValueError where it is not one."""
    try:
        packed = zlib.decompressobj()
        body = packed.decompress(content, DENSEST * len(content))
        if not packed.eof:
            raise ValueError(f"a block unpacks to more than {DENSEST} times its bytes")
        (length,) = LENGTH.unpack_from(body)
        entries = json.loads(body[LENGTH.size : LENGTH.size + length])
        arrays, at = {}, LENGTH.size + length
        for name, kind, shape in entries:
            if kind not in KINDS or min(shape, default=0) < 0:
                raise ValueError(f"unknown array {kind} {shape}")
            count = int(np.prod(shape, dtype=np.int64))
            arrays[str(name)] = np.frombuffer(body, kind, count, at).reshape(shape)
            at += count * np.dtype(kind).itemsize
        return arrays
    except (zlib.error, struct.error, TypeError, RecursionError, OverflowError) as error:
        raise ValueError(f"a broken block: {error}") from error


def pack_rows(name: str, rows: NDArray[np.float64]) -> Arrays:
    """Rows (n, k) of which most columns are constant: the first row, the columns that change, and
    for these the XOR of each value's bits with those of the row before, byte by byte."""
    bits = rows.view(np.int64)
    change = bits[1:] ^ bits[:-1]
    moving = np.flatnonzero(change.any(axis=0)).astype(np.int32)
    planes = np.ascontiguousarray(change[:, moving].T).view(np.uint8).reshape(-1, 8).T
    return {f"{name}_first": rows[0], f"{name}_moving": moving, f"{name}_change": planes}


def unpack_rows(name: str, arrays: Arrays, count: int) -> NDArray[np.float64]:
    """The inverse of `pack_rows` for `count` rows. Raises ValueError where they do not fit."""
    first, moving = arrays[f"{name}_first"], arrays[f"{name}_moving"]
    planes = arrays[f"{name}_change"]
    if planes.shape != (8, (count - 1) * len(moving)):
        raise ValueError(f"{name} has {planes.shape} bytes for {count} rows of {len(moving)}")
    bits = np.tile(first.view(np.int64), (count, 1))
    change = np.ascontiguousarray(planes.T).view(np.int64).reshape(len(moving), count - 1).T
    bits[1:, moving] = bits[0, moving] ^ np.bitwise_xor.accumulate(change, axis=0)
    return bits.view(np.float64)


def bad_log(
    path: Path, words: str, hint: str = "`factory run FILE.pag --log OUT` writes one"
) -> Diagnostic:
    """The error of a file that should be a log."""
    return Diagnostic("BadLog", f"'{path}' {words}", None, hint)


def check_magic(path: Path, data: Content) -> None:
    """Raises InputError (BadLog) where a file is no log, or one of another version."""
    if data[: len(MAGIC)] == MAGIC:
        return
    if data[: len(LOG)] == LOG:
        raise InputError(bad_log(path, "was kept by another version of factory", AGAIN))
    raise InputError(bad_log(path, "is no log of factory"))
