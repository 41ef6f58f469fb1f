"""Items of work on a Dask cluster: `dask worker`s of any machines, sent to by a `dask scheduler`.
Needs `distributed`, an optional package.

A worker gets the work once, with all that it keeps from item to item, as the result of a task,
which Dask computes again where its worker has died. A scheduler and its workers execute whatever
reaches their ports: they belong into a network of one's own.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from itertools import islice
from typing import TYPE_CHECKING, Any

from factory.api import Diagnostic, InputError, RunError
from factory.apps.sweep.pool import Item, Result, Worked
from factory.apps.sweep.recipe import versions
from factory.support.version import optional

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = "10s"
"""Timeout of the connection to a scheduler."""

AHEAD = 4
"""Number of items that wait for each thread of a worker, so that no thread is idle."""

LEAST = 64
"""Number of items that are sent at least: workers may join later."""


def over_cluster(
    work: Callable[[Item], Result], items: Sequence[Item], address: str
) -> Generator[Worked[Result], None, None]:
    """The results of `work` for all items as they come, from the workers of a scheduler that are
    there and those that join. `work`, items and results must be picklable. An item whose worker
    dies goes to another one, as often as the scheduler allows. Closing the iterator cancels the
    rest.

    Args:
        work: what is done.
        items: what it is done for.
        address: of the scheduler, `tcp://HOST:PORT` or what else Dask takes.

    Raises what `work` raises; InputError for what is no address; MissingError without Dask;
    RunError where no scheduler answers or it is lost, or for workers with other versions.
    """
    client = connected(address)
    from distributed.comm import CommClosedError

    try:
        check_workers(client)
        yield from _results(client, work, items)
    except CommClosedError as error:
        raise _lost() from error
    finally:
        with suppress(Exception):
            client.close(timeout=5)


def connected(address: str) -> Client:
    """A client of the scheduler at an address. Raises InputError, MissingError, RunError."""
    protocol, slashes, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    if not (host and port.isdecimal()) or (slashes and not protocol):
        message = f"--on takes the address of a scheduler, not '{address}'"
        raise InputError(Diagnostic("Usage", message, None, "for example --on tcp://10.0.0.1:8786"))
    distributed = optional("distributed", "Dask", "a cluster", "cluster")
    for name in [n for n in logging.root.manager.loggerDict if n.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are raised from here
    try:
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        message = f"no Dask scheduler answers at {address}: {error}"
        raise RunError(Diagnostic("Missing", message, None, "dask scheduler")) from error


def check_workers(client: Client) -> None:
    """Raises RunError for a worker with other versions of factory or of the engine, or that
    does not report them."""
    ours = versions()
    for address, theirs in client.run(versions, on_error="return").items():
        if theirs == ours:
            continue
        message = f"the worker at {address} has {theirs}, not {ours}"
        hint = "install the same klavins-factory there"
        if isinstance(theirs, Exception):
            message = f"the worker at {address} cannot report its versions: {theirs!r}"
            hint += ", start it again and call again"
        raise RunError(Diagnostic("Missing", message, None, hint))


def _results(
    client: Client, work: Callable[[Item], Result], items: Sequence[Item]
) -> Generator[Worked[Result], None, None]:
    """Submit some items for each thread, and more as results come back."""
    from distributed import as_completed

    shared = client.submit(_same, work, pure=False)
    rest, numbers = iter(enumerate(items)), dict[str, int]()

    def send() -> list[Any]:
        threads = sum(client.nthreads().values())
        room = max(LEAST, AHEAD * threads) - len(numbers)
        chosen = list(islice(rest, max(0, room)))
        retries = {"retries": 0, "pure": False}
        futures = [client.submit(_do, shared, item, **retries) for _, item in chosen]
        numbers.update((f.key, n) for f, (n, _) in zip(futures, chosen, strict=True))
        return futures

    under_way = as_completed(send(), loop=client.loop, raise_errors=False)
    for future in under_way:
        worked: Worked[Result] = _worked(future, numbers.pop(future.key))
        future.release()
        under_way.update(send())
        yield worked


def _same(work: Callable[[Item], Result]) -> Callable[[Item], Result]:
    return work


def _do(work: Callable[[Item], Result], item: Item) -> Result:
    return work(item)


def _worked(future: Any, number: int) -> Worked[Any]:
    """The result of a task. Raises what it raised; RunError if the scheduler is lost."""
    from distributed.scheduler import KilledWorker

    if future.status == "finished":
        return Worked(number, future.result(), 1)
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return Worked(number, None, error.allowed_failures + 1)
    if error is not None:
        raise error
    raise _lost()


def _lost() -> RunError:
    hint = "call again: what is written is kept"
    return RunError(Diagnostic("Missing", "the Dask scheduler was lost", None, hint))
