"""Progress on stderr: bars on a terminal, elsewhere a line now and then.

That of a run shows simulated time, units made, speed, time left.
"""

from __future__ import annotations

import sys
from threading import Event, Thread
from time import perf_counter
from typing import TYPE_CHECKING, Protocol, Self

from factory.support.resource import Closing

__all__ = ["Progress", "StepBar", "Waiting"]

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

PERIOD = 0.1
"""Least time between two updates of the bar [s]."""

LINES = 30.0
"""Time between two lines where stderr is no terminal [s]."""


class Counted(Protocol):
    """How far a run has come: to a `time` [s], with `made` units."""

    @property
    def time(self) -> float: ...
    @property
    def made(self) -> int: ...


class ProgressBar(Closing):
    """A progress bar that is shown within its context, unless `quiet` or stderr is not a terminal.
    `told`: whether lines are printed instead."""

    def __init__(self, quiet: bool) -> None:
        self.shown = not quiet and sys.stderr.isatty()
        self.told = not quiet and not self.shown
        self.bar: Bar | None = None

    def __enter__(self) -> Self:
        self.begin = perf_counter()
        if self.shown:
            self.bar, self.task = self.drawn()
            self.bar.start()
        return self

    def close(self) -> None:
        """Remove the bar."""
        if self.bar is not None:
            self.bar.stop()
            self.bar = None

    def drawn(self) -> tuple[Bar, TaskID]:
        """The bar and its task."""
        raise NotImplementedError


class Waiting(ProgressBar):
    """A spinner that shows `what` is in progress within its context, and the time elapsed."""

    def __init__(self, what: str, quiet: bool = False) -> None:
        super().__init__(quiet)
        self.what = what
        self.over, self._teller = Event(), Thread(target=self._tell, daemon=True)

    def __enter__(self) -> Self:
        super().__enter__()
        if self.told:
            self._teller.start()
        return self

    def drawn(self) -> tuple[Bar, TaskID]:
        """A spinner, and the time gone by."""
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
        bar = Progress(*columns, console=_stderr(), transient=True)
        return bar, bar.add_task(self.what)

    def close(self) -> None:
        """Remove the spinner and stop printing."""
        self.over.set()
        if self._teller.is_alive():
            self._teller.join()
        super().close()

    def _tell(self) -> None:
        while not self.over.wait(LINES):
            print(f"{self.what}, {perf_counter() - self.begin:.0f} s so far", file=sys.stderr)


class StepBar(Waiting):
    """A bar of a task in steps, with their number and the time left; for a step with an unknown
    number, the time until a `limit` [s]."""

    def __init__(self, what: str, quiet: bool = False, limit: float | None = None) -> None:
        super().__init__(what, quiet)
        self.limit = limit

    def drawn(self) -> tuple[Bar, TaskID]:
        """What goes on before the bar, words behind, the time gone by and the time left."""
        from rich import progress as rich

        before = rich.TextColumn("{task.description}")
        behind = rich.TextColumn("{task.fields[words]}")
        times = rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn()
        columns = before, rich.BarColumn(), behind, *times
        bar = rich.Progress(*columns, console=_stderr(), transient=True)
        return bar, bar.add_task(self.what, total=None, words="")

    def show(self, what: str, done: int, total: int | None, words: str = "") -> None:
        """Show that `done` of a `total` are done, None for an unknown total."""
        count = f"{done}" if total is None else f"{done} of {total}"
        words = f"{count}, {words}" if words else count
        if self.bar is not None:
            part, whole = float(done), total if total is None else float(total)
            if whole is None and self.limit is not None:
                part, whole = min(perf_counter() - self.begin, self.limit), self.limit
            if self.bar.tasks[0].description != what:
                self.bar.reset(self.task, total=whole)
            self.bar.update(self.task, total=whole, completed=part, description=what, words=words)
        self.what = f"{what}: {words}"


class Progress(ProgressBar):
    """The bar of a run, which it observes. `seconds`: an upper bound on its duration [simulated s],
    from which the time left is estimated."""

    def __init__(self, units: int, quiet: bool = False, seconds: float = 0.0) -> None:
        super().__init__(quiet)
        self.units, self.seconds = units, seconds
        self.last = 0.0

    def drawn(self) -> tuple[Bar, TaskID]:
        """Simulated time before the bar, units and speed behind."""
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        behind = "{task.fields[units]} units, {task.fields[speed]}, left"
        columns = TextColumn("{task.fields[time]}"), BarColumn(), TextColumn(behind)
        bar = Progress(*columns, TimeRemainingColumn(), console=_stderr(), transient=True)
        units, total = f"0/{self.units}", self.seconds or None
        return bar, bar.add_task("", total=total, time="0.0 s", units=units, speed="")

    def observe(self, state: Counted) -> None:
        """Update the bar, or write a line, at most once a period."""
        if self.bar is None and not self.told:
            return
        wall, made = perf_counter() - self.begin, state.made
        is_due = wall >= self.last + (LINES if self.bar is None else PERIOD)
        if self.bar is None:
            if is_due:
                self.last = wall
                print(self._line(made, state.time, wall), file=sys.stderr)
        elif is_due or made >= self.units:
            self.last = wall
            self.bar.update(
                self.task,
                completed=self.seconds if made >= self.units else min(state.time, self.seconds),
                time=f"{state.time:.1f} s",
                units=f"{made}/{self.units}",
                speed=f"{paced(state.time / max(wall, 1e-9))} x real time",
            )

    def _line(self, made: int, time: float, wall: float) -> str:
        left = f", at most {_clock(wall * (self.seconds / time - 1))} left"
        speed = f"{paced(time / wall)} x real time"
        return (
            f"{made} of {self.units} units, {time:.1f} s simulated, {speed}"
            f"{left if time < self.seconds else ''}"
        )


def paced(factor: float) -> str:
    """How many times as fast as real time: with one decimal, below 0.1 with two digits."""
    return f"{factor:.1f}" if factor >= 0.1 else f"{factor:.2g}"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d} min"


def _stderr() -> Console:
    from rich.console import Console

    return Console(file=sys.stderr)
