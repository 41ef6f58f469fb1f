"""Interruptions (Ctrl-C, a signal to end) wait for the end of a tick: files stay complete."""

from __future__ import annotations

import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from threading import Thread
from types import FrameType
from typing import Any, Self, TypeVar

from factory.support.resource import Closing

__all__ = ["Interruption"]

T = TypeVar("T")

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]


OFTEN = 0.5
"""The longest time between two reports of work that is done side by side [s]."""


def stop_on_signals(handler: Callable[[int, FrameType | None], Any]) -> Mapping[int, Any]:
    """Install a handler of the signals that end a program, except those that are ignored; gives the
    handlers from before. Outside the main thread it does nothing."""
    try:
        before = {n: signal.getsignal(n) for n in SIGNALS}
        heard = {n: old for n, old in before.items() if old is not signal.SIG_IGN}
        for number in heard:
            signal.signal(number, handler)
    except ValueError:  # not in the main thread
        return {}
    return heard


@contextmanager
def put_off() -> Iterator[None]:
    """Within its context, an import that is guarded, the first signal is noted, and it is raised
    again after that; the second ends the wait with KeyboardInterrupt."""
    noted: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        if len(noted) > 1:
            raise KeyboardInterrupt

    before = stop_on_signals(note)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if noted:
        signal.raise_signal(noted[0])


def interrupt(number: int, frame: FrameType | None) -> None:
    """A handler of signals that raises KeyboardInterrupt: at once or, within an import, in the line
    after that, since what is imported may take any exception for a missing package. The second
    signal is raised at once."""
    importer = _importer(frame)
    if importer is None or importer.f_trace is not None:
        raise KeyboardInterrupt

    def stop(*_: object) -> None:
        sys.settrace(None)
        raise KeyboardInterrupt

    importer.f_trace = stop
    sys.settrace(lambda *_: None)  # none but this frame is traced


def _importer(frame: FrameType | None) -> FrameType | None:
    """The outermost frame that imports something, None within no import."""
    importer = None
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            importer = frame.f_back
        frame = frame.f_back
    return importer


def awaited(work: Callable[[], T]) -> T:
    """What `work` gives, done as `side_by_side` does: a long call of the engine, which lets the
    interpreter go on meanwhile, does not keep signals waiting. Raises as `work` does."""
    return side_by_side([work])[0]


def side_by_side(
    works: Sequence[Callable[[], T]], report: Callable[[int, int], None] = lambda *_: None
) -> list[T]:
    """What each of `works` gives, in their order, done in as many threads as there are processors,
    while the caller hears signals, and calls `report` with how many are done, and of how many, at
    least twice a second. Raises as the first that fails does, or as `report` does. Work that is
    interrupted is left alone, and ends with the program; no other is begun then."""
    tasks = [(work, Future[T]()) for work in works]
    left = iter(tasks)

    def do() -> None:
        for work, done in left:
            try:
                done.set_result(work())
            except BaseException as error:
                done.set_exception(error)

    for _ in range(min(len(tasks), os.cpu_count() or 1)):
        Thread(target=do, daemon=True).start()
    pending = {done for _, done in tasks}
    try:
        while pending:
            pending = wait(pending, OFTEN, FIRST_COMPLETED).not_done
            report(len(tasks) - len(pending), len(tasks))
    finally:
        deque(left, maxlen=0)
    return [done.result() for _, done in tasks]


class Interruption(Closing):
    """Within its context the first signal is noted, and `observe` raises it as KeyboardInterrupt;
    the second is raised at once, and so is the first while nothing has to be ended first
    (`keeps`). `heard` answers a signal that is noted."""

    def __init__(self, keeps: bool = True, heard: Callable[[], None] = lambda: None) -> None:
        self.noted, self.keeps, self.heard = False, keeps, heard
        self._before: Mapping[int, Any] = {}

    def __enter__(self) -> Self:
        self._before = stop_on_signals(self._note)
        return self

    def close(self) -> None:
        """Restore the handlers from before."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def observe(self, state: object = None) -> None:
        """Raise a noted interruption, at the end of a tick."""
        if self.noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        again, self.noted = self.noted, True
        if again or not self.keeps:
            raise KeyboardInterrupt
        self.heard()
