"""The runs of a sweep on a Dask cluster, sent to `dask worker`s by a `dask scheduler`. Needs
`distributed`, an optional package."""

from __future__ import annotations

import logging
from collections.abc import Generator, Sequence
from contextlib import suppress
from itertools import islice
from typing import TYPE_CHECKING, Any

from factory.study.sweep.grid import Point
from factory.study.sweep.recipe import Recipe, versions
from factory.study.sweep.work import Outcome, Runner, failed
from factory.support.errors import Diagnostic, InputError, MissingError, RunError
from factory.support.extras import optional

if TYPE_CHECKING:
    from distributed import Client

PREFIX = "dask://"

PATIENCE = "10s"
"""Timeout of the connection to a scheduler."""

AHEAD = 4
"""Number of runs that wait for each thread of a worker, so that no thread is idle."""


def address_of(place: str) -> str:
    """Dask's own address of `dask://HOST:PORT`. Raises InputError."""
    host, colon, port = place.removeprefix(PREFIX).rpartition(":")
    if not place.startswith(PREFIX) or not (host and colon and port.isdecimal()):
        message = f"--on takes `local` or dask://HOST:PORT, not '{place}'"
        raise InputError(
            Diagnostic("Usage", message, None, "for example --on dask://10.0.0.1:8786")
        )
    return f"tcp://{host}:{port}"


def run_dask(recipe: Recipe, points: Sequence[Point], place: str) -> Generator[Outcome, None, None]:
    """The outcomes of all points as they come, from the present workers and those that join. A run
    whose worker dies goes to another one, three times. Closing the iterator cancels the rest.

    Raises MissingError without Dask or a scheduler, or for workers without factory; RunError if the
    scheduler is lost.
    """
    client = connect(place)
    try:
        yield from _outcomes(client, recipe, points)
    finally:
        with suppress(Exception):
            client.close(timeout=5)


def connect(place: str) -> Client:
    """A client of the scheduler at a place. Raises InputError, MissingError."""
    address = address_of(place)
    distributed = optional("distributed", "Dask", "a cluster", "cluster")
    for name in [n for n in logging.root.manager.loggerDict if n.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are raised from here
    try:
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        message = f"no Dask scheduler answers at {place}: {error}"
        raise MissingError(Diagnostic("Missing", message, None, "dask scheduler")) from error


def _outcomes(
    client: Client, recipe: Recipe, points: Sequence[Point]
) -> Generator[Outcome, None, None]:
    """Submit a few points for each thread, and more as outcomes come back."""
    from distributed import as_completed

    _check_workers(client)
    runner = client.submit(Runner, recipe, pure=False)
    rest, sent = iter(points), dict[str, Point]()

    def send() -> list[Any]:
        chosen = list(islice(rest, max(0, _wanted(client) - len(sent))))
        futures = [client.submit(_run, runner, point, pure=False) for point in chosen]
        sent.update(zip((future.key for future in futures), chosen, strict=True))
        return futures

    under_way = as_completed(send(), loop=client.loop, raise_errors=False)
    for future in under_way:
        outcome = _outcome(future, sent.pop(future.key))
        future.release()
        under_way.update(send())
        yield outcome


def _run(runner: Runner, point: Point) -> Outcome:
    return runner(point)


def _wanted(client: Client) -> int:
    """Number of runs that the cluster should have now."""
    threads: int = sum(client.nthreads().values())
    return AHEAD * max(1, threads)


def _outcome(future: Any, point: Point) -> Outcome:
    """The outcome of a run. Raises RunError if the scheduler is lost."""
    from distributed.scheduler import KilledWorker

    if future.status == "finished":
        outcome: Outcome = future.result()
        return outcome
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return failed(point, f"Killed the worker died {error.allowed_failures + 1} times", 1)
    if error is not None:
        return failed(point, f"Internal {type(error).__name__}: {error}", 1)
    hint = "run the sweep again: finished runs are kept"
    raise RunError(Diagnostic("Missing", "the Dask scheduler was lost", None, hint))


def _check_workers(client: Client) -> None:
    """Raises MissingError for a worker with other versions of factory or of the engine, or that
    does not report them."""
    ours = versions()
    for address, theirs in client.run(versions, on_error="return").items():
        if theirs == ours:
            continue
        message = f"the worker at {address} has {theirs}, not {ours}"
        hint = "install the same klavins-factory there"
        if isinstance(theirs, Exception):
            message = f"the worker at {address} cannot report its versions: {theirs!r}"
            hint += ", start it again and run the sweep again"
        raise MissingError(Diagnostic("Missing", message, None, hint))
