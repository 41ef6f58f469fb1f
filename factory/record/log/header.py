"""The header of a log: what its values must be, checked when the log is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from factory.control.profile import World
from factory.layout.hands.hand import Point3
from factory.layout.saved import LayoutTable
from factory.record.project_table import ProjectTable
from factory.support.settings import AUTO
from factory.support.tables import LARGE, value_of


@dataclass(frozen=True, slots=True)
class MonitorTable:
    """What a log has of a `MonitorSubject`, by its names."""

    goals: tuple[tuple[float, ...], ...]
    radii: tuple[float, ...]
    places: Mapping[str, Point3]
    patience: float
    early: tuple[tuple[int, int], ...]
    others: tuple[tuple[int, tuple[int, ...], tuple[float, ...]], ...] = ()


@dataclass(frozen=True, slots=True)
class Chosen:
    """Whether timestep and bound on what is inside were chosen for the run."""

    timestep: bool
    wip: bool


@dataclass(frozen=True, slots=True)
class LogHeader(ProjectTable):
    """What is in the header of a log. `nq`, `nv`: numbers of the engine's positions and speeds;
    `start`: numbers of the places that are marked when the run begins; `faults`: those asked for,
    where there are any; others as in a `RunRequest`."""

    layout: LayoutTable
    nq: int
    nv: int
    versions: Mapping[str, str]
    command: tuple[str, ...]
    world: World
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

    def __post_init__(self) -> None:
        ProjectTable.__post_init__(self)
        counts = {"nq": (self.nq, 0), "nv": (self.nv, 0), "units": (self.units, 1)}
        counts |= {"seed": (self.seed, 0), "wip": (self.wip or 1, 1)}
        for name, (count, least) in counts.items():
            if not least <= count or (name != "seed" and count > LARGE):
                raise ValueError(f"{name} must be a whole number from {least}, not {count}")
        if self.wip == 0:
            raise ValueError("wip must be a whole number from 1, or null, not 0")
        if not 0 <= self.jitter < 1:
            raise ValueError(f"jitter must be a number from 0 to less than 1, not {self.jitter}")
        if self.settings.timestep == AUTO:
            raise ValueError(f"settings.timestep must be a number, not {AUTO}")
        if not self.monitor.patience > 0:
            raise ValueError(f"monitor.patience must be above 0, not {self.monitor.patience}")
        if not all(0 <= place < len(self.places) for place in self.start):
            raise ValueError(f"start must be numbers of places, below {len(self.places)}")


def check_header(header: Any) -> None:
    """Raises ValueError where a value is missing, or no run can have it."""
    value_of(LogHeader, header, "header")
