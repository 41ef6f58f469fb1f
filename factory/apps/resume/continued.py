"""Resuming a log: the run is repeated, compared with the log up to its end, and then appended."""

from __future__ import annotations

from collections.abc import Sequence
from io import FileIO

from factory.api import Diagnostic, Event, InputError, Recordable, Recorder, State, Undone
from factory.apps.log.blocks import blocks
from factory.apps.log.content import AGAIN, Content
from factory.apps.log.reader import Log, header_in
from factory.apps.log.writer import LogWriter

HINT = (
    "the log was changed or comes from another machine, or something took part in its run that a "
    f"log does not keep, such as a push; {AGAIN}"
)


def last_full(data: Content, rows: int) -> tuple[int, float]:
    """End of the last complete block of ticks: its byte and time [s]; the byte after the model and
    0 where there is none. `rows`: least number of rows of a complete block. Raises ValueError where
    the data are not a log."""
    end, time = header_in(data)[1], 0.0
    for kind, arrays, after in blocks(data, end):
        if kind == b"M":
            end = after
        count = len(arrays["time"]) if kind == b"T" else 0
        if count >= rows and count - 1 not in arrays["ended_at"]:
            end, time = after, float(arrays["time"][-1])
    return end, time


class Continued(Recorder):
    """Compares a simulation with its `log` up to the time `since` [s]: its events and, in ticks
    with events and at the end, its positions. Then it appends to the log from byte `end`. `file`:
    the claimed log, unchanged until then.

    `observe` and `end` raise InputError (BadLog) where the simulation differs from the log.
    """

    def __init__(
        self, simulation: Recordable, log: Log, file: FileIO, end: int, since: float
    ) -> None:
        self.simulation, self.log, self.file, self.since = simulation, log, file, since
        self.writer: LogWriter | None = None
        self._end, self._seen = end, 0
        if not since:
            self._write_on()

    def _write_on(self) -> None:
        self.file.truncate(self._end)
        self.file.seek(self._end)
        self.writer = LogWriter(str(self.file.name), self.simulation, going_on=self.file)

    def observe(self, state: State) -> None:
        """Compare a state, or write it on."""
        if self.writer is not None:
            self.writer.observe(state)
            return
        is_there = state.time >= self.since
        if len(state.events) > self._seen or is_there:
            self._compare_events(state.time, state.events)
            self._compare_state(state)
        if is_there:
            self._write_on()

    def _compare_events(self, time: float, events: Sequence[Event | Undone]) -> None:
        logged, begin = self.log.timed_entries, self._seen
        self._seen = len(events)
        for number, event in enumerate(events[begin:], start=begin):
            entry = event if isinstance(event, Undone) else event.transition
            was = logged[number] if number < len(logged) else None
            if was != (event.t, entry):
                raise self._another(event.t, _fired(was), _fired((event.t, entry)))
        if self._seen < len(logged) and logged[self._seen][0] < time:
            raise self._another(time, _fired(logged[self._seen]), "no such event")

    def _compare_state(self, state: State) -> None:
        log, row, time = self.log, self.log.row_at(state.time), state.time
        if row == len(log) or log.time[row] != time:
            raise self._another(time, "no state of that time", "one")
        if state.made != (products := int(log.delivered[row])):
            raise self._another(time, f"{products} products", f"{state.made}")
        now = state.observation.qpos
        if (other := now != log.qpos[row]).any():
            at = int(other.argmax())
            words = f"{log.qpos[row][at]!r} at position {at}", f"{now[at]!r}"
            raise self._another(time, *words)

    def _another(self, time: float, logged: str, again: str) -> InputError:
        """The error of a run that is not as logged."""
        words = f"at {time:.3f} s it has {logged}, and the run made again has {again}"
        message = f"'{self.file.name}' is not what its header makes here: {words}"
        return InputError(Diagnostic("BadLog", message, None, HINT))

    def end(self, trouble: Diagnostic | None) -> None:
        """The run is over. Raises InputError where the log has more of it."""
        if self.writer is None:
            words = trouble.message if trouble else "its last product"
            raise self._another(self.since, "more states", f"come to its end: {words}")
        self.writer.end(trouble)

    def __exit__(self, *raised: object) -> None:
        if self.writer is None:
            self.close()
        else:
            self.writer.__exit__(*raised)

    def close(self) -> None:
        """Close the log, with its last block where it was continued."""
        (self.writer or self.file).close()


def _fired(entry: tuple[float, str | Undone] | None) -> str:
    """An event in words."""
    if entry is None:
        return "no more events"
    time, what = entry
    return f"'{what if isinstance(what, str) else what.operation + ' undone'}' at {time:.3f} s"
