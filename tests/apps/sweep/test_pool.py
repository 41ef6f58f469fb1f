"""The pool of processes: results by number, errors of the work, processes that die."""

from __future__ import annotations

from contextlib import closing

import pytest

from factory.apps.sweep.pool import over_processes
from factory.support.errors import Diagnostic, InputError


def squared(number: int) -> int:
    if number < 0:
        raise InputError(Diagnostic("BadValue", f"{number} is below 0"))
    return number**2


def test_results_come_with_the_numbers_of_their_items() -> None:
    items = [5, 3, 9, 0]
    with closing(over_processes(squared, items, 2)) as results:
        found = {one.number: one.result for one in results}
    assert found == {n: item**2 for n, item in enumerate(items)}


def test_an_error_of_the_work_is_raised() -> None:
    with pytest.raises(InputError, match="-1 is below 0"):
        list(over_processes(squared, [2, -1], 1))
