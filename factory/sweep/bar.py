"""A bar on stderr while a sweep goes on: runs done, failed, runs per second, time left."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import TYPE_CHECKING, Self

from factory.closing import Closing

if TYPE_CHECKING:
    from rich.progress import Progress


class Bar(Closing):
    """Counts the runs of a sweep of which some may be there already; silent where `quiet`, or where
    stderr is no terminal."""

    def __init__(self, total: int, there: int = 0, quiet: bool = False) -> None:
        self.total, self.there = total, there
        self.done = self.failed = 0
        self.shown = not quiet and sys.stderr.isatty()
        self.bar: Progress | None = None

    def __enter__(self) -> Self:
        self.begin = perf_counter()
        if self.shown:
            self.bar = _bar()
            self.task = self.bar.add_task("", total=self.total, completed=self.there, words="")
            self.bar.start()
        return self

    def close(self) -> None:
        """Take the bar away."""
        if self.bar is not None:
            self.bar.stop()
            self.bar = None

    def advance(self, failed: bool) -> None:
        """One more run is done."""
        self.done += 1
        self.failed += failed
        if self.bar is not None:
            words = f"{self.done / max(perf_counter() - self.begin, 1e-9):.1f} runs/s"
            words += f", {self.failed} failed" if self.failed else ""
            self.bar.update(self.task, completed=self.there + self.done, words=words)


def _bar() -> Progress:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    return Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("runs, {task.fields[words]}, left"),
        TimeRemainingColumn(),
        console=Console(file=sys.stderr),
        transient=True,
    )
