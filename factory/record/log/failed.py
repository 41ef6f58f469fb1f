"""What went wrong in a run, as a log keeps it, where the run goes on after failures: the table of
`Failures` in its last block, and in blocks of ticks so far as it was known then."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from factory.record.failures import Account, Failures
from factory.record.log.blocks import Arrays
from factory.support.tables import table_of, value_of

LISTS = "found", "stood"
"""What becomes longer: a block of ticks has what is new of it."""


@dataclass(slots=True)
class Told:
    """How much of a run has been written: so many `events`; of its account so many failures `found`
    and changes of which robots `stood`, -1 where nothing of it has."""

    events: int
    found: int = -1
    stood: int = 0

    def goes_on(self, account: Account | None) -> None:
        """All has been written."""
        if account is not None:
            self.found, self.stood = len(account.found), len(account.stood)

    def news(self, account: Account | None) -> bytes:
        """What is to be written now, nothing where there is nothing new."""
        if account is None or (self.found, self.stood) == (len(account.found), len(account.stood)):
            return b""
        told = table_of(account.report())
        for name, known in zip(LISTS, (self.found, self.stood), strict=True):
            told[name] = told.get(name, [])[max(known, 0) :]
        self.goes_on(account)
        return json.dumps(told).encode()


def failures_so_far(ticks: Sequence[Arrays], robots: frozenset[str]) -> Failures | None:
    """What went wrong up to the end of some blocks of ticks, None where these do not tell. Raises
    ValueError where a text is not what `Told.news` gives."""
    news = [json.loads(arrays["failures"].tobytes()) for arrays in ticks if "failures" in arrays]
    if not news:
        return None
    for new in news:
        failures_of(new, robots)
    return failures_of(
        {**news[-1], **{x: [y for new in news for y in new[x]] for x in LISTS}}, robots
    )


def failures_in(content: bytes, robots: frozenset[str]) -> Failures:
    """What went wrong in the run of a log whose robots have these names. Raises ValueError where
    the text is not the table of `Failures`."""
    return failures_of(json.loads(content), robots)


def failures_of(table: Any, robots: frozenset[str]) -> Failures:
    """The failures in a table. Raises ValueError."""
    found = value_of(Failures, table, "failures")
    unknown = {name for _, names in found.stood for name in names} - robots
    if unknown:
        raise ValueError(f"'{min(unknown)}' stood, which is no robot")
    counts = (*found.struck.values(), found.missed, found.false_alarms, found.undone, found.spares)
    if min(*counts, found.contacts, found.binned) < 0:
        raise ValueError("failures: counts must be whole numbers from 0")
    if any(not t >= 0 for t in (*(one.t for one in found.found), *(t for t, _ in found.stood))):
        raise ValueError("failures: times must be from 0")
    return found
