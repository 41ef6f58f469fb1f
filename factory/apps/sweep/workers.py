"""Items of work over the processes of this machine, or over the workers of a cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing

from factory.api import Diagnostic, RunError
from factory.apps.sweep.pool import NOTHING, Item, Result, Worked, over_processes


def each_of(
    work: Callable[[Item], Result], items: Sequence[Item], on: str | None
) -> Generator[tuple[int, Result], None, None]:
    """The results of `work` with the numbers of their items: one after the other in this process,
    or as they come from the workers of a scheduler (`on`). Raises RunError where workers die of an
    item."""
    if on is None:
        yield from enumerate(map(work, items))
        return
    with closing(over_workers(work, items, 1, on=on)) as results:
        for worked in results:
            if worked.result is None:
                message = f"the workers died in all {worked.tries} tries"
                raise RunError(Diagnostic("Killed", message, None, "give workers more memory"))
            yield worked.number, worked.result


def over_workers(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    jobs: int,
    variables: Mapping[str, str] = NOTHING,
    on: str | None = None,
) -> Generator[Worked[Result], None, None]:
    """As `over_processes`, or `over_cluster` where the address of a scheduler is given (`on`)."""
    if on is None:
        return over_processes(work, items, jobs, variables)
    from factory.apps.sweep.cluster import over_cluster

    return over_cluster(work, items, on)
