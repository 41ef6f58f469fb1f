"""The header of a log: what its values must be, checked when the log is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, get_args

from factory.control.profile import World
from factory.layout.saved import LayoutTable
from factory.record.project_table import ProjectTable
from factory.support.tables import LARGE, value_of

Test = Callable[[Any], bool]


@dataclass(frozen=True, slots=True)
class Key:
    """A key of the header, with a dot within a table: what its value must be, in words, and the
    test of that; `later`: it may be missing."""

    name: str
    wanted: str
    is_good: Test = field(repr=False)
    later: bool = False

    def check(self, header: Mapping[str, Any]) -> None:
        """Raises ValueError where the value is missing or fails the test."""
        value: Any = header
        for word in self.name.split("."):
            if word not in value:
                if self.later:
                    return
                raise ValueError(f"its header has no '{self.name}'")
            value = value[word]
        if not self.is_good(value):
            message = f"in its header '{self.name}' must be {self.wanted}, not {value!r:.40}"
            raise ValueError(message)


def check_header(header: Any) -> None:
    """Raises ValueError where a value is missing, or no run can have it."""
    if not isinstance(header, dict):
        raise ValueError("its header is no table")
    for key in KEYS:
        key.check(header)
    ProjectTable.of(header)
    value_of(LayoutTable, header["layout"], "layout")
    if any(place >= len(header["places"]) for place in header["start"]):
        raise ValueError("in its header 'start' is out of range")


def of(kind: type) -> Test:
    """Whether a value is of a type."""
    return lambda v: isinstance(v, kind)


def whole(least: int, most: float) -> Test:
    """Whether a value is a whole number from `least` to `most`."""
    return lambda v: type(v) is int and least <= v <= most


def is_number(value: Any) -> bool:
    """Whether a value is a number, not too large."""
    return type(value) in (int, float) and -LARGE <= value <= LARGE


def is_positive(value: Any) -> bool:
    """Whether a value is a number above 0, not too large."""
    return is_number(value) and value > 0


is_table, is_text, is_count = of(dict), of(str), whole(0, LARGE)


def listed(test: Test, length: int | None = None) -> Test:
    """A list of such values, of so many if a length is given."""
    return lambda v: isinstance(v, list) and length in (None, len(v)) and all(map(test, v))


def tabled(test: Test) -> Test:
    """A table of such values."""
    return lambda v: isinstance(v, dict) and all(map(test, v.values()))


def maybe(test: Test) -> Test:
    """Such a value, or none."""
    return lambda v: v is None or test(v)


def is_choice(value: Any) -> bool:
    """Whether a value says of timestep and wip whether they were chosen."""
    return tabled(of(bool))(value) and value.keys() == {"timestep", "wip"}


KEYS = (
    Key("nq", "a whole number from 0", is_count),
    Key("nv", "a whole number from 0", is_count),
    Key("versions", "a table of texts", tabled(is_text)),
    Key("command", "a list of texts", listed(is_text)),
    Key("world", f"one of {', '.join(get_args(World))}", get_args(World).__contains__),
    Key("seed", "a whole number from 0", whole(0, inf)),
    Key("jitter", "a number from 0 to less than 1", lambda v: is_number(v) and 0 <= v < 1),
    Key("units", "a whole number from 1", whole(1, LARGE)),
    Key("wip", "a whole number from 1, or null", maybe(whole(1, LARGE))),
    Key("fuse", "true or false", of(bool)),
    Key("chosen", "true or false for timestep and wip", is_choice),
    Key("distributed", "true or false", of(bool)),
    Key("faults", "a table", of(dict), later=True),
    Key("start", "a list of numbers of places", listed(is_count)),
    Key("settings", "a table", is_table),
    Key("settings.timestep", "a number", is_number),
    Key("layout", "a table", is_table),
    Key("monitor", "a table", is_table),
    Key("monitor.goals", "lists of numbers", listed(listed(is_number))),
    Key("monitor.radii", "a list of numbers", listed(is_number)),
    Key("monitor.places", "a table of x, y, z", tabled(listed(is_number, 3))),
    Key("monitor.patience", "a time in s", is_positive),
    Key("robots", "a list of texts", listed(is_text)),
    Key("places", "a list of texts", listed(is_text)),
    Key("transitions", "a list of texts", listed(is_text)),
)
"""The keys that some reader uses."""
