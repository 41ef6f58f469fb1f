"""The runs of a sweep in processes of this machine; no server.

Each process has a pipe of its own, so that one that is killed takes with it only the run under way:
that one goes to another process. (An executor of the standard library, and joblib's, give up as a
whole when a process dies.)
"""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from factory.study.sweep.grid import Point
from factory.study.sweep.recipe import Recipe
from factory.study.sweep.work import Outcome, Runner, failed
from factory.support.engine import environment
from factory.support.errors import Diagnostic, RunError

CONTEXT = get_context("spawn")

TRIES = 3
"""A run whose process dies so many times has failed."""

STILLBORN = 3
"""So many processes in a row that die before they are ready end the sweep."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Set to 1 for the processes: there is one for each core already."""


def cores() -> int:
    """The cores that this process may use."""
    with suppress(AttributeError):  # there is no affinity on macOS
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(slots=True)
class _Worker:
    """A process, our end of its pipe, the point it was given, and whether it has come to life."""

    process: SpawnProcess
    pipe: Connection
    point: Point | None = None
    ready: bool = False


def run_local(recipe: Recipe, points: Sequence[Point], jobs: int) -> Generator[Outcome, None, None]:
    """The outcomes of all points as they come, from `jobs` processes. Closing the iterator ends
    them. Raises RunError where processes die as they start."""
    processes = _Processes(recipe, points, jobs)
    try:
        yield from processes.outcomes()
    finally:
        processes.end()


class _Processes:
    """Some workers and the points that wait for one."""

    def __init__(self, recipe: Recipe, points: Sequence[Point], jobs: int) -> None:
        self.recipe, self.jobs = recipe, min(jobs, len(points))
        self.waiting = deque(points)
        self.tries: dict[Point, int] = {}
        self.stillborn = 0
        self.workers: list[_Worker] = []

    def outcomes(self) -> Generator[Outcome, None, None]:
        """What the workers tell, until all points are done."""
        for _ in range(self.jobs):
            self._start()
        while busy := {w.pipe: w for w in self.workers if w.point is not None}:
            for pipe in wait(list(busy)):
                outcome = self._heard(busy[pipe])  # type: ignore[index]
                if outcome is not None:
                    yield outcome

    def end(self) -> None:
        """End all processes, whatever they are at."""
        for worker in self.workers:
            worker.pipe.close()
            worker.process.terminate()
        for worker in self.workers:
            worker.process.join()

    def _heard(self, worker: _Worker) -> Outcome | None:
        """What a worker says: that it is ready, an outcome, or nothing any more. It gets its next
        point before its outcome is looked at."""
        point = worker.point
        assert point is not None
        try:
            outcome: Outcome | None = worker.pipe.recv()
        except (EOFError, OSError):
            return self._bury(worker, point)
        self.stillborn = 0
        if outcome is None:
            worker.ready = True
            return None
        self._give(worker)
        return replace(outcome, tries=self.tries.pop(point, 1))

    def _bury(self, worker: _Worker, point: Point) -> Outcome | None:
        """Another process takes the place and the point of one that died; a point that has had all
        its tries has failed."""
        worker.process.join()
        status = worker.process.exitcode
        self.workers.remove(worker)
        self.stillborn += not worker.ready
        if self.stillborn == STILLBORN:
            message = f"the processes of the sweep die as they start (exit status {status})"
            raise RunError(Diagnostic("Killed", message, None, "take fewer --jobs, or more memory"))
        tried = self.tries[point] = self.tries.get(point, 1) + worker.ready
        gone = tried > TRIES
        if not gone:
            self.waiting.appendleft(point)
        if self.waiting:
            self._start()
        reason = f"Killed the process died in {TRIES} tries (exit status {status})"
        return failed(point, reason, TRIES) if gone else None

    def _give(self, worker: _Worker) -> None:
        """The next point, if there is one; a worker that is dead will be found so."""
        worker.point = self.waiting.popleft() if self.waiting else None
        if worker.point is not None:
            with suppress(OSError):
                worker.pipe.send(worker.point)

    def _start(self) -> None:
        ours, theirs = CONTEXT.Pipe()
        process = CONTEXT.Process(target=_work, args=(self.recipe, theirs), daemon=True)
        with _uninterrupted(), ExitStack() as stack:
            for name in THREADS:
                stack.enter_context(environment(name, "1"))
            process.start()
        theirs.close()
        worker = _Worker(process, ours)
        self.workers.append(worker)
        self._give(worker)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Processes started in here do not hear Ctrl-C, which goes to everyone: their parent ends
    them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would lift the mask again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(recipe: Recipe, pipe: Connection) -> None:
    """What a process does: run points until there is nobody to ask for them."""
    threading.Thread(target=_follow_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    run = Runner(recipe)
    with suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            pipe.send(run(pipe.recv()))


def _follow_parent() -> None:
    """A process whose parent was killed ends, whatever it is at."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
