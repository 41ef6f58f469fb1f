"""The subject of a report: a log with its motion, its factory and, where it can be reproduced, its
layout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from factory.api import (
    Diagnostic,
    Factory,
    InputError,
    Layout,
    MonitorSubject,
    Operation,
    Report,
    RunError,
    RunVerdict,
)
from factory.apps.analyze.measured import conditions
from factory.apps.exports.motion import BodyMotion, motion_of
from factory.apps.log import Log, read_log
from factory.apps.log.project_table import factory_of, project_of
from factory.apps.monitor.record import verdict_on, watch_log
from factory.apps.report.scene import DrawnFactory, drawn, stations
from factory.apps.resume.remade import forged, model_faults
from factory.support.arrays import Array
from factory.support.tables import misfit


@dataclass(frozen=True)
class Recording:
    """A recorded run. Predictions follow from `layout`; `missing`: the reason where it is None.
    `faults` of its model."""

    file: str
    log: Log = field(repr=False)
    motion: BodyMotion = field(repr=False)
    factory: Factory = field(repr=False)
    layout: Layout | None = field(default=None, repr=False)
    missing: str = ""
    faults: tuple[Diagnostic, ...] = ()

    @property
    def name(self) -> str:
        """The name of the product."""
        return str(self.log.header["product"])

    @property
    def start(self) -> tuple[int, ...]:
        """The places that are marked when the run begins."""
        return tuple(self.log.header["start"])

    @property
    def from_start(self) -> bool:
        """Whether that is the net's initial marking."""
        return frozenset(self.start) == self.factory.net.initial_marking

    @property
    def end(self) -> float:
        """When the run ended [s]."""
        return float(self.log.time[-1])

    @cached_property
    def monitor(self) -> Report | None:
        """The report of a monitor on the log; None where the log has no states for it, or is not
        that of its PAG."""
        if forged(self.faults):
            return None
        try:
            return watch_log(self.log)[0]
        except InputError:
            return None

    @cached_property
    def verdict(self) -> RunVerdict:
        """Whether the run succeeded."""
        return verdict_on(self.log, self.factory, self.monitor, self.faults)

    @cached_property
    def stage(self) -> DrawnFactory:
        """The drawable data."""
        m, seen = self.motion.m, self.motion
        return DrawnFactory(
            self.factory,
            m,
            seen.position[0],
            seen.quaternion[0],
            np.stack([seen.position.min(axis=0), seen.position.max(axis=0)]),
            self.log.header["monitor"]["places"],
            stations(self.factory, m, self._ends()),
            drawn(m, self.log.xml, self.log.files),
        )

    def _ends(self) -> Iterator[tuple[Operation, Array]]:
        """The state as each operation ends for the first time, of those that do."""
        log = self.log
        ends = {int(t): n for n, t in reversed([*enumerate(log.fired.tolist())])}
        for operation in self.factory.operations:
            event = ends.get(operation.end)
            if event is not None:
                row = log.row_at(log.fired_t[event])
                yield operation, log.qpos[min(row, len(log) - 1)]


def recording_of(path: Path, layout: Layout | None = None) -> Recording:
    """The recording in a log, with the `layout` that it was made with, if given, else with one that
    is made again. Raises InputError (BadLog) where it is not a log of a run in MuJoCo."""
    log, missing, faults = read_log(path), "", tuple[Diagnostic, ...]()
    motion, factory = motion_of(log), factory_of(log.header)
    if layout is None:
        try:
            layout = _laid_out(log, path.parent)
        except (InputError, RunError) as error:
            missing = error.diagnostics[0].message
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            missing = misfit(error)
        faults, _ = model_faults(log, path.parent, layout)
    factory = layout.factory if layout else factory
    return Recording(str(path), log, motion, factory, layout, missing, faults)


def _laid_out(log: Log, beside: Path) -> Layout:
    """The layout of a log in the folder `beside`, made again. Raises InputError where meshes are
    missing, RunError where the floor is too small, ValueError where the run was in another
    layout."""
    header, made = log.header, conditions(log.header)
    layout = project_of(header, beside).layout
    goals = MonitorSubject.of(layout, made.settings, made.jitter, None, made.wip).as_json()["goals"]
    if goals != header["monitor"]["goals"]:
        raise ValueError("the run was in another layout than the one its PAG gets now")
    return layout
