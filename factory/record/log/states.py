"""The states in a log: arrays where they fit the memory of a reader, else blocks unpacked on
demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.record.log.blocks import HEAD, Arrays, unpack_rows, unpacked

STATES = ("qpos", "qvel", "ctrl")

KEPT = 4
"""Upper bound on the unpacked blocks in memory, of about a simulated second each."""


class Unpacking:
    """Unpacks the states in the blocks of ticks that begin at the given bytes of a file, with the
    numbers of rows of each."""

    def __init__(self, data: memoryview, begins: Sequence[int], counts: Sequence[int]) -> None:
        self._data, self._begins = data, begins
        self._first = np.cumsum([0, *counts])
        self._block = lru_cache(maxsize=KEPT)(self._unpack)

    def row(self, name: str, number: int) -> NDArray[np.float64]:
        """The state (width,) in a row of the whole log."""
        block = int(np.searchsorted(self._first, number, side="right")) - 1
        state: NDArray[np.float64] = self._block(block)[name][number - self._first[block]]
        return state

    def _unpack(self, block: int) -> Arrays:
        begin, count = self._begins[block], int(self._first[block + 1] - self._first[block])
        length = HEAD.unpack_from(self._data, begin)[1]
        content = self._data[begin + HEAD.size : begin + HEAD.size + length]
        arrays = unpacked(content)
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

    def __getitem__(self, row: int) -> NDArray[np.float64]:
        return self.unpacking.row(self.name, int(self.numbers[row]))


StateRows = NDArray[np.float64] | StoredRows
"""The rows (n, width) of a state."""


def all_rows(name: str, width: int, ticks: Sequence[Arrays]) -> NDArray[np.float64]:
    """The rows of a state in all blocks."""
    rows = [unpack_rows(name, arrays, len(arrays["time"])) for arrays in ticks]
    return np.concatenate([np.zeros((0, width)), *rows])


def without_states(arrays: Arrays) -> Arrays:
    """The other arrays of a block, copied: views would keep the whole block in memory."""
    return {k: v.copy() for k, v in arrays.items() if k.partition("_")[0] not in STATES}


def locked(values: Any) -> Any:
    """The array, read-only from now on."""
    values.setflags(write=False)
    return values
