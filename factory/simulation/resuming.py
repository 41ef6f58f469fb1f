"""Going on with a run that was cut off, from its log: the simulation is made again from the header,
and takes up the last checkpoint. What the log has after that is cut off, and made again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from io import FileIO
from os import SEEK_END
from pathlib import Path

from factory.pipeline import Project
from factory.record.ending import CutOff
from factory.record.log import LogWriter
from factory.record.log.blocks import bad_log
from factory.record.log.kept import BROKEN, KeptRun, kept_run
from factory.record.log.writer import packed, versions
from factory.record.project_table import check_names, of_its_factory, project_of
from factory.simulation.checkpoint import checkpoint, take_up
from factory.simulation.recovery.faults import campaign_of
from factory.simulation.recovery.recovery import recover
from factory.simulation.remade import request_of
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.support.claim import claimed_again
from factory.support.errors import Diagnostic, InputError
from factory.support.files import AGAIN
from factory.support.settings import AUTO

IN_ITSELF = ("Stalled", "Dropped", "Unstable", "Failed")
"""What ends a run that would end in the same way if it went on."""

TRIES = 3
"""So many checkpoints are tried at most, the last one first."""


@dataclass(frozen=True)
class Resumed:
    """A run that goes on: its `project`, its `simulation` at `time` [s] as it was then, and its
    claimed log, cut off there; `skipped`: what is wrong with later checkpoints."""

    path: Path
    project: Project = field(repr=False)
    simulation: Simulation = field(repr=False)
    file: FileIO = field(repr=False)
    skipped: tuple[Diagnostic, ...] = ()

    @property
    def came(self) -> CutOff:
        """How far the run has come."""
        made = self.simulation
        done = made.world.delivered() - made.before
        return CutOff(made.world.time, done, made.request.units)

    def writer(self) -> LogWriter:
        """Writes the log on."""
        made = self.simulation
        return LogWriter(
            self.path,
            made,
            self.project,
            checkpoint=lambda: checkpoint(made),
            going_on=self.file,
        )

    @contextmanager
    def trusted(self) -> Iterator[None]:
        """Raises InputError (BadLog) for errors of a run whose checkpoint was not what it should
        have been, and was not seen to be."""
        at = float(self.simulation.world.time)
        try:
            yield
        except BROKEN as error:
            words = f"went on from {at:.2f} s, where its checkpoint contradicts its run: {error!r}"
            raise InputError(_bad(self.path, words)) from error


def resume(path: Path) -> Resumed | CutOff:
    """The run in a log, to be gone on with; how far it came, where it has made its units. The log
    is as it was where an error is raised.

    Raises InputError: BadLog where it is no log, or none to go on from, BadFile where another run
    writes it; that of its PAG or its meshes where these cannot be read.
    """
    try:
        if not path.is_file():
            raise InputError(bad_log(path, "is no file"))
        file = claimed_again(path)
    except OSError as error:
        raise InputError(bad_log(path, f"cannot be written: {error.strerror}")) from error
    try:
        kept = kept_run(path)
        if (done := _done(kept)) is not None:
            file.close()
            return done
        _check(kept)
        with of_its_factory():
            project = project_of(kept.header, path.parent)
            request = request_of(kept.header)
        simulation, end, skipped = _going_on(kept, project, request)
        file.truncate(end)
        file.seek(0, SEEK_END)
    except BaseException:
        file.close()
        raise
    return Resumed(path, project, simulation, file, skipped)


def _done(kept: KeptRun) -> CutOff | None:
    """How far a run came that is at its end, None for others. Raises InputError where it ended by
    itself before its units were made."""
    log = kept.whole
    if log is None or not log.complete:
        return None
    cut = log.cut_off
    if cut is None:
        return CutOff(float(log.time[-1]), int(log.delivered[-1]), log.header["units"])
    if cut.code in IN_ITSELF:
        words = f"is of a run that would end again as it did: {cut.told}"
        raise InputError(_bad(kept.path, words, "mend what ended it, and run it again"))
    return None


def _check(kept: KeptRun) -> None:
    """Raises InputError (BadLog) where a run cannot be gone on with."""
    header, now = kept.header, versions()
    if header["distributed"]:
        words = "is of a run with --distributed, which has no checkpoints to go on from"
        raise InputError(_bad(kept.path, words, "leave out --distributed"))
    lacks = kept.ticks > 1 and not kept.checkpoints and "faults" not in header
    if lacks:
        raise InputError(_bad(kept.path, "has no checkpoints to go on from", AGAIN))
    for package in ("klavins-factory", "mujoco"):
        then, here = header["versions"].get(package, ""), now.get(package, "")
        if then != here:
            words = f"was kept with {package} {then or 'unknown'}, and this is {here}"
            raise InputError(_bad(kept.path, words, f"install {package} {then}, or {AGAIN}"))


def _asked(request: RunRequest, timestep: bool, wip: bool) -> RunRequest:
    """The request as it was before timestep and wip were chosen for it, where they were."""
    settings = replace(request.settings, timestep=AUTO) if timestep else request.settings
    return replace(request, settings=settings, wip=None if wip else request.wip)


def _going_on(
    kept: KeptRun, project: Project, request: RunRequest
) -> tuple[Simulation, int, tuple[Diagnostic, ...]]:
    """The simulation at the last checkpoint that is good, the byte after that, and what is wrong
    with later ones; where the run had come to none, at its beginning."""
    if not kept.checkpoints:
        return _made(kept, project, request), kept.begin, ()
    skipped: list[Diagnostic] = []
    for end, state in kept.checkpoints[: -TRIES - 1 : -1]:
        simulation = _made(kept, project, request)
        try:
            take_up(simulation, state, kept.until(end))
        except BROKEN as error:
            words = f"has a bad checkpoint before byte {end}: {error}"
            skipped.append(_bad(kept.path, words, AGAIN))
            continue
        return simulation, end, tuple(skipped)
    raise InputError(skipped)


def _made(kept: KeptRun, project: Project, request: RunRequest) -> Simulation:
    """The simulation at the beginning. Raises InputError where it is not that of the log."""
    header = kept.header
    with of_its_factory():
        made = Simulation(project.layout, request)
        made.asked = _asked(request, **header["chosen"])
        if request.recovers:
            recover(made, campaign_of(header["faults"]))
        check_names(made.layout.factory, header)
    if {k: a.tobytes() for k, a in (kept.model or {}).items()} != packed(made.model):
        raise InputError(_bad(kept.path, "is of another model than its PAG gives now", AGAIN))
    return made


def _bad(path: Path, words: str, hint: str = AGAIN) -> Diagnostic:
    return Diagnostic("BadLog", f"'{path}' {words}", None, hint)
