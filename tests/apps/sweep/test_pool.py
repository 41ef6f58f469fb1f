"""The pool of processes: results by number, errors of the work, processes that die."""

from __future__ import annotations

import os
import signal
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from factory.apps.sweep import pool
from factory.apps.sweep.pool import over_processes
from factory.support.errors import Diagnostic, InputError


def squared(number: int) -> int:
    if number < 0:
        raise InputError(Diagnostic("BadValue", f"{number} is below 0"))
    return number**2


def deadly(mark: Path, number: int) -> tuple[int, str | None]:
    """Kills its process at 1 always, and at 2 the first time."""
    first = number == 2 and not mark.exists()
    if first:
        mark.touch()
    if number == 1 or first:
        os.kill(os.getpid(), signal.SIGKILL)
    return number, os.environ.get("POOLED")


def test_results_come_with_the_numbers_of_their_items() -> None:
    items = [5, 3, 9, 0]
    with closing(over_processes(squared, items, 2)) as results:
        found = {one.number: one.result for one in results}
    assert found == {n: item**2 for n, item in enumerate(items)}


def test_an_error_of_the_work_is_raised() -> None:
    with pytest.raises(InputError, match="-1 is below 0"):
        list(over_processes(squared, [2, -1], 1))


def test_a_process_that_dies_loses_its_item_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "TRIES", 2)
    work = partial(deadly, tmp_path / "mark")
    found = {one.number: one for one in over_processes(work, range(4), 2, {"POOLED": "yes"})}
    assert (found[1].result, found[1].tries, found[1].status) == (None, 2, -9)
    assert (found[2].result, found[2].tries) == ((2, "yes"), 2)
    assert all(found[n].result == (n, "yes") and found[n].tries == 1 for n in (0, 3))
    assert "POOLED" not in os.environ
