"""What a user may set, by option or in `factory.toml`: speeds, timestep, clearance."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

from factory.errors import Diagnostic, InputError, Position, did_you_mean

RANGES = {
    "speed": (1e-3, 100.0),
    "acceleration": (1e-3, 1e4),
    "eps": (1e-6, 0.02),
    "timestep": (1e-5, 0.02),
    "substeps": (1, 100),
    "clearance": (1e-4, 10.0),
    "force": (1e-3, 1e6),
    "settle": (1e-6, 10.0),
    "outfeed": (1e-3, 10.0),
}
"""Least and greatest value of each setting: beyond lie nothing but overflows and endless runs."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Speed [m/s] and acceleration [m/s²] of a robot; `eps`, radius of a goal ball [m]; `timestep`
    of the engine [s] and `substeps` of it in one tick of the supervisor; least `clearance` [m];
    `force`: the actuators' limit as a multiple of what the payload needs; `settle`: time to come to
    rest within eps [s], used only to predict; `outfeed` speed [m/s].
    """

    speed: float = 0.5
    acceleration: float = 2.0
    eps: float = 2e-4
    timestep: float = 0.002
    substeps: int = 5
    clearance: float = 0.02
    force: float = 3.0
    settle: float = 0.0
    outfeed: float = 1.0

    @property
    def outfeed_acceleration(self) -> float:
        """Of the outfeed's tray: twice that of a robot [m/s²]."""
        return 2 * self.acceleration

    @property
    def tick(self) -> float:
        """Period of the supervisor [s]."""
        return self.timestep * self.substeps

    def with_options(self, options: Mapping[str, float | int | None]) -> Settings:
        """These settings with every option that is not None put in place.

        Raises InputError (BadValue) with every number that is not within its range.
        """
        given = {name: value for name, value in options.items() if value is not None}
        faults = [_out_of_range(name, value) for name, value in given.items()]
        if any(faults):
            raise InputError(fault for fault in faults if fault)
        return replace(self, **given)  # type: ignore[arg-type]


def load_settings(path: Path) -> Settings:
    """The settings of a `factory.toml`; the defaults where there is no such file.

    Raises InputError with every fault of the file: broken TOML, an unknown key, or a value that is
    no number within its range.
    """
    if not path.is_file():
        return Settings()
    try:
        text = path.read_bytes().decode("utf-8-sig")
        table = tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise InputError(_broken(path, error)) from error
    faults = []
    for key, value in table.items():
        fault = _fault(key, value)
        if fault is not None:
            faults.append(replace(fault, position=_place(path, text, key)))
    if faults:
        raise InputError(faults)
    return Settings().with_options(
        {k: v if k == "substeps" else float(v) for k, v in table.items()}
    )


def _fault(key: str, value: object) -> Diagnostic | None:
    """What is wrong with a key of `factory.toml`."""
    if key not in RANGES:
        hint = did_you_mean(key, [f.name for f in fields(Settings)], "keys")
        return Diagnostic("UnknownParameter", f"unknown key '{key}'", None, hint)
    kind = "whole number" if key == "substeps" else "number"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return Diagnostic("BadValue", f"{key} must be a {kind}", None, _example(key))
    if key == "substeps" and not isinstance(value, int):
        return Diagnostic("BadValue", f"{key} must be a {kind}", None, _example(key))
    return _out_of_range(key, value)


def _out_of_range(name: str, value: float) -> Diagnostic | None:
    low, high = RANGES[name]
    if low <= value <= high:
        return None
    shown = f"{value:g}" if isinstance(value, float) else f"{value}"[:20]
    message = f"{name} = {shown} is not between {low:g} and {high:g}"
    return Diagnostic("BadValue", message, None, _example(name))


def _example(name: str) -> str:
    return f"for example {name} = {getattr(Settings(), name)}"


def _place(path: Path, text: str, key: str) -> Position:
    """Where a key stands in a file: its first mention at the start of a line, or in a header."""
    for number, line in enumerate(text.splitlines(), 1):
        if found := re.match(rf"""\s*\[*\s*["']?({re.escape(key)})\b""", line):
            return Position(str(path), number, found.start(1) + 1, line)
    return Position(str(path), 1, 1)


def _broken(path: Path, error: Exception) -> Diagnostic:
    """What tomllib says, at the place it speaks of."""
    words = getattr(error, "strerror", None) or str(error)
    found = re.search(r" \(at line (\d+), column (\d+)\)", words)
    if found is None:
        return Diagnostic("Syntax", words, Position(str(path), 1, 1), "see https://toml.io")
    line, column = int(found[1]), int(found[2])
    text = path.read_text("utf-8-sig").splitlines()[line - 1]
    at = Position(str(path), line, column, text)
    return Diagnostic("Syntax", words.replace(found[0], ""), at, "see https://toml.io")
