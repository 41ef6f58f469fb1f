"""Reading a log, whole or cut off."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import CutOff, Failures, InputError, Undone
from factory.apps.log.blocks import (
    LENGTH,
    MAGIC,
    Arrays,
    StateRows,
    StoredRows,
    Unpacking,
    bad_log,
    blocks,
    check_magic,
    is_cut,
    locked,
    without_states,
)
from factory.apps.log.checks import (
    check_block,
    check_course,
    check_figures,
    check_header,
    state_bytes,
)
from factory.apps.log.content import RECORD, Content, content_of
from factory.apps.log.failed import Placed, failures_of, failures_so_far, undone_in
from factory.support.claim import is_claimed
from factory.support.files import LOG, head_of
from factory.support.tables import misfit

Index = NDArray[np.int32]

WIDEST = 1 << 27
"""Upper bound on the bytes of the unpacked states of a block. Those of a second of the paper's
example take 200 kB."""

ROUNDING = 1e-9
"""Times that differ by less are equal [s]."""


@dataclass(frozen=True, slots=True)
class Ragged:
    """An array for each row i of a log, which is row `numbers[i]` of its file: the one recorded at
    that row or, where arrays are `lasting`, the last one up to it; empty where there is none.

    `at` (k,): the rows of the file at which arrays were recorded; `ends` (k,): where each ends in
    `values`."""

    values: NDArray[Any] = field(repr=False)
    at: NDArray[np.int64] = field(repr=False)
    ends: NDArray[np.int64] = field(repr=False)
    numbers: NDArray[np.int64] = field(repr=False)
    lasting: bool

    def __getitem__(self, row: int) -> NDArray[Any]:
        number = self.numbers[row]
        last = int(np.searchsorted(self.at, number, side="right")) - 1
        if last < 0 or not (self.lasting or self.at[last] == number):
            return self.values[:0]
        return self.values[self.ends[last - 1] if last else 0 : self.ends[last]]

    def recorded(self) -> NDArray[np.int64]:
        """The rows from which on an array is another recorded one than before."""
        rows = np.unique(np.searchsorted(self.numbers, self.at))
        return rows[rows < len(self.numbers)]


@dataclass(frozen=True, slots=True)
class Ends:
    """The states as operations ended and parts changed hands, before the engine continued, in the
    order of time: each between the ticks `row` - 1 and `row`; other fields as in `Log`."""

    row: NDArray[np.int64] = field(repr=False)
    time: NDArray[np.float64] = field(repr=False)
    qpos: StateRows = field(repr=False)
    qvel: StateRows = field(repr=False)
    ctrl: StateRows = field(repr=False)
    active: Ragged = field(repr=False)


@dataclass(frozen=True)
class Log:
    """The content of a log: locked arrays over n ticks, the first before the run began.

    `marking[i]`: numbers of the marked places; `active[i]` (k, 3): active constraints, and the two
    bodies each joins; `contacts[i]` (k, 2) geoms, `distances[i]` (k,) [m]; `fired` and `fired_t`:
    transitions by number and time [s]. `ctrl`: the setpoints; None in the ideal world. `complete`:
    whether the file was closed properly; `cut_off`: the early end of the run or the log, None where
    all units were made and logged. `ends`: the states as operations ended, and `figures` of the
    bodies, from `kept_figures`; None in the ideal world. `undone`: each undo with the number of
    transitions that had fired before it. `failures`: of a run that recovers from them; where it was
    killed, those up to the last detection. `units`: those of the net that are made, of a run on
    demand, and last of how many units that is known.
    """

    header: Mapping[str, Any] = field(repr=False)
    xml: str = field(repr=False)
    files: Mapping[str, bytes] = field(repr=False)
    time: NDArray[np.float64] = field(repr=False)
    delivered: Index = field(repr=False)
    qpos: StateRows = field(repr=False)
    qvel: StateRows = field(repr=False)
    marking: Ragged = field(repr=False)
    active: Ragged = field(repr=False)
    contacts: Ragged = field(repr=False)
    distances: Ragged = field(repr=False)
    fired: Index = field(repr=False)
    fired_t: NDArray[np.float64] = field(repr=False)
    ctrl: StateRows | None = field(default=None, repr=False)
    complete: bool = True
    cut_off: CutOff | None = None
    ends: Ends | None = field(default=None, repr=False)
    figures: Mapping[str, Any] | None = field(default=None, repr=False)
    undone: tuple[Placed, ...] = field(default=(), repr=False)
    failures: Failures | None = field(default=None, repr=False)
    units: tuple[int, ...] | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.time)

    def row_at(self, time: float) -> int:
        """The first row from a time on [s], up to rounding; len(self) after the last."""
        return int(np.searchsorted(self.time, time - ROUNDING))

    @cached_property
    def events(self) -> tuple[tuple[float, str], ...]:
        """Time [s] and name of every transition that fired."""
        names = self.header["transitions"]
        return tuple((t, names[n]) for t, n in zip(self.fired_t.tolist(), self.fired, strict=True))

    @cached_property
    def timed_entries(self) -> tuple[tuple[float, str | Undone], ...]:
        """Time [s] and name of every transition that fired, with the undos in between."""
        entries, begin = list[tuple[float, str | Undone]](), 0
        for after, undone in self.undone:
            entries += [*self.events[begin:after], (undone.t, undone)]
            begin = after
        return (*entries, *self.events[begin:])

    @property
    def entries(self) -> tuple[str | Undone, ...]:
        """The timed entries without their times, for a replay."""
        return tuple(entry for _, entry in self.timed_entries)

    @cached_property
    def lasting(self) -> tuple[tuple[float, str], ...]:
        """Time [s] and name of every transition that fired and was not undone."""
        if not self.undone:
            return self.events
        kept, entries = Undone.lasting(self.entries), self.timed_entries
        return tuple((t, e) for t, e in (entries[at] for at in kept) if isinstance(e, str))


def read_log(path: Path | str) -> Log:
    """The log in a file, whole or cut off. Raises InputError (BadLog) where it is not a log."""
    path = Path(path)
    try:
        written, data = is_claimed(path), content_of(path, RECORD)
    except OSError as error:
        raise InputError(bad_log(path, f"cannot be read: {error.strerror}")) from error
    check_magic(path, data)
    try:
        return log_in(data, written)
    except MemoryError as error:
        raise InputError(bad_log(path, f"takes more memory than there is: {error}")) from error
    except UnicodeDecodeError as error:
        raise InputError(bad_log(path, "is damaged: a text in it is not UTF-8")) from error
    except (ValueError, KeyError, IndexError, TypeError, OverflowError, RecursionError) as error:
        raise InputError(bad_log(path, f"is damaged: {misfit(error)}")) from error


def is_log(path: Path | str) -> bool:
    """Whether a file begins as a log does."""
    return head_of(Path(path), len(LOG)) == LOG


def digest_of(header: Mapping[str, Any]) -> str:
    """The digest of a header, which the last block of its log repeats."""
    return sha256(json.dumps(dict(header), sort_keys=True).encode()).hexdigest()


def header_in(data: Content) -> tuple[dict[str, Any], int]:
    """The header of a log, and the byte at which its blocks begin. Raises ValueError where it is
    not a valid header."""
    begin = len(MAGIC) + LENGTH.size
    kept = begin + (LENGTH.unpack(data[len(MAGIC) : begin])[0] if begin <= len(data) else 0)
    if kept > len(data) or begin > len(data):
        raise ValueError(f"it ends in its header, at byte {len(data)}")
    header = json.loads(data[begin:kept])
    check_header(header)
    return header, kept


def log_in(data: Content, written: bool = False) -> Log:
    """The log in the bytes of a file; `written`: its run is still in progress. Raises ValueError,
    KeyError, IndexError, TypeError, OverflowError or RecursionError where it is not a log."""
    header, kept = header_in(data)
    xml, files, complete = "", {}, False
    trouble: Arrays = {}
    ticks: list[Arrays] = []
    begins, wide = list[int](), None
    for kind, arrays, end in blocks(data, kept):
        if kind == b"M":
            xml = arrays["xml"].tobytes().decode()
            files = {k[5:]: a.tobytes() for k, a in arrays.items() if k.startswith("mesh/")}
        elif kind == b"T":
            check_block(arrays, header)
            wide = len(arrays["ctrl_first"]) if "ctrl_first" in arrays else None
            if state_bytes(arrays) > WIDEST:
                raise ValueError("the states in a block of it take too much memory")
            ticks.append(without_states(arrays))
            begins.append(kept)
        complete, kept = kind == b"E", end
        trouble = arrays if complete else {}
    counts = [len(a["time"]) for a in ticks]
    time, delivered = _joined("time", ticks, np.float64), _joined("delivered", ticks, np.int32)
    check_course(time, delivered)
    why = ("", "")
    if not complete:
        why = "BadLog", _broken(data, kept, written)
    elif "code" in trouble:
        why = trouble["code"].tobytes().decode(), trouble["message"].tobytes().decode()
    made, units = int(delivered[-1]) if len(time) else 0, header["units"]
    last = float(time[-1]) if len(time) else 0.0
    cut = made < units or any(why)
    at_end = _at_end(ticks, counts)
    ended, numbers = np.flatnonzero(at_end), np.flatnonzero(~at_end)
    unpacking = Unpacking(data, begins, counts)

    def states(name: str, width: int) -> tuple[StateRows, StateRows]:
        """The rows of a state, those that are ends of operations apart."""
        rows = (StoredRows(unpacking, name, width, each) for each in (numbers, ended))
        return next(rows), next(rows)

    (qpos, qpos_ended), (qvel, qvel_ended) = (
        states("qpos", header["nq"]),
        states("qvel", header["nv"]),
    )
    ctrl, ctrl_ended = (None, None) if wide is None else states("ctrl", wide)
    active = _ragged("active", ticks, numbers)
    contacts = _ragged("contact", ticks, numbers, lasting=False)
    return Log(
        MappingProxyType(header),
        xml,
        MappingProxyType(files),
        locked(time[numbers]),
        locked(delivered[numbers]),
        qpos,
        qvel,
        _ragged("marking", ticks, numbers),
        active,
        contacts,
        replace(contacts, values=_joined("contact_dist", ticks, np.float64)),
        _joined("fired", ticks, np.int32),
        _joined("fired_t", ticks, np.float64),
        ctrl,
        complete,
        CutOff(last, made, units, *why) if cut else None,
        None
        if ctrl_ended is None
        else Ends(
            ended - np.arange(len(ended)),
            time[ended],
            qpos_ended,
            qvel_ended,
            ctrl_ended,
            replace(active, numbers=ended),
        ),
        _figures(trouble["figures"]) if "figures" in trouble else None,
        undone_in(ticks, header),
        _failures(trouble, ticks, header),
        next((tuple(a["units"].tolist()) for a in reversed(ticks) if "units" in a), None),
    )


def _at_end(ticks: Sequence[Arrays], counts: Sequence[int]) -> NDArray[np.bool_]:
    """Whether each row is the end of an operation, not a tick."""
    at_end = np.zeros(sum(counts), bool)
    for arrays, base in zip(ticks, np.cumsum([0, *counts]), strict=False):
        at_end[base + arrays["ended_at"]] = True
    return at_end


def _figures(content: NDArray[Any]) -> Mapping[str, Any]:
    """The figures in the last block. Raises ValueError where they are not valid."""
    figures = json.loads(content.tobytes())
    check_figures(figures)
    return MappingProxyType(figures)


def _failures(end: Arrays, ticks: Sequence[Arrays], header: Mapping[str, Any]) -> Failures | None:
    """All failures, from the last block, or those up to the end of a log that lacks it."""
    robots = frozenset(header["robots"])
    if "failures" in end:
        return failures_of(json.loads(end["failures"].tobytes()), robots)
    return failures_so_far(ticks, robots)


def _broken(data: Content, kept: int, written: bool) -> str:
    """The reason why a file that was read up to byte `kept` lacks its last block."""
    if written:
        return f"its run is still in progress, and has written {kept} bytes"
    if kept == len(data):
        return f"its run was killed: the log ends at byte {kept} and was not closed"
    if is_cut(data, kept):
        return f"the log ends at byte {len(data)}, within the block that begins at byte {kept}"
    return f"the log is damaged in the block that begins at byte {kept} of {len(data)}"


def _joined(name: str, ticks: Sequence[Arrays], kind: Any) -> Any:
    return locked(np.concatenate([np.zeros(0, kind), *(a[name] for a in ticks)]))


def _ragged(
    name: str, ticks: Sequence[Arrays], numbers: NDArray[np.int64], lasting: bool = True
) -> Ragged:
    """The arrays of that name at the rows `numbers`. Raises ValueError where the first row lacks
    one that lasts."""
    base = np.cumsum([0, *(len(a["time"]) for a in ticks)])
    rows = [a[f"{name}_at"] + first for a, first in zip(ticks, base, strict=False)]
    at = np.concatenate([np.zeros(0, np.int64), *rows])
    if lasting and at[:1].any():
        raise ValueError(f"the first tick has no {name}")
    counts = np.concatenate([np.zeros(0, np.int64), *(a[f"{name}_count"] for a in ticks)])
    values = np.concatenate([a[name] for a in ticks]) if ticks else np.zeros(0, np.int32)
    return Ragged(locked(values), at, np.cumsum(counts), numbers, lasting)
