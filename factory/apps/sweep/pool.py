"""A pool of processes of this machine for items of work.

Each process has its own pipes: if one is killed, only its present item is lost, and is tried again
in another. (The executors of the standard library and of joblib fail as a whole if a process dies.)
"""

from __future__ import annotations

import copyreg
import os
import pickle
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from queue import SimpleQueue
from subprocess import PIPE, Popen
from threading import Thread
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from factory.api import Diagnostic, RunError


def _locked(contents: dict[object, object]) -> MappingProxyType[object, object]:
    return MappingProxyType(contents)


def pickle_locked_mappings() -> None:
    """Teach pickle to copy locked mappings."""
    copyreg.pickle(MappingProxyType, lambda proxy: (_locked, (dict(proxy),)))


Item = TypeVar("Item")
Result = TypeVar("Result")

TRIES = 3
"""Number of deaths of its process after which an item is given up."""

STILLBORN = 3
"""Number of processes in a row that die before they are ready, after which the work ends."""

NOTHING: Mapping[str, str] = MappingProxyType({})

CHILD = """\
import pickle, sys
try:
    sys.path[:] = pickle.load(sys.stdin.buffer)
    from factory.apps.sweep.pool import serve
    serve()
except (EOFError, BrokenPipeError, pickle.UnpicklingError):
    pass
"""
"""The program of a process, which ends without a word where its parent has ended."""

DIED = EOFError, OSError, pickle.UnpicklingError
"""Exceptions of a pipe whose other end has died, perhaps within a message."""

pickle_locked_mappings()  # layouts and factories contain many


def cores() -> int:
    """The cores that this process may use."""
    with suppress(AttributeError):  # there is no affinity on macOS
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True, slots=True)
class Worked(Generic[Result]):
    """Result of an item: its number, its `result`, None if its process died in all tries, and
    the number of tries; `status`: exit status of the last process that died."""

    number: int
    result: Result | None
    tries: int
    status: int | None = None


def over_processes(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    jobs: int,
    variables: Mapping[str, str] = NOTHING,
) -> Generator[Worked[Result], None, None]:
    """The results of `work` for all items as they come, from `jobs` processes with these
    environment variables; `work`, items and results must be picklable. Closing the iterator ends
    the processes. Raises what `work` raises, and RunError if processes die as they start."""
    processes, waiting = _Processes(work, variables), iter(enumerate(items))
    results: SimpleQueue[Worked[Result] | Exception] = SimpleQueue()

    def do_all() -> None:
        try:
            for item in waiting:  # each to one thread
                results.put(processes.do(*item))
        except Exception as error:
            results.put(error)

    for _ in range(min(jobs, len(items))):
        Thread(target=do_all, daemon=True).start()
    try:
        for _ in items:
            worked = results.get()
            if isinstance(worked, Exception):
                raise worked
            yield worked
    finally:
        processes.end()


class _Processes(Generic[Item, Result]):
    """All processes `started` for work, and the `free` ones. Each has a group of its own, so Ctrl-C
    does not reach it."""

    def __init__(self, work: Callable[[Item], Result], variables: Mapping[str, str]) -> None:
        self.work = work
        self.env = {"PYTHONWARNINGS": "ignore", **os.environ, **variables}
        self.started, self.free, self.ended = list[Popen[bytes]](), list[Popen[bytes]](), False

    def do(self, number: int, item: Item) -> Worked[Result]:
        """The result of an item, by a free process. Raises what the work raises."""
        status: int | None = None
        for tries in range(1, TRIES + 1):
            try:
                process = self.free.pop()
            except IndexError:
                process = self._start()
            try:
                _send(process.stdin, item)
                result, error = pickle.load(process.stdout)  # type: ignore[arg-type]
            except DIED:
                if self.ended:
                    raise
                status = process.wait()
                continue
            self.free.append(process)
            if error is not None:
                raise error
            return Worked(number, result, tries)
        return Worked(number, None, TRIES, status)

    def _start(self) -> Popen[bytes]:
        """A process that is ready for items. Raises RunError where it dies before that."""
        for _ in range(STILLBORN):
            command = [sys.executable, "-c", CHILD]
            process = Popen(command, stdin=PIPE, stdout=PIPE, env=self.env, process_group=0)
            self.started.append(process)
            if self.ended:
                process.kill()
            try:
                _send(process.stdin, sys.path)
                _send(process.stdin, self.work)
                pickle.load(process.stdout)  # type: ignore[arg-type]
                return process
            except DIED:
                if self.ended:
                    raise
                status = process.wait()
        message = f"the processes die as they start (exit status {status})"
        raise RunError(Diagnostic("Killed", message, None, "use fewer --jobs, or more memory"))

    def end(self) -> None:
        """End all processes at once."""
        self.ended = True
        for process in self.started:
            process.kill()
            process.wait()


def _send(stream: Any, value: object) -> None:
    pickle.dump(value, stream)
    stream.flush()


def serve() -> None:
    """The main function of a process: work on items until its input ends. What the work prints goes
    to stderr."""
    results, items = os.fdopen(os.dup(1), "wb"), SimpleQueue[Any]()
    os.dup2(2, 1)
    work = pickle.load(sys.stdin.buffer)
    Thread(target=_read, args=(items,), daemon=True).start()
    _send(results, None)
    while True:
        try:
            answer: tuple[Any, Exception | None] = work(items.get()), None
        except Exception as error:
            answer = None, error
        _send(results, answer)


def _read(items: SimpleQueue[Any]) -> None:
    """Read the items; the input ends when this process is to end, or its parent has ended."""
    with suppress(*DIED):
        while True:
            items.put(pickle.load(sys.stdin.buffer))
    os._exit(1)
