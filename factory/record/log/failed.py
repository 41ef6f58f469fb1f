"""What went wrong in a run, as a log keeps it, where the run goes on after failures: JSON in its
last block, and in blocks of ticks so far as it was known then."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from factory.record.failures import Account, Failing, Failures, Stood
from factory.record.log.blocks import Arrays
from factory.record.log.header import Key, is_count, is_table, is_text, listed
from factory.support.tables import LARGE


def _is_time(value: Any) -> bool:
    return type(value) in (int, float) and 0 <= value <= LARGE


def _is_listed(value: Any) -> bool:
    return isinstance(value, list)


def _is_tally(value: Any) -> bool:
    return is_table(value) and all(is_text(k) and is_count(v) for k, v in value.items())


_TIME = f"a time in s, at most {LARGE}"
_COUNT = "a whole number from 0"

_KEYS = (
    Key("struck", "how many faults there were of each kind", _is_tally),
    *(
        Key(name, _COUNT, is_count)
        for name in ("missed", "false_alarms", "transitions_undone", "spares_used")
    ),
    Key("fault_contacts", _COUNT, is_count),
    Key("binned", _COUNT, is_count, later=True),
    Key("spilled", "a list of robots", listed(is_text), later=True),
    Key("standing", "a list of which robots stood", _is_listed),
    Key("failures", "a list of failures", _is_listed),
)

_OF_STOOD = (Key("t", _TIME, _is_time), Key("robots", "a list of robots", listed(is_text)))

_OF_FAILING = (
    Key("t", _TIME, _is_time),
    *(Key(name, "a text", is_text) for name in ("test", "operation", "response")),
    Key("robot", "a text, or null", lambda v: v is None or is_text(v)),
    Key("scrapped", "a list of labels", listed(is_text)),
    Key("until", _TIME, _is_time, later=True),
    Key("deputy", "a robot", is_text, later=True),
)


LISTS = "failures", "standing"
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
        told = account.report().as_json()
        news = zip(LISTS, (account.found, account.stood), (self.found, self.stood), strict=True)
        told |= {name: told[name][max(known, 0) :] for name, _, known in news}  # type: ignore[index]
        self.goes_on(account)
        return json.dumps(told).encode()


def failures_so_far(ticks: Sequence[Arrays], robots: frozenset[str]) -> Failures | None:
    """What went wrong up to the end of some blocks of ticks, None where these do not tell. Raises
    ValueError where a text is not what `Told.news` gives."""
    news = [json.loads(arrays["failures"].tobytes()) for arrays in ticks if "failures" in arrays]
    if not news:
        return None
    told = dict(_checked(news[-1], _KEYS))
    for name in LISTS:
        told[name] = [one for new in news for one in _checked(new, _KEYS)[name]]
    return failures_of(told, robots)


def failures_in(content: bytes, robots: frozenset[str]) -> Failures:
    """What went wrong in the run of a log whose robots have these names. Raises ValueError where
    the text is not what `Failures.as_json` gives."""
    return failures_of(json.loads(content), robots)


def failures_of(content: Any, robots: frozenset[str]) -> Failures:
    """The inverse of `Failures.as_json`. Raises ValueError."""
    told = _checked(content, _KEYS)
    stood = tuple(_stood(_checked(entry, _OF_STOOD)) for entry in told["standing"])
    unknown = {name for _, names in stood for name in names} - robots
    if unknown:
        raise ValueError(f"'{min(unknown)}' stood, which is no robot")
    return Failures(
        tuple(_failing(_checked(entry, _OF_FAILING)) for entry in told["failures"]),
        told["struck"],
        told["missed"],
        told["false_alarms"],
        told["transitions_undone"],
        told["spares_used"],
        told["fault_contacts"],
        stood,
        told.get("binned", 0),
        tuple(told.get("spilled", ())),
    )


def _checked(entry: Any, keys: tuple[Key, ...]) -> Mapping[str, Any]:
    if not isinstance(entry, dict):
        raise ValueError(f"what went wrong is no table: {entry!r:.40}")
    for key in keys:
        key.check(entry)
    return entry


def _stood(entry: Mapping[str, Any]) -> Stood:
    return float(entry["t"]), tuple(entry["robots"])


def _failing(entry: Mapping[str, Any]) -> Failing:
    names = entry["test"], entry["operation"], entry["robot"] or "", entry["response"]
    more = tuple(entry["scrapped"]), entry.get("until"), entry.get("deputy", "")
    return Failing(float(entry["t"]), *names, *more)
