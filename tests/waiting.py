"""Waiting for another thread or process: here alone tests read a clock, to give up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from subprocess import Popen
from time import monotonic, sleep
from typing import Any, TypeVar

T = TypeVar("T")

PATIENCE = 300.0
"""After so long a wait fails [s]: longer than anything awaited takes on a busy machine."""


def until(holds: Callable[[], T], pause: Callable[[], object] = lambda: sleep(0.01)) -> T:
    """The first true result of `holds`, which is called again after each `pause`. Raises
    AssertionError after PATIENCE."""
    end = monotonic() + PATIENCE
    while not (result := holds()):
        assert monotonic() < end, f"{holds} does not come to hold"
        pause()
    return result


def left_alone(seconds: float) -> None:
    """Let a process that says nothing get on with its work for a while."""
    sleep(seconds)


def grown(path: Path, size: float, process: Popen[Any]) -> None:
    """Wait until a file that a process writes has more than so many bytes."""

    def holds() -> bool:
        assert process.poll() is None, f"the process ended with status {process.returncode}"
        return path.exists() and path.stat().st_size > size

    until(holds)
