"""Progress bar of runs on stderr: numbers done and failed, runs per second, time left."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

from factory.support.progress import ProgressBar, counter

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class RunsBar(ProgressBar):
    """Counts runs; `there`: how many were done before."""

    def __init__(self, total: int, there: int = 0, quiet: bool = False) -> None:
        super().__init__(quiet)
        self.total, self.there = total, there
        self.done = self.failed = 0

    def drawn(self) -> tuple[Progress, TaskID]:
        """The bar, with the runs done and their rate."""
        bar = counter("runs, {task.fields[words]}, left")
        return bar, bar.add_task("", total=self.total, completed=self.there, words="")

    def advance(self, failed: bool = False) -> None:
        """Count a finished run."""
        self.done += 1
        self.failed += failed
        if self.bar is not None:
            words = f"{self.done / max(perf_counter() - self.begin, 1e-9):.1f} runs/s"
            words += f", {self.failed} failed" if self.failed else ""
            self.bar.update(self.task, completed=self.there + self.done, words=words)
