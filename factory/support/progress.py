"""Progress bars on stderr; that of a run shows simulated time, units made, speed, time left."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

from factory.support.resource import Closing

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

PERIOD = 0.1
"""Least time between two updates of the bar [s]."""


class ProgressBar(Closing):
    """A bar that is shown within its context; not where `quiet`, or where stderr is no terminal."""

    def __init__(self, quiet: bool) -> None:
        self.shown = not quiet and sys.stderr.isatty()
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


def counter(after: str, before: str = "") -> Bar:
    """A bar between words, with the number done, the number in all and the time left."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    return Progress(
        *([TextColumn(before)] if before else []),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(after),
        TimeRemainingColumn(),
        console=Console(file=sys.stderr),
        transient=True,
    )


class Progress(ProgressBar):
    """The bar of a run, which it observes."""

    def __init__(self, units: int, quiet: bool = False) -> None:
        super().__init__(quiet)
        self.units = units
        self.next = 0.0
        self.before: int | None = None

    def drawn(self) -> tuple[Bar, TaskID]:
        """Simulated time before the bar, units and speed behind."""
        bar = counter("units, {task.fields[speed]}, left", "{task.fields[time]}")
        return bar, bar.add_task("", total=self.units, time="0.0 s", speed="")

    def observe(self, world: Any, supervisor: Any) -> None:
        """Update the bar, at most once a period."""
        if self.bar is None:
            return
        if self.before is None:
            self.before = int(world.delivered())
        now = perf_counter()
        made = int(world.delivered()) - self.before
        if now < self.next and made < self.units:
            return
        self.next = now + PERIOD
        speed = f"{world.time / max(now - self.begin, 1e-9):.1f} x real time"
        self.bar.update(self.task, completed=made, time=f"{world.time:.1f} s", speed=speed)
