"""What was undone in a run, as a log keeps it: JSON in a block of ticks, where there is any."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from factory.nets.undone import Undone
from factory.record.log.blocks import Arrays
from factory.support.tables import value_of

Placed = tuple[int, Undone]
"""How many transitions had fired before something was undone in the run, and that. A log has it as
`table_of` gives it."""


def undone_in(ticks: Sequence[Arrays], header: Mapping[str, Any]) -> tuple[Placed, ...]:
    """What was undone in the blocks of a log. Raises ValueError where an entry is none, names a
    transition that is not there, or does not come after the one before."""
    tables = [json.loads(arrays["undone"].tobytes()) for arrays in ticks if "undone" in arrays]
    found = tuple(one for table in tables for one in _entries(table))
    fired = sum(len(arrays["fired"]) for arrays in ticks)
    known, robots, last = {*header["transitions"]}, {*header["robots"]}, 0
    for after, undone in found:
        unknown = {*undone.asked, *undone.transitions} - known
        if unknown:
            raise ValueError(f"'{min(unknown)}' is undone, which is no transition")
        if strange := {*undone.robots} - robots:
            raise ValueError(f"'{min(strange)}' is exchanged, which is no robot")
        if not last <= after <= fired:
            raise ValueError(f"something is undone after {after} firings, not {last} to {fired}")
        if undone.t < 0:
            raise ValueError(f"something is undone at {undone.t} s, before the run")
        last = after
    return found


def _entries(table: Any) -> tuple[Placed, ...]:
    kind: Any = tuple[Placed, ...]
    made: tuple[Placed, ...] = value_of(kind, table, "undone")
    return made
