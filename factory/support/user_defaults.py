"""The user's own defaults: the file `factory.toml`, beside the PAG or else in the current folder.

Options take precedence over the environment, that over the file, and that over what is built in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.settings import MOST_BRANCHES, Settings, wrong_type
from factory.support.toml_files import key_position, read_toml

NAME = Settings.FILE

OPTIONS: Mapping[str, object] = {
    "world": "mujoco",
    "units": 1,
    "seed": 0,
    "jitter": 0.3,
    "wip": 2,
    "floor": "4x3",
    "robots": 12,
    "cycle": 4.0,
    "platen": True,
    "tile": 0.24,
    "templates": ["mine"],
    "size": "1280x720",
    "fps": 30,
    "camera": "overview",
    "lenient": True,
    "strict": True,
}
"""The keys that are options of commands, each with an example; the others are those of Settings,
LINES, TEES, PARALLEL and ARMS."""

TEES = "tees"
"""A table of lists of two labels each: their robots share the last stretch of their ways."""

LINES = "lines"
"""A table of lists of labels: those of one list share a robot."""

PARALLEL = "parallel"
"""A table of labels, each with how often the branch that brings it is there."""

ARMS = "arms"
"""A table of the arms of a cell, each a table of its own."""

_KINDS = {
    str: "a text in quotes",
    int: "a whole number",
    float: "a number",
    list: "a list of texts",
    bool: "true or false",
}


@dataclass(frozen=True, slots=True)
class Defaults:
    """The values of a `factory.toml` by key, settings and options apart."""

    path: Path = Path(NAME)
    text: str = field(default="", repr=False)
    values: Mapping[str, Any] = field(default_factory=dict)

    def settings(self) -> Settings:
        """The settings of the file, with the built-in defaults for the others."""
        values = {k: v for k, v in self.values.items() if k in Settings.RANGES}
        return Settings().with_options(
            {
                k: v if k in Settings.WHOLE or Settings.is_auto(k, v) else float(v)
                for k, v in values.items()
            }
        )

    def options(self) -> dict[str, Any]:
        """The values of options; folders are those beside the file."""
        values = {k: v for k, v in self.values.items() if k in OPTIONS}
        if "templates" in values:
            values["templates"] = tuple(self.path.parent / folder for folder in values["templates"])
        return values

    def lines(self) -> tuple[tuple[str, ...], ...]:
        """The labels that share a robot, line by line."""
        return tuple(map(tuple, self.values.get(LINES, {}).values()))

    def tees(self) -> tuple[tuple[str, ...], ...]:
        """The labels whose robots share a stem, tee by tee."""
        return tuple(map(tuple, self.values.get(TEES, {}).values()))

    def parallel(self) -> dict[str, int]:
        """The number of parallel branches of each label."""
        return dict(self.values.get(PARALLEL, {}))

    def arms(self) -> dict[str, dict[str, Any]]:
        """What is said of each arm of a cell, by its name."""
        return dict(self.values.get(ARMS, {}))

    def at(self, key: str) -> Position:
        """The place of a key."""
        return key_position(self.path, self.text, key)


def defaults_for(file: Path) -> Defaults:
    """The defaults for a PAG. Raises InputError."""
    beside = file.parent / NAME
    return load_defaults(beside if beside.is_file() else Path(NAME))


def load_defaults(path: Path) -> Defaults:
    """The defaults in a file; none where there is no such file.

    Raises InputError with every fault: broken TOML, an unknown key, a value of the wrong type or
    out of its range.
    """
    if not path.is_file():
        return Defaults(path)
    defaults = Defaults(path, *read_toml(path, "see https://toml.io"))
    faults = []
    for key, value in defaults.values.items():
        fault = _fault(key, value)
        if fault is not None:
            faults.append(replace(fault, position=defaults.at(key)))
    if faults:
        raise InputError(faults)
    return defaults


def _fault(key: str, value: object) -> Diagnostic | None:
    """What is wrong with a key and its value."""
    if key in Settings.RANGES:
        return wrong_type(key, value)
    if key in (LINES, TEES):
        example = f'{"side" if key == LINES else "stem"} = ["part2", "part3"]'
        return _fault_of_table(key, value, _is_line, "lists of labels", example)
    if key == PARALLEL:
        what = f"labels with whole numbers from 1 to {MOST_BRANCHES}"
        return _fault_of_table(key, value, _is_number, what, "sub2 = 3")
    if key == ARMS:
        example = 'left = { type = "six", labels = ["part2"] }'
        return _fault_of_table(key, value, lambda row: isinstance(row, dict), "tables", example)
    if key not in OPTIONS:
        hint = did_you_mean(key, [*Settings.RANGES, *OPTIONS, LINES, TEES, PARALLEL, ARMS], "keys")
        return Diagnostic("UnknownParameter", f"unknown key '{key}'", None, hint)
    kind = type(OPTIONS[key])
    right = isinstance(value, int | float if kind is float else kind)
    if isinstance(value, list):
        right = right and all(isinstance(item, str) for item in value)
    if right and isinstance(value, bool) == (kind is bool):
        return None
    example = repr(OPTIONS[key]).replace("'", '"').replace("True", "true")
    message = f"{key} must be {_KINDS[kind]}"
    return Diagnostic("BadValue", message, None, f"for example {key} = {example}")


def _fault_of_table(
    key: str, value: object, valid: Callable[[Any], bool], what: str, example: str
) -> Diagnostic | None:
    """What is wrong with a table, whose values must be `valid`."""
    if isinstance(value, dict) and all(map(valid, value.values())):
        return None
    hint = f"for example a line [{key}], and below it {example}"
    return Diagnostic("BadValue", f"{key} must be a table of {what}", None, hint)


def _is_line(row: object) -> bool:
    return isinstance(row, list) and all(isinstance(label, str) for label in row)


def _is_number(number: object) -> bool:
    return type(number) is int and 1 <= number <= MOST_BRANCHES
