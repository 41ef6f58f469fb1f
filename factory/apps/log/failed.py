"""Failures and undos in a log, as JSON: the table of `Failures` in the last block, its additions
and the undos in blocks of ticks."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from factory.api import Failures, Undone
from factory.apps.log.blocks import Arrays
from factory.engine.record.failures import Account
from factory.support.tables import table_of, value_of

LISTS = "found", "stood"
"""The lists of an account: a block of ticks has the entries that were added to them."""


@dataclass(slots=True)
class Written:
    """Counts of what has been written of a run: `events`; of its account the failures `found`, -1
    before the first block, and the changes of which robots `stood`."""

    events: int
    found: int = -1
    stood: int = 0

    def complete(self, account: Account | None) -> None:
        """Mark all of an account as written."""
        if account is not None:
            self.found, self.stood = len(account.found), len(account.stood)

    def news(self, account: Account | None) -> bytes:
        """The additions to an account since the last call as JSON; empty where there are none."""
        if account is None or (self.found, self.stood) == (len(account.found), len(account.stood)):
            return b""
        table = table_of(account.report())
        for name, count in zip(LISTS, (self.found, self.stood), strict=True):
            table[name] = table.get(name, [])[max(count, 0) :]
        self.complete(account)
        return json.dumps(table).encode()


def failures_so_far(ticks: Sequence[Arrays], robots: frozenset[str]) -> Failures | None:
    """The failures up to the end of some blocks of ticks, None where these have none. Raises
    ValueError where a text is not what `Written.news` gives."""
    news = [json.loads(arrays["failures"].tobytes()) for arrays in ticks if "failures" in arrays]
    if not news:
        return None
    for new in news:
        failures_of(new, robots)
    return failures_of(
        {**news[-1], **{x: [y for new in news for y in new[x]] for x in LISTS}}, robots
    )


def failures_of(table: Any, robots: frozenset[str]) -> Failures:
    """The failures in a table. Raises ValueError."""
    failures = value_of(Failures, table, "failures")
    unknown = {name for _, names in failures.stood for name in names} - robots
    if unknown:
        raise ValueError(f"'{min(unknown)}' stood, which is no robot")
    counts = [failures.missed, failures.false_alarms, failures.undone, failures.spares]
    counts += [failures.contacts, failures.binned, *failures.struck.values()]
    if min(counts) < 0:
        raise ValueError("failures: counts must be whole numbers from 0")
    times = [failing.t for failing in failures.found] + [t for t, _ in failures.stood]
    if not all(t >= 0 for t in times):
        raise ValueError("failures: times must be from 0")
    return failures


Placed = tuple[int, Undone]
"""An undo, after the number of transitions that had fired before it. In a log: its `table_of`."""


def undone_in(ticks: Sequence[Arrays], header: Mapping[str, Any]) -> tuple[Placed, ...]:
    """The undos in the blocks of a log. Raises ValueError for an entry that is not one, that names
    an unknown transition, or that is out of order."""
    tables = [json.loads(arrays["undone"].tobytes()) for arrays in ticks if "undone" in arrays]
    kind: Any = tuple[Placed, ...]
    entries = tuple(entry for table in tables for entry in value_of(kind, table, "undone"))
    fired = sum(len(arrays["fired"]) for arrays in ticks)
    transitions, last = {*header["transitions"]}, 0
    for after, undone in entries:
        unknown = {*undone.asked, *undone.transitions} - transitions
        if unknown:
            raise ValueError(f"'{min(unknown)}' is undone, which is no transition")
        if not last <= after <= fired:
            raise ValueError(f"something is undone after {after} firings, not {last} to {fired}")
        if undone.t < 0:
            raise ValueError(f"something is undone at {undone.t} s, before the run")
        last = after
    return entries
