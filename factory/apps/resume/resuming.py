"""Resuming an interrupted run from its log: the simulation is built from the log's header, repeats
the logged part to the last bit, and goes on from there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from io import FileIO
from pathlib import Path

from factory.api import CutOff, Diagnostic, InputError, Project, RunRequest, Simulation
from factory.apps.deviations.campaign import campaign_of
from factory.apps.log.blocks import bad_log
from factory.apps.log.content import AGAIN, RECORD, content_of
from factory.apps.log.project_table import check_names, of_its_factory, project_of
from factory.apps.log.reader import Log, read_log
from factory.apps.log.writer import rows_of_a_block, versions
from factory.apps.recovery.recovery import recover
from factory.apps.resume.continued import Continued, last_full
from factory.apps.resume.remade import request_of
from factory.support.claim import claimed_again

IN_ITSELF = ("Stalled", "Dropped", "Unstable", "Failed")
"""What ends a run that would end in the same way if it went on."""


@dataclass(frozen=True)
class Resumed:
    """A resumed run: its `simulation`, not yet started, and its `log`, locked as `file`. The log is
    kept up to the byte `end`, at time `since` [s]."""

    path: Path
    simulation: Simulation = field(repr=False)
    log: Log = field(repr=False)
    file: FileIO = field(repr=False)
    end: int
    since: float

    @property
    def came(self) -> CutOff:
        """How far the logged run had come."""
        log, row = self.log, self.log.row_at(self.since)
        made = int(log.delivered[row]) if row < len(log) else 0
        return CutOff(self.since, made, log.header["units"])

    def recorder(self) -> Continued:
        """Compares the simulation with the log, then appends to it."""
        return Continued(self.simulation, self.log, self.file, self.end, self.since)


def resume(path: Path, max_time: float | None = None) -> Resumed | CutOff:
    """The run in a log, to be gone on with until `max_time` [s] at most; how far it came, where it
    has made its units. The log is as it was where an error is raised.

    Raises InputError: BadLog where it is no log, or none to go on from, BadFile where another run
    writes it, Usage where the run has come to `max_time` already; that of its PAG or its meshes
    where these cannot be read.
    """
    try:
        if not path.is_file():
            raise InputError(bad_log(path, "is no file"))
        file = claimed_again(path)
    except OSError as error:
        raise InputError(bad_log(path, f"cannot be written: {error.strerror}")) from error
    try:
        log = read_log(path)
        if (done := _done(path, log)) is not None:
            file.close()
            return done
        _check(path, log, max_time)
        with of_its_factory():
            project, request = project_of(log.header, path.parent), request_of(log.header)
        simulation = _made(path, log, project, request)
        rows = rows_of_a_block(request.settings.tick)
        end, since = last_full(content_of(path, RECORD), rows)
    except BaseException:
        file.close()
        raise
    return Resumed(path, simulation, log, file, end, since)


def _done(path: Path, log: Log) -> CutOff | None:
    """How far a completed run came; None for others. Raises InputError if it ended by itself before
    its units were made."""
    if not log.complete:
        return None
    cut = log.cut_off
    if cut is None:
        return CutOff(float(log.time[-1]), int(log.delivered[-1]), log.header["units"])
    if cut.code in IN_ITSELF:
        words = f"is of a run that would end again as it did: {cut.with_cause}"
        raise InputError(_bad(path, words, "mend what ended it, and run it again"))
    return None


def _check(path: Path, log: Log, max_time: float | None) -> None:
    """Raises InputError if a run cannot be resumed."""
    header, now, last = log.header, versions(), float(log.time[-1]) if len(log) else 0.0
    for package in ("klavins-factory", "mujoco"):
        then, here = header["versions"].get(package, ""), now.get(package, "")
        if then != here:
            words = f"was kept with {package} {then or 'unknown'}, and this is {here}"
            raise InputError(_bad(path, words, f"install {package} {then}, or {AGAIN}"))
    if not log.xml and header["world"] != "ideal":
        raise InputError(_bad(path, "is cut off in its model, before its run begins"))
    if max_time is not None and max_time <= last:
        message = f"'{path}' has come to {last:.2f} s, and --max-time is {max_time:g} s"
        raise InputError(Diagnostic("Usage", message, None, "give a later time, or leave it out"))


def _asked(request: RunRequest, timestep: bool, wip: bool) -> RunRequest:
    """The request before timestep and wip were chosen for it."""
    settings = replace(request.settings, timestep="auto") if timestep else request.settings
    return replace(request, settings=settings, wip=None if wip else request.wip)


def _made(path: Path, log: Log, project: Project, request: RunRequest) -> Simulation:
    """The simulation at its start. Raises InputError if it is not that of the log."""
    header = log.header
    with of_its_factory():
        made = Simulation(project.layout, request)
        made.asked = _asked(request, **header["chosen"])
        if request.recovers:
            recover(made, campaign_of(header["faults"]))
        check_names(made.layout.factory, header)
    if made.model is not None and (made.model.xml, {**made.model.files}) != (log.xml, log.files):
        raise InputError(_bad(path, "is of another model than its PAG gives now"))
    return made


def _bad(path: Path, words: str, hint: str = AGAIN) -> Diagnostic:
    return Diagnostic("BadLog", f"'{path}' {words}", None, hint)
