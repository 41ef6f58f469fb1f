"""Checks of a log that is read: the values of its header, the arrays of its blocks of ticks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Demand, LayoutTable, MonitorTable, RunVerdict, WorldName
from factory.apps.log.blocks import Arrays
from factory.apps.log.cell_table import CellTable
from factory.apps.log.project_table import ProjectTable
from factory.support.tables import LARGE, value_of

HEADER = "header"
"""The figure that is the digest of the header of a log."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """Whether the timestep and the bound on units inside were chosen for the run."""

    timestep: bool
    wip: bool


@dataclass(frozen=True, slots=True)
class LogHeader(ProjectTable):
    """The header of a log, with the `layout` of the run, or for robots with chains their `cell`,
    which is laid out again. `nq`, `nv`: numbers of positions and speeds of the engine; `start`:
    numbers of the places marked at the start of the run; `faults`: the requested faults, if any;
    others as in a `RunRequest`."""

    nq: int
    nv: int
    versions: Mapping[str, str]
    command: tuple[str, ...]
    world: WorldName
    seed: int
    jitter: float
    units: int
    wip: int | None
    fuse: bool
    chosen: Chosen
    distributed: bool
    start: tuple[int, ...]
    monitor: MonitorTable
    robots: tuple[str, ...]
    places: tuple[str, ...]
    transitions: tuple[str, ...]
    faults: Mapping[str, Any] = field(default_factory=dict)
    demand: Demand | None = None
    layout: LayoutTable | None = None
    cell: CellTable | None = None

    def __post_init__(self) -> None:
        if (self.layout is None) == (self.cell is None):
            raise ValueError("it must have a layout or a cell")
        counts = {"nq": (self.nq, 0), "nv": (self.nv, 0), "units": (self.units, 1)}
        counts |= {"seed": (self.seed, 0), "wip": (self.wip or 1, 1)}
        for name, (count, least) in counts.items():
            if not least <= count or (name != "seed" and count > LARGE):
                raise ValueError(f"{name} must be a whole number from {least}, not {count}")
        if self.wip == 0:
            raise ValueError("wip must be a whole number from 1, or null, not 0")
        if not 0 <= self.jitter < 1:
            raise ValueError(f"jitter must be a number from 0 to less than 1, not {self.jitter}")
        if self.settings.timestep == "auto":
            raise ValueError("settings.timestep must be a number, not auto")
        if not self.monitor.patience > 0:
            raise ValueError(f"monitor.patience must be above 0, not {self.monitor.patience}")
        if not all(0 <= place < len(self.places) for place in self.start):
            raise ValueError(f"start must be numbers of places, below {len(self.places)}")


def check_header(header: Any) -> None:
    """Raises ValueError where a value is missing or impossible."""
    value_of(LogHeader, header, "header")


ARRAYS: Mapping[str, tuple[str, tuple[int, ...]]] = {
    "time": ("<f8", ()),
    "delivered": ("<i4", ()),
    "marking": ("<i4", ()),
    "active": ("<i4", (3,)),
    "contact": ("<i4", (2,)),
    "contact_dist": ("<f8", ()),
    "fired": ("<i4", ()),
    "fired_t": ("<f8", ()),
    "ended_at": ("<i4", ()),
}
"""The type of each array, and the shape of one row."""

RAGGED = ("marking", "active", "contact")
"""Arrays with any number of rows for a tick."""


PAIRS = (("time", "delivered"), ("contact", "contact_dist"), ("fired", "fired_t"))
"""Arrays of equal length."""


def check_block(arrays: Arrays, header: Mapping[str, Any]) -> None:
    """Raises ValueError where the arrays of a block do not fit each other or the header, KeyError
    where one is missing."""
    for name, (kind, row) in ARRAYS.items():
        _check_kind(name, arrays[name], kind, row)
    for one, other in PAIRS:
        if len(arrays[one]) != len(arrays[other]):
            raise ValueError(f"{one} and {other} differ in length")
    count = len(arrays["time"])
    for name, width in (("qpos", header["nq"]), ("qvel", header["nv"]), ("ctrl", None)):
        if width is not None or header["world"] != "ideal" or f"{name}_first" in arrays:
            _check_rows(name, arrays, count, width)
    for name in RAGGED:
        _check_ragged(name, arrays, count)
    _check_range("ended_at", arrays["ended_at"], count - 1)
    _check_range("time", arrays["time"], LARGE)
    _check_range("fired_t", arrays["fired_t"], LARGE)
    _check_range("marking", arrays["marking"], len(header["places"]) - 1)
    _check_range("fired", arrays["fired"], len(header["transitions"]) - 1)


def state_bytes(arrays: Arrays) -> int:
    """Number of bytes of the states of a block."""
    wide = sum(len(arrays.get(f"{name}_first", ())) for name in ("qpos", "qvel", "ctrl"))
    return 8 * wide * len(arrays["time"])


def check_course(time: NDArray[np.float64], delivered: NDArray[np.int32]) -> None:
    """Raises ValueError where time decreases, or products do not leave one by one."""
    if (np.diff(time) < 0).any():
        raise ValueError("its time goes back")
    if not np.isin(np.diff(delivered, prepend=0), (0, 1)).all():
        raise ValueError("its products do not leave one by one")


def _check_kind(name: str, array: NDArray[Any], kind: str, row: tuple[int, ...]) -> None:
    if array.dtype != kind or array.ndim != 1 + len(row) or array.shape[1:] != row:
        shape = ", ".join(["n", *map(str, row)])
        raise ValueError(f"{name} is {array.dtype.str} {array.shape}, not {kind} ({shape})")


def _check_range(name: str, values: NDArray[Any], most: int) -> None:
    if not ((values >= 0) & (values <= most)).all():
        raise ValueError(f"{name} is out of range: not from 0 to {most}")


def _check_rows(name: str, arrays: Arrays, count: int, width: int | None) -> None:
    first, moving = arrays[f"{name}_first"], arrays[f"{name}_moving"]
    planes = arrays[f"{name}_change"]
    _check_kind(f"{name}_first", first, "<f8", ())
    _check_kind(f"{name}_moving", moving, "<i4", ())
    if width is not None and len(first) != width:
        raise ValueError(f"{name} has {len(first)} columns, where its header says {width}")
    _check_range(f"{name}_moving", moving, len(first) - 1)
    if planes.dtype != "|u1" or planes.shape != (8, (count - 1) * len(moving)):
        size = f"{planes.dtype.str} {planes.shape}"
        raise ValueError(f"{name} has {size} for {count} rows of {len(moving)} that change")


def _check_ragged(name: str, arrays: Arrays, count: int) -> None:
    at, counts, values = arrays[f"{name}_at"], arrays[f"{name}_count"], arrays[name]
    _check_kind(f"{name}_at", at, "<i4", ())
    _check_kind(f"{name}_count", counts, "<i4", ())
    _check_range(f"{name}_at", at, count - 1)
    _check_range(f"{name}_count", counts, len(values))
    if len(at) != len(counts) or (np.diff(at) <= 0).any() or counts.sum() != len(values):
        raise ValueError(f"{name} is not what its ticks have")


def check_figures(figures: Any) -> None:
    """Raises ValueError where the figures do not have the form of `kept_figures`, with HEADER."""
    RunVerdict.check_kept_figures(figures)
    if not isinstance(figures.get(HEADER, ""), str):
        raise ValueError(f"its figure '{HEADER}' is not a text")
