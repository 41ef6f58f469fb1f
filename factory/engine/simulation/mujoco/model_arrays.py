"""The engine's model of a run, compared with what it was compiled to and with what the run has
rightly written into it since.

Whatever a run writes into the model it writes through `ModelArrays`, which keeps a copy of the
memory of the model. An array that differs from that was changed by something else."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from factory.engine.mjcf.arrays import (
    Fingerprint,
    OptionReader,
    Values,
    arrays_of,
    element,
    fingerprint_of,
)
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic

HOT = ("geom_contype", "geom_conaffinity", "body_contype", "body_conaffinity", "exclude_signature")
"""The arrays that are compared after every tick, with the options."""

OFTEN = 0.1
"""All arrays are compared so often [s]."""

CODES = {
    **{f"body_{what}": "NotSolid" for what in ("contype", "conaffinity", "margin", "bvh")},
    **{f"geom_{what}": "NotSolid" for what in ("contype", "conaffinity", "margin", "gap")},
    **{f"geom_{what}": "NotSolid" for what in ("rbound", "aabb", "condim")},
    **{"exclude_signature": "NotSolid", "bvh_": "NotSolid"},
    **{f"body_{what}": "Mass" for what in ("mass", "inertia", "subtreemass", "ipos")},
    **{f"geom_{what}": "Shape" for what in ("pos", "quat", "size", "type", "dataid")},
    **{"mesh_": "Shape", "eq_data": "Frame"},
}
"""The codes of arrays whose names begin so, the first that fits; Altered for all others."""

CALLBACKS = ("act_bias", "act_dyn", "act_gain", "contactfilter", "control", "passive", "sensor")
"""Functions that the engine would call in its steps; only those of the house may be there."""


class WrittenArray:
    """An array of the engine's model that a run writes: `now`, and a copy of all it has written."""

    def __init__(self, now: Values, kept: Values) -> None:
        self.now, self._kept = now, kept

    def __setitem__(self, at: Any, value: Any) -> None:
        self.now[at] = value
        self._kept[at] = self.now[at]


class ModelArrays:
    """The arrays of the engine's model `m`, of which `compiled` is the fingerprint; `recompiled`
    compiles it once more, to say what was changed before the run."""

    def __init__(
        self,
        m: mujoco.MjModel,
        compiled: Fingerprint,
        recompiled: Callable[[], mujoco.MjModel],
    ) -> None:
        self.m = m
        self._arrays, self._kept = arrays_of(m), dict[str, Values]()
        self._spans = [*self._copied()]
        hot = (name for name in HOT if name in self._arrays)
        self._hot = [(self._arrays[name], self._kept[name]) for name in hot]
        self._options, self._right = OptionReader(m), compiled.options
        self._raw = self._options.raw() if self._options.read() == self._right else None
        self._next = -np.inf
        self.first = tuple(self._before(compiled, recompiled))

    def __getitem__(self, name: str) -> WrittenArray:
        """An array that is going to be written."""
        empty = getattr(self.m, name)
        return WrittenArray(self._arrays.get(name, empty), self._kept.get(name, empty))

    def accept(self) -> None:
        """Take the whole model as it is now, as a disturbance has made it."""
        for name, array in self._arrays.items():
            self._kept[name][:] = array
        self._right, self._raw = self._options.read(), self._options.raw()

    def same(self, now: float) -> bool:
        """Whether the options and the arrays that are compared most often are as they should be
        and, where the others are due at a time [s], these too."""
        if self._options.raw() != self._raw:
            return False
        if now < self._next:
            return all(array.tobytes() == kept.tobytes() for array, kept in self._hot)
        self._next = now + OFTEN
        return all((memory == kept).all() for memory, kept in self._spans)

    def changes(self) -> Iterator[Diagnostic]:
        """All that differs from what it should be."""
        options = self._options.read()
        for name, value in self._right.items():
            if options[name] != value:
                words = f"the engine's option '{name}' is {_said(options[name])}"
                yield Diagnostic("Options", f"{words}, not {_said(value)}")
        for name, array in self._arrays.items():
            if array.tobytes() != self._kept[name].tobytes():
                yield self._change(name, array, self._kept[name])
        for name in CALLBACKS:
            called = getattr(mujoco, f"get_mjcb_{name}")()
            if called is not None and not str(called.__module__).startswith("factory."):
                yield Diagnostic("Options", f"the engine calls a function ('{name}') in its steps")

    def _before(
        self, compiled: Fingerprint, recompiled: Callable[[], mujoco.MjModel]
    ) -> Iterator[Diagnostic]:
        """The changes that were made before the model came here."""
        now = fingerprint_of(self.m).arrays
        if now == compiled.arrays:
            return
        right = arrays_of(recompiled())
        for name in sorted({*now, *compiled.arrays}):
            if now.get(name) != compiled.arrays.get(name):
                yield self._change(name, self._arrays.get(name), right.get(name))

    def _change(self, name: str, now: Values | None, right: Values | None) -> Diagnostic:
        code = "Altered"
        if coded := [code for begin, code in CODES.items() if name.startswith(begin)]:
            code = coded[0]
        if now is None or right is None or now.shape != right.shape:
            rows = [0 if array is None else len(array) for array in (now, right)]
            words = f"the engine's '{name}' has {rows[0]} rows, not {rows[1]}"
            return Diagnostic(code, words)
        unlike = (now != right).reshape(len(now), -1)
        wrong = np.flatnonzero(unlike.any(axis=1)).tolist()
        if not wrong:  # a sign of zero, or what is no number
            return Diagnostic(code, f"the engine's '{name}' is not as it was compiled")
        row, of = wrong[0], element(self.m, name, wrong[0])
        column = int(unlike[row].argmax())
        values = (array.reshape(len(array), -1)[row, column] for array in (now, right))
        words = f"'{name}' of {of or f'row {row}'} is {{:.6g}}, not {{:.6g}}".format(*values)
        more = len(wrong) - 1
        return Diagnostic(code, words + (f" (and {more} more)" if more else ""))

    def _copied(self) -> Iterator[tuple[Values, Values]]:
        """The spans of memory that the arrays fill, and a copy of each, of which that of an array
        is a view; both in words of four bytes where they have whole ones, which takes a seventh of
        the time. The engine has its arrays side by side."""
        at = sorted((array.ctypes.data, name) for name, array in self._arrays.items())
        spans: list[list[tuple[int, str]]] = []
        end = -1
        for address, name in at:
            if not 0 <= address - end < _APART:
                spans.append([])
            spans[-1].append((address, name))
            end = address + self._arrays[name].nbytes
        for span in spans:
            begin, last = span[0][0], self._arrays[span[-1][1]]
            size = last.ctypes.data + last.nbytes - begin
            memory = np.frombuffer((ctypes.c_uint8 * size).from_address(begin), np.uint8)
            flat = memory.copy()
            for address, name in span:
                array = self._arrays[name]
                inside = flat[address - begin : address - begin + array.nbytes]
                self._kept[name] = inside.view(array.dtype).reshape(array.shape)
            words = np.uint8 if size % 4 else np.uint32
            yield memory.view(words), flat.view(words)


_APART = 64
"""Arrays that are less apart are side by side [bytes]: the engine aligns them."""


def _said(value: object) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_said, value))})"
    return f"{value:g}" if isinstance(value, float) else str(value)
