"""Campaigns as TOML files, with one table [[fault]] for each deviation: read and written."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from factory.api import Diagnostic, Factory, InputError
from factory.apps.deviations.campaign import CLEAR, SWAP, Campaign, Sensors, impossible
from factory.apps.deviations.deviation import KINDS, Deviation, misfits
from factory.support.errors import Position, did_you_mean
from factory.support.tables import table_of
from factory.support.toml_files import key_position, read_toml

EXAMPLE = 'for example [[fault]], and below it kind = "drop", label = "part1", unit = 2'


def _types(hint: Any) -> list[Any]:
    """The types of a union, without what they hold."""
    return [get_origin(kind) or kind for kind in get_args(hint)]


KEYS: Mapping[str, type] = {"seed": int, "clear": float, "sensors": dict, "fault": list}
OF_FAULT: Mapping[str, type] = {
    name: next(kind for kind in (str, bool, int, float, tuple) if kind in (hint, *_types(hint)))
    for name, hint in get_type_hints(Deviation).items()
}
"""The type of each key of a deviation in a file."""

OF_SENSORS: Mapping[str, type] = {field.name: float for field in fields(Sensors)}
MOST = 1e9
"""The greatest number that a file may give."""

WORDS = {
    int: f"a whole number from 0 to {MOST:g}",
    float: f"a number from 0 to {MOST:g}",
    str: "a text",
    bool: "true or false",
    dict: "a table",
    list: "a list of tables [[fault]]",
    tuple: f"a list of three numbers within ±{MOST:g}",
}

Place = Callable[[str], Position]
"""From a key to its position in a file."""

HEADER = re.compile(r"""^[ \t]*\[\[\s*(?:fault|"fault"|'fault')\s*\]\]""", re.M)
ANY_HEADER = re.compile(r"^[ \t]*\[", re.M)


def read_campaign(
    path: Path,
    spares: int = 0,
    swap: float = SWAP,
    factory: Factory | None = None,
    has_bodies: bool = True,
) -> Campaign:
    """The campaign described by a file, with `spares` spare robots, each exchanged within `swap`
    [s], for a `factory` if one is given, in a world with or without bodies. Raises InputError with
    every error of the file, at its line: BadFile, Syntax, UnknownParameter, BadValue, BadFault."""
    text, values = read_toml(path, EXAMPLE)
    reader = _Reader(path, text)
    reader.check(values, KEYS, "", reader.anywhere)
    sensors = values.get("sensors", {})
    if isinstance(sensors, dict):
        reader.check(sensors, OF_SENSORS, "in [sensors]", reader.anywhere)
    tables = values.get("fault", [])
    faults = [*reader.faults(tables if isinstance(tables, list) else [], factory, has_bodies)]
    if reader.wrong:
        raise InputError(reader.wrong)
    numbers = {k: float(v) for k, v in sensors.items()}
    clear = float(values.get("clear", CLEAR))
    seed = values.get("seed", 0)
    return Campaign(tuple(faults), seed, clear, Sensors(**numbers), spares, swap)


def written(campaign: Campaign) -> str:
    """The text of a file that `read_campaign` reads as this campaign. The spares are no part of it:
    they are options of a run."""
    table = table_of(replace(campaign, spares=0, swap=SWAP))
    faults, sensors = table.pop("faults", ()), table.pop("sensors", {})
    blocks = [_lines(table)]
    blocks += [["[sensors]", *_lines(sensors)]] if sensors else []
    blocks += [["[[fault]]", *_lines(fault)] for fault in faults]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _lines(table: Mapping[str, Any]) -> list[str]:
    """Keys and values in TOML, whose texts, lists and numbers are those of JSON but for DEL."""
    texts = {key: json.dumps(value, ensure_ascii=False) for key, value in table.items()}
    return [f"{key} = {text}".replace("\x7f", "\\u007f") for key, text in texts.items()]


class _Reader:
    """Collects the errors of a file."""

    def __init__(self, path: Path, text: str) -> None:
        self.path, self.text = path, text
        self.wrong: list[Diagnostic] = []

    def anywhere(self, key: str) -> Position:
        """The position of a key that stands once in the file."""
        return key_position(self.path, self.text, key)

    def check(
        self, values: Mapping[str, Any], types: Mapping[str, type], where: str, place: Place
    ) -> None:
        """Check that every key is known and that its value has the right type and size."""
        for key, value in values.items():
            if key not in types:
                message = " ".join(filter(None, (f"unknown key '{key}'", where)))
                hint = did_you_mean(key, [*types], "keys")
                self.wrong.append(Diagnostic("UnknownParameter", message, place(key), hint))
            elif not _is(value, types[key]):
                message = f"{key} must be {WORDS[types[key]]}"
                self.wrong.append(Diagnostic("BadValue", message, place(key), EXAMPLE))

    def faults(
        self, tables: list[Any], factory: Factory | None, has_bodies: bool
    ) -> Iterator[Deviation]:
        """The deviations whose tables are valid."""
        for number, table in enumerate(tables):
            place, before = self._place(number, len(tables)), len(self.wrong)
            if not isinstance(table, dict):
                message = "a fault is a table"
                self.wrong.append(Diagnostic("BadFault", message, place("kind"), EXAMPLE))
                continue
            self.check(table, OF_FAULT, "of a fault", place)
            if len(self.wrong) > before:
                continue
            self.wrong += _misfits(table, place)
            if len(self.wrong) > before:
                continue
            fault = Deviation(**{key: _value(value, OF_FAULT[key]) for key, value in table.items()})
            wrong = impossible(fault, factory, has_bodies)
            self.wrong += [replace(error, position=place(key)) for key, error in wrong]
            yield fault

    def _place(self, number: int, count: int) -> Place:
        """Where the keys of a table [[fault]] are; its header for a key that is not there."""
        starts = [match.start() for match in HEADER.finditer(self.text)]
        if len(starts) != count:
            return lambda _: self.anywhere("fault")
        after = ANY_HEADER.search(self.text, self.text.index("]]", starts[number]))
        text = self.text[starts[number] : after.start() if after else None]
        above = self.text.count("\n", 0, starts[number])

        def place(key: str) -> Position:
            at = key_position(self.path, text, key or "fault")
            at = at if at.text else key_position(self.path, text, "fault")
            return replace(at, line=at.line + above)

        return place


def _misfits(table: Mapping[str, Any], place: Place) -> Iterator[Diagnostic]:
    kind = table.get("kind", "")
    if not kind:
        yield Diagnostic("BadFault", "this fault has no 'kind'", place(""), EXAMPLE)
        return
    hint = EXAMPLE if kind in KINDS else did_you_mean(kind, [*KINDS], "kinds of faults")
    values = {k: _value(v, OF_FAULT[k]) for k, v in table.items() if k != "kind" and v is not False}
    for key, message in misfits(kind, values):
        yield Diagnostic("BadFault", message, place(key), hint)


def _value(value: Any, kind: type) -> Any:
    """A value of a file, of the type that it has in a deviation."""
    if kind is tuple:
        return tuple(map(float, value))
    return float(value) if kind is float else value


def _is(value: object, kind: type) -> bool:
    """Whether a value of a file has a type, and its numbers are in their range."""
    if isinstance(value, bool) or kind is bool:
        return isinstance(value, bool) and kind is bool
    if kind is tuple:
        return isinstance(value, list) and len(value) == 3 and all(map(_is_bounded, value))
    if kind in (int, float):
        return isinstance(value, int if kind is int else int | float) and 0 <= value <= MOST
    return isinstance(value, kind)


def _is_bounded(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and -MOST <= value <= MOST
