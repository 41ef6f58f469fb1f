"""Interruptions (Ctrl-C, a signal to end) wait for the end of a tick: files stay complete."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import Thread, Timer
from types import FrameType
from typing import Any, Self, TypeVar

from factory.support.resource import Closing

T = TypeVar("T")

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]


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


class AfterImports:
    """A handler of signals that raises KeyboardInterrupt: at once or, within an import, when that
    is over, since what is imported may take any exception for a missing package. The second signal
    is raised at once."""

    EVERY = 0.05
    """Time between two looks at whether an import is over [s]."""

    def __init__(self) -> None:
        self._wait: Timer | None = None
        self._over = True

    def __call__(self, number: int, frame: FrameType | None) -> None:
        wait, first, self._wait = self._wait, self._over, None
        if wait is not None:
            wait.cancel()
        if not (first and _within_an_import(frame)):
            self._over = True
            raise KeyboardInterrupt
        self._over, self._wait = False, Timer(self.EVERY, self._again, [number])
        self._wait.daemon = True
        self._wait.start()

    def _again(self, number: int) -> None:
        self._over = True
        signal.raise_signal(number)


def _within_an_import(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def awaited(work: Callable[[], T]) -> T:
    """What `work` gives, done as `side_by_side` does: a long call of the engine, which lets the
    interpreter go on meanwhile, does not keep signals waiting. Raises as `work` does."""
    return side_by_side([work])[0]


def side_by_side(works: Sequence[Callable[[], T]]) -> list[T]:
    """What each of `works` gives, in their order, done in as many threads as there are processors,
    while the caller hears signals. Raises as the first that fails does. Work that is interrupted is
    left alone, and ends with the program."""
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
    return [done.result() for _, done in tasks]


class Interruption(Closing):
    """Within its context the first signal is noted, and `observe` raises it as KeyboardInterrupt;
    the second is raised at once."""

    def __init__(self) -> None:
        self.noted = False
        self._before: Mapping[int, Any] = {}

    def __enter__(self) -> Self:
        self._before = stop_on_signals(self._note)
        return self

    def close(self) -> None:
        """Restore the handlers from before."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def observe(self, world: Any, supervisor: Any) -> None:
        """Raise a noted interruption, at the end of a tick."""
        if self.noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.noted:
            raise KeyboardInterrupt
        self.noted = True
