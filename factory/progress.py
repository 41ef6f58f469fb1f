"""A bar on stderr while a factory runs: simulated time, units made, speed, time left."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

from factory.closing import Closing

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

PERIOD = 0.1
"""The bar is redrawn so often [s]."""


class Progress(Closing):
    """An observer and context manager; silent where `quiet`, or where stderr is no terminal."""

    def __init__(self, units: int, quiet: bool = False) -> None:
        self.units = units
        self.shown = not quiet and sys.stderr.isatty()
        self.bar: Bar | None = None
        self.next = 0.0
        self.before: int | None = None

    def __enter__(self) -> Self:
        if self.shown:
            self.bar = self._bar()
            self.task = self.bar.add_task("", total=self.units, time="0.0 s", speed="")
            self.bar.start()
            self.begin = perf_counter()
        return self

    def close(self) -> None:
        """Take the bar away."""
        if self.bar is not None:
            self.bar.stop()
            self.bar = None

    def __call__(self, world: Any, supervisor: Any) -> None:
        self.observe(world, supervisor)

    def observe(self, world: Any, supervisor: Any) -> None:
        """Redraw the bar if it is time to."""
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

    def _bar(self) -> Bar:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        return Progress(
            TextColumn("{task.fields[time]}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("units, {task.fields[speed]}, left"),
            TimeRemainingColumn(),
            console=Console(file=sys.stderr),
            transient=True,
        )
