"""A pool of processes of this machine for items of work.

Each process has its own pipe: if one is killed, only its present item is lost and goes to another
process. (The executors of the standard library and of joblib fail as a whole if a process dies.)
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from factory.support.environment import environment
from factory.support.errors import Diagnostic, RunError
from factory.support.pickling import pickle_locked_mappings

Item = TypeVar("Item")
Result = TypeVar("Result")

CONTEXT = get_context("spawn")

TRIES = 3
"""Number of deaths of its process after which an item is given up."""

STILLBORN = 3
"""Number of processes in a row that die before they are ready, after which the work ends."""

NOTHING: Mapping[str, str] = MappingProxyType({})

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
    pool = _Pool(work, items, variables)
    try:
        yield from pool.results(min(jobs, len(items)))
    finally:
        pool.end()


@dataclass(slots=True)
class _Worker:
    """A process, the parent's end of its pipe, the number of its present item, and whether it is
    ready."""

    process: SpawnProcess
    pipe: Connection
    number: int | None = None
    ready: bool = False


class _Pool(Generic[Item, Result]):
    """Workers, and the numbers of the items that wait for a worker."""

    def __init__(
        self, work: Callable[[Item], Result], items: Sequence[Item], variables: Mapping[str, str]
    ) -> None:
        self.work, self.items, self.variables = work, items, variables
        self.waiting = deque(range(len(items)))
        self.tries = [1] * len(items)
        self.stillborn = 0
        self.workers: list[_Worker] = []

    def results(self, jobs: int) -> Generator[Worked[Result], None, None]:
        """The results of the items, until all are done."""
        for _ in range(jobs):
            self._start()
        left = len(self.items)
        while left:
            busy = {w.pipe: w for w in self.workers if w.number is not None or not w.ready}
            for pipe in wait(list(busy)):
                worked = self._received(busy[pipe])  # type: ignore[index]
                if worked is not None:
                    left -= 1
                    yield worked

    def end(self) -> None:
        """End all processes at once."""
        for worker in self.workers:
            worker.pipe.close()
            worker.process.terminate()
        for worker in self.workers:
            worker.process.join()

    def _received(self, worker: _Worker) -> Worked[Result] | None:
        """Receive from a worker that it is ready, or a result; its pipe ends if it has died. It
        gets its next item before its result is returned."""
        number = worker.number
        try:
            message: tuple[Result | None, Exception | None] = worker.pipe.recv()
        except (EOFError, OSError):
            return self._bury(worker)
        self.stillborn, worker.ready = 0, True
        worker.number = self.waiting.popleft() if self.waiting else None
        if worker.number is not None:
            with suppress(OSError):  # the next receive shows that a worker is dead
                worker.pipe.send(self.items[worker.number])
        if number is None:
            return None
        result, error = message
        if error is not None:
            raise error
        return Worked(number, result, self.tries[number])

    def _bury(self, worker: _Worker) -> Worked[Result] | None:
        """Replace a process that died; its item is tried again, or given up after all its tries."""
        worker.process.join()
        status, number = worker.process.exitcode, worker.number
        self.workers.remove(worker)
        self.stillborn += not worker.ready
        if self.stillborn == STILLBORN:
            message = f"the processes die as they start (exit status {status})"
            raise RunError(Diagnostic("Killed", message, None, "use fewer --jobs, or more memory"))
        lost: Worked[Result] | None = None
        if number is not None:
            self.tries[number] += 1
            if self.tries[number] > TRIES:
                lost = Worked(number, None, TRIES, status)
            else:
                self.waiting.appendleft(number)
        if self.waiting:
            self._start()
        return lost

    def _start(self) -> None:
        parent_end, child_end = CONTEXT.Pipe()
        process = CONTEXT.Process(target=_work, args=(self.work, child_end), daemon=True)
        with _uninterrupted(), _without_main(), ExitStack() as stack:
            for name, value in self.variables.items():
                stack.enter_context(environment(name, value))
            process.start()
        child_end.close()
        self.workers.append(_Worker(process, parent_end))


@contextmanager
def _without_main() -> Iterator[None]:
    """Processes started in here do not run the user's script again: they need nothing of it."""
    main = sys.modules["__main__"].__dict__
    before: dict[str, Any] = {n: main[n] for n in ("__spec__", "__file__") if n in main}
    main.update(dict.fromkeys(before))
    try:
        yield
    finally:
        main.update(before)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Processes started in here do not receive Ctrl-C: their parent ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would lift the mask again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(work: Callable[[Any], Any], pipe: Connection) -> None:
    """The main function of a process: work on items until the pipe is closed."""
    threading.Thread(target=_follow_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            pipe.send(_tried(work, pipe.recv()))


def _tried(work: Callable[[Any], Any], item: Any) -> tuple[Any, Exception | None]:
    """The result of work on an item, or the exception that it raises."""
    try:
        return work(item), None
    except Exception as error:
        return None, error


def _follow_parent() -> None:
    """End this process when its parent has ended."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
