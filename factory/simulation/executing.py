"""Carries out a run with its recorders, progress bar, monitor and verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from factory.nets.verify import proved
from factory.record.ending import CutOff
from factory.simulation.options import RunOptions
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation
from factory.simulation.watched import watched
from factory.support.errors import Diagnostic, StoppedError
from factory.support.interruption import Interruption
from factory.support.progress import Progress, Waiting

if TYPE_CHECKING:
    from factory.pipeline import Project
    from factory.record.state import Observer, Recorder

Opening = Callable[[], "Recorder"]
"""Opens a recorder of a run, such as a log, as a context."""

Filming = Callable[[Simulation], "Recorder"]
"""Opens the film of a simulation."""

Tell = Callable[[float, int], None]
"""Is told the simulated time [s] and the number of units made so far."""


def run_project(
    project: Project,
    asked: RunOptions,
    silent: bool,
    log: Path | None = None,
    film: Filming | None = None,
    monitor: bool | None = None,
    progress: Tell | None = None,
) -> Run:
    """One run of a project as `asked`, with a `log` and a `film` where given. `silent`: no progress
    bar; `monitor`: True to observe every tick, False for none, None to observe events; `progress`
    is called from time to time. Raises InputError, RunError (NotProved), and StoppedError as
    `carry_out`."""
    proved(project.factory.net)
    seen = log is not None or film is not None
    with Waiting("compiling the model", silent):
        made = Simulation(project.layout, asked.request(project, seen))
        if asked.recovers:
            from factory.simulation.recovery import recover

            recover(made, asked.campaign(project.layout.factory))
    recorders: list[Opening] = []
    if log is not None:
        from factory.record.log import LogWriter

        recorders.append(lambda: LogWriter(log, made, project))
    if film is not None:
        recorders.append(lambda: film(made))
    return carry_on(made, asked, silent, log, recorders, monitor, progress)


def carry_on(
    made: Simulation,
    asked: RunOptions,
    silent: bool,
    log: Path | None,
    recorders: Sequence[Opening],
    monitor: bool | None,
    progress: Tell | None = None,
) -> Run:
    """Carry a simulation out from its present state, as `run_project` does, and judge it; a run
    with recovery is judged from its log."""
    record = carry_out(made, silent, asked.max_time, recorders, monitor, log, progress)
    account = made.world.hooks.account
    failures = None if account is None else account.report()
    if failures is not None and log is not None and monitor is not False and made.model is not None:
        from factory.record.log import read_log
        from factory.record.monitor.record import watch_log

        with Waiting("judging the run between failures", silent):
            record = replace(record, monitor=watch_log(read_log(log))[0])
    record = replace(record, lenient=asked.lenient, strict=asked.strict)
    return replace(record, failures=failures, log=log)


def carry_out(
    made: Simulation,
    silent: bool,
    max_time: float | None = None,
    recorders: Sequence[Opening] = (),
    monitor: bool | None = None,
    log: Path | None = None,
    progress: Tell | None = None,
) -> Run:
    """Run, with a progress bar unless `silent`; `progress` is called from time to time. A signal
    stops the run at the end of a tick, so that the recorders' files are complete; StoppedError then
    says how far it came and how to continue it from a `log`. Recorders observe every tick only from
    their `since` on."""
    since = 0.0
    try:
        with Interruption() as stop, ExitStack() as stack:
            opened = [stack.enter_context(recorder()) for recorder in recorders]
            since = max((recorder.since for recorder in opened), default=0.0)
            bar = stack.enter_context(Progress(made.request.units, silent, made.duration))
            seeing = [r.observe for r in opened]
            glances: list[Observer] = [stop.observe, bar.observe]
            if progress is not None:
                glances.append(lambda state: progress(state.time, state.made))
            if monitor is False:
                record = made.run(seeing, max_time, glances, since)
            else:
                record = watched(made, seeing, max_time, glances, bool(monitor), since)
            for recorder in opened:
                recorder.end(record.trouble)
        stop.observe()  # a signal while the recorders finish their files
        return record
    except KeyboardInterrupt as error:
        came = CutOff(made.world.time, made.world.delivered() - made.before, made.request.units)
        message = f"stopped by the user, {came}"
        if made.world.time < since:
            message = f"stopped by the user before {since:.2f} s, so '{log}' is as it was"
        hint = f"log: {log}; continue: factory run --resume {quote(str(log))}" if log else ""
        raise StoppedError(Diagnostic("Interrupted", message, None, hint)) from error
