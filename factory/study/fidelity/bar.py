"""A bar on stderr while seeds are run: how many of how many."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from factory.support.progress import ProgressBar

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class Bar(ProgressBar):
    """Counts runs that are done."""

    def __init__(self, runs: int, quiet: bool = False) -> None:
        super().__init__(quiet)
        self.runs, self.done = runs, 0

    def drawn(self) -> tuple[Progress, TaskID]:
        """The share of the runs that are done."""
        from rich.console import Console
        from rich.progress import Progress

        bar = Progress(console=Console(file=sys.stderr), transient=True)
        return bar, bar.add_task("runs", total=self.runs)

    def advance(self, finished: int) -> None:
        """One more run is done."""
        self.done += 1
        if self.bar is not None:
            self.bar.update(self.task, completed=self.done)
