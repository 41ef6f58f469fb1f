"""One run of a project as asked for: logged, filmed, recovering, watched by a monitor, judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from factory.api import Factory, Run, Simulation, proved
from factory.apps.deviations.campaign import SWAP, Campaign
from factory.apps.deviations.campaign_file import read_campaign
from factory.apps.runs.executing import Go, Opening, Tell, carry_out
from factory.apps.runs.options import RunOptions
from factory.apps.runs.watched import watched
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.api import Project, Recorder

Filming = Callable[[Simulation], "Recorder"]
"""Opens the film of a simulation."""


def check_run(project: Project, asked: RunOptions) -> None:
    """Raises InputError where a run cannot be made of a project as `asked`; nothing is laid
    out for that. Files are read, but for pipes, which are read once."""
    asked.check(project)
    values = {"--faults": asked.faults is not None, "--spares": asked.spares > 0}
    if options := [option for option, is_asked in values.items() if is_asked]:
        project.compiled.check_rails(*options)
    if asked.faults is not None and not asked.faults.is_fifo():
        read_campaign(asked.faults, has_bodies=asked.world != "ideal")


def campaign_of(asked: RunOptions, factory: Factory) -> Campaign:
    """The deviations and the spares of a run of a factory. Raises InputError."""
    swap = SWAP if asked.swap is None else asked.swap
    if asked.faults is None:
        return Campaign(seed=asked.seed, spares=asked.spares, swap=swap)
    has_bodies = asked.world != "ideal"
    return read_campaign(asked.faults, asked.spares, swap, factory, has_bodies)


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
            from factory.apps.recovery import recover

            recover(made, campaign_of(asked, project.layout.factory))
    recorders: list[Opening] = []
    if log is not None:
        from factory.apps.log import LogWriter

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
    record = carry_out(made, silent, asked.max_time, recorders, _going(monitor), log, progress)
    account = made.world.hooks.account
    failures = None if account is None else account.report()
    if failures is not None and log is not None and monitor is not False and made.model is not None:
        from factory.apps.log import read_log
        from factory.apps.monitor.record import watch_log

        with Waiting("judging the run between failures", silent):
            record = replace(record, monitor=watch_log(read_log(log))[0])
    record = replace(record, lenient=asked.lenient, strict=asked.strict)
    return replace(record, failures=failures, log=log)


def _going(monitor: bool | None) -> Go:
    """How a run goes with a monitor of every tick, of events where None, or with none."""
    return Simulation.run if monitor is False else partial(watched, every_tick=bool(monitor))
