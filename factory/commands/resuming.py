"""Opening the log of a run that is gone on with: `run --resume LOG`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.commands.given import for_a_pag
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.simulation.resuming import Resumed

ALLOWED = ("resume", "max_time", "lenient", "monitor")
"""The options of `run` that a run can be gone on with."""


def resumed(file: Path, max_time: float | None, out: OutputOptions) -> Resumed | None:
    """The run in a log, to be gone on with until `max_time` [s]; how far it came is said. None for
    one that has made its units: there is nothing to be done, and that is said."""
    from factory.record.ending import CutOff
    from factory.simulation.resuming import resume

    for_a_pag(file, "a log", *ALLOWED)
    with Waiting("reading the log and rebuilding its simulation", out.silent):
        found = resume(file, max_time)
    if isinstance(found, CutOff):
        if out.as_json:
            emit({"log": str(file), "units": found.units, "products": found.products})
        else:
            say(f"'{file}' is complete, {found.products} of {found.units} units: nothing to resume")
        return None
    if not out.silent:
        say(f"'{file}' is {found.came}; the run is repeated up to there, then continued")
    return found
