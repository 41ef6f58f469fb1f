"""A bar on stderr while seeds are run: how many of how many."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Self

from factory.closing import Closing

if TYPE_CHECKING:
    from rich.progress import Progress


class Bar(Closing):
    """Counts runs that are done; silent where `quiet`, or where stderr is no terminal."""

    def __init__(self, runs: int, quiet: bool = False) -> None:
        self.runs, self.done = runs, 0
        self.shown = not quiet and sys.stderr.isatty()
        self.bar: Progress | None = None

    def __enter__(self) -> Self:
        if self.shown:
            from rich.console import Console
            from rich.progress import Progress

            self.bar = Progress(console=Console(file=sys.stderr), transient=True)
            self.task = self.bar.add_task("runs", total=self.runs)
            self.bar.start()
        return self

    def close(self) -> None:
        """Take the bar away."""
        if self.bar is not None:
            self.bar.stop()
            self.bar = None

    def advance(self, finished: int) -> None:
        """One more run is done."""
        self.done += 1
        if self.bar is not None:
            self.bar.update(self.task, completed=self.done)
