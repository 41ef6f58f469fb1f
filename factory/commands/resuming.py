"""Opening the log of a run that is continued: `run --resume LOG`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.commands.outputs import for_a_pag
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.apps.resume.resuming import Resumed

ALLOWED = ("resume", "max_time", "lenient", "strict", "monitor")
"""The options of `run` that go with --resume."""


def resumed(file: Path, max_time: float | None, out: OutputOptions) -> Resumed | None:
    """The run in a log, to be continued until `max_time` [s]; prints how far it came. None, with a
    message, for a run that has made its units."""
    from factory.apps.resume.resuming import resume
    from factory.engine.record.ending import CutOff

    for_a_pag(file, "a log", *ALLOWED)
    with Waiting("reading the log and rebuilding its simulation", out.silent):
        run = resume(file, max_time)
    if isinstance(run, CutOff):
        if out.as_json:
            emit({"log": str(file), "units": run.units, "products": run.products})
        else:
            say(f"'{file}' is complete, {run.products} of {run.units} units: nothing to resume")
        return None
    if not out.silent:
        say(f"'{file}' is {run.came}; the run is repeated up to there, then continued")
    return run
