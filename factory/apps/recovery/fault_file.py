"""Fault campaigns as TOML files, with one table [[fault]] for each fault."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from factory.api import Diagnostic, Factory, InputError, Position, did_you_mean
from factory.apps.recovery.faults import CLEAR, KINDS, OF_LABEL, SWAP, Campaign, Sensors, WorldFault
from factory.support.user_defaults import key_position, read_toml

EXAMPLE = 'for example [[fault]], and below it kind = "drop", label = "part1", unit = 2'

KEYS: Mapping[str, type] = {"seed": int, "clear": float, "sensors": dict, "fault": list}
OF_FAULT: Mapping[str, type] = {
    "kind": str,
    "label": str,
    "robot": str,
    "unit": int,
    "at": float,
    "rate": float,
    "seconds": float,
    "metres": float,
    "degrees": float,
    "hidden": bool,
}
OF_SENSORS: Mapping[str, type] = {field.name: float for field in fields(Sensors)}
MOST = 1e9
"""The greatest number that a file may give."""

WORDS = {int: "a whole number", float: "a number", str: "a text", bool: "true or false"}
WORDS |= {dict: "a table", list: "a list of tables [[fault]]"}


def read_campaign(path: Path, spares: int = 0, swap: float = SWAP) -> Campaign:
    """The campaign described by a file, with `spares` spare robots, each exchanged within `swap`
    [s]. Raises InputError with every error of the file: BadFile, Syntax, UnknownParameter,
    BadValue, BadFault."""
    text, values = read_toml(path, EXAMPLE)
    reader = _Reader(path, text)
    reader.check(values, KEYS, "")
    sensors = values.get("sensors", {})
    if isinstance(sensors, dict):
        reader.check(sensors, OF_SENSORS, "in [sensors]")
    tables = values.get("fault", [])
    faults = [*reader.faults(tables if isinstance(tables, list) else [])]
    if reader.wrong:
        raise InputError(reader.wrong)
    numbers = {k: float(v) for k, v in sensors.items()}
    clear = float(values.get("clear", CLEAR))
    seed = values.get("seed", 0)
    return Campaign(tuple(faults), seed, clear, Sensors(**numbers), spares, swap)


class _Reader:
    """Collects the errors of a file."""

    def __init__(self, path: Path, text: str) -> None:
        self.path, self.text = path, text
        self.wrong: list[Diagnostic] = []

    def check(self, values: Mapping[str, Any], types: Mapping[str, type], where: str) -> None:
        """Check that every key is known and that its value has the right type and is not
        negative."""
        for key, value in values.items():
            at = key_position(self.path, self.text, key)
            if key not in types:
                message = " ".join(filter(None, (f"unknown key '{key}'", where)))
                hint = did_you_mean(key, [*types], "keys")
                self.wrong.append(Diagnostic("UnknownParameter", message, at, hint))
            elif not _is(value, types[key]) or (_is(value, float) and not 0 <= value <= MOST):
                least = f" from 0 to {MOST:g}" if types[key] in (int, float) else ""
                message = f"{key} must be {WORDS[types[key]]}{least}"
                self.wrong.append(Diagnostic("BadValue", message, at, EXAMPLE))

    def faults(self, tables: list[Any]) -> Iterator[WorldFault]:
        """The faults whose tables are valid."""
        starts = [m.start() for m in re.finditer(r"^\s*\[\[\s*fault\s*\]\]", self.text, re.M)]
        for number, table in enumerate(tables):
            line = self.text.count("\n", 0, starts[number]) + 1 if number < len(starts) else 1
            at = Position(str(self.path), line, 1, "[[fault]]")
            before = len(self.wrong)
            if not isinstance(table, dict):
                self.wrong.append(Diagnostic("BadFault", "a fault is a table", at, EXAMPLE))
                continue
            self.check(table, OF_FAULT, "of a fault")
            if len(self.wrong) == before and (fault := self._fault(table, at)):
                yield fault

    def _fault(self, table: Mapping[str, Any], at: Position) -> WorldFault | None:
        kind = table.get("kind", "")
        if kind not in KINDS:
            hint = did_you_mean(str(kind), [*KINDS], "kinds of faults")
            message = f"there is no fault '{kind}'" if kind else "this fault has no 'kind'"
            self.wrong.append(Diagnostic("BadFault", message, at, hint))
            return None
        try:
            values: dict[str, Any] = dict(table)
            numbers = {k: float(v) for k, v in values.items() if OF_FAULT[k] is float}
            return WorldFault(**(values | numbers))
        except ValueError as error:
            self.wrong.append(Diagnostic("BadFault", str(error), at, EXAMPLE))
            return None


def _is(value: object, kind: type) -> bool:
    if isinstance(value, bool) or kind is bool:
        return isinstance(value, bool) and kind is bool
    return isinstance(value, int | float if kind is float else kind)


def check_names(campaign: Campaign, factory: Factory) -> None:
    """Raises InputError (BadFault) if a fault names a robot or label that the factory lacks, or a
    label that this kind of fault cannot concern."""
    robots = [robot.name for robot in factory.robots]
    parts, joined, every = (
        [*dict.fromkeys(name for o in some for name in (o.label, o.written))]
        for some in (
            factory.leaves,
            [o for o in factory.making if len(o.inputs) > 1],
            factory.making,
        )
    )
    wrong = list[Diagnostic]()
    for fault in campaign.faults:
        labels, what = every, "labels"
        if fault.kind in OF_LABEL:
            is_joint = fault.kind == "bad_joint"
            labels, what = (joined, "joined labels") if is_joint else (parts, "parts")
        for name, names, kinds in ((fault.robot, robots, "robots"), (fault.label, labels, what)):
            if name and name not in names:
                message = f"'{fault.kind}' names '{name}', which is none of the {kinds}"
                wrong.append(
                    Diagnostic("BadFault", message, None, did_you_mean(name, names, kinds))
                )
    if wrong:
        raise InputError(wrong)
