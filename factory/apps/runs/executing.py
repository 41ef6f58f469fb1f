"""Carries out a run with its recorders and a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from factory.api import CutOff, Diagnostic, Run, Simulation
from factory.support.errors import StoppedError
from factory.support.interruption import Interruption
from factory.support.progress import Progress

if TYPE_CHECKING:
    from factory.api import Observer, Recorder

Opening = Callable[[], "Recorder"]
"""Opens a recorder of a run, such as a log, as a context."""

Go = Callable[[Simulation, "Sequence[Observer]", "float | None", "Sequence[Observer]", float], Run]
"""Lets a simulation run, as `Simulation.run`, with more that looks at it or without."""

Tell = Callable[[float, int], None]
"""Is told the simulated time [s] and the number of units made so far."""


def carry_out(
    made: Simulation,
    silent: bool,
    max_time: float | None = None,
    recorders: Sequence[Opening] = (),
    go: Go = Simulation.run,
    log: Path | None = None,
    progress: Tell | None = None,
) -> Run:
    """Let a run `go`, with a progress bar unless `silent`; `progress` is called from time to time.
    A signal stops the run at the end of a tick, so that the recorders' files are complete;
    StoppedError then says how far it came and how to continue it from a `log`. Recorders observe
    every tick only from their `since` on."""
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
            record = go(made, seeing, max_time, glances, since)
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
