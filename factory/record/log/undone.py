"""What was undone in a run, as a log keeps it: JSON in a block of ticks, where there is any."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from factory.nets.undone import Undone
from factory.record.log.blocks import Arrays
from factory.record.log.header import Key, is_text, listed, whole
from factory.support.tables import LARGE

Placed = tuple[int, Undone]
"""What was undone, and how many transitions had fired before it in the run."""

_KEYS = (
    Key(
        "t", f"a time in s, at most {LARGE}", lambda v: type(v) in (int, float) and 0 <= v <= LARGE
    ),
    Key("after", "a whole number from 0", whole(0, LARGE)),
    Key("operation", "a text", is_text),
    Key("reason", "a text", is_text),
    Key("asked", "a list of transitions", listed(is_text)),
    Key("transitions", "a list of transitions", listed(is_text)),
    Key("exchanged", "true or false", lambda v: isinstance(v, bool), later=True),
    Key("robots", "a list of robots", listed(is_text), later=True),
)


def undone_as_json(undone: Undone, after: int) -> dict[str, object]:
    """What was undone when so many transitions had fired; `undone_in` is the inverse."""
    return {
        "t": undone.t,
        "after": after,
        "operation": undone.operation,
        "reason": undone.reason,
        "asked": list(undone.asked),
        "transitions": list(undone.transitions),
        **({"exchanged": True} if undone.exchanged else {}),
        **({"robots": list(undone.robots)} if undone.robots else {}),
    }


def undone_in(ticks: Sequence[Arrays], header: Mapping[str, Any]) -> tuple[Placed, ...]:
    """What was undone in the blocks of a log. Raises ValueError where an entry is none, names a
    transition that is not there, or does not come after the one before."""
    found = tuple(_placed(entry) for arrays in ticks for entry in _entries(arrays))
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
        last = after
    return found


def _entries(arrays: Arrays) -> Iterator[Any]:
    if "undone" in arrays:
        entries = json.loads(arrays["undone"].tobytes())
        if not isinstance(entries, list):
            raise ValueError("what was undone is no list")
        yield from entries


def _placed(entry: Any) -> Placed:
    if not isinstance(entry, dict):
        raise ValueError(f"what was undone is no table: {entry!r:.40}")
    for key in _KEYS:
        key.check(entry)
    names = tuple(entry["asked"]), tuple(entry["transitions"])
    what = float(entry["t"]), entry["operation"], entry["reason"]
    more = entry.get("exchanged", False), tuple(entry.get("robots", ()))
    return entry["after"], Undone(*what, *names, *more)
