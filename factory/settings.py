"""What a user may set, by option or in `factory.toml`: speeds, timestep, clearance."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

from factory.errors import Diagnostic, InputError, Position, did_you_mean


@dataclass(frozen=True, slots=True)
class Settings:
    """Speed [m/s] and acceleration [m/s²] of a robot; `eps`, radius of a goal ball [m]; `timestep` of the
    engine [s] and `substeps` of it in one tick of the supervisor; least `clearance` [m]; `force`: the
    actuators' limit as a multiple of what the payload needs; `settle`: time to come to rest within
    eps [s], used only to predict; `outfeed` speed [m/s].
    """

    speed: float = 0.5
    acceleration: float = 2.0
    eps: float = 2e-4
    timestep: float = 0.002
    substeps: int = 5
    clearance: float = 0.02
    force: float = 3.0
    settle: float = 0.015
    outfeed: float = 0.3

    @property
    def tick(self) -> float:
        """Period of the supervisor [s]."""
        return self.timestep * self.substeps

    def with_options(self, options: Mapping[str, float | int | None]) -> Settings:
        """These settings with every option that is not None put in place.

        Raises InputError (BadValue) for a number that is not positive and finite.
        """
        given = {name: value for name, value in options.items() if value is not None}
        for name, value in given.items():
            if not 0 < value < float("inf"):
                message = f"{name} = {value:g} must be positive and finite"
                raise InputError(
                    Diagnostic(
                        "BadValue", message, None, f"for example {name} = {getattr(self, name)}"
                    )
                )
        return replace(self, **given)  # type: ignore[arg-type]


def load_settings(path: Path) -> Settings:
    """The settings of a `factory.toml`; the defaults where there is no such file.

    Raises InputError for broken TOML, an unknown key or a value that is no positive number.
    """
    if not path.is_file():
        return Settings()
    try:
        table = tomllib.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(_trouble(path, "Syntax", str(error), "see https://toml.io")) from error
    known = [f.name for f in fields(Settings)]
    for key, value in table.items():
        if key not in known:
            hint = did_you_mean(key, known, "keys")
            raise InputError(_trouble(path, "UnknownParameter", f"unknown key '{key}'", hint))
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(
                _trouble(
                    path,
                    "BadValue",
                    f"{key} must be a number",
                    f"{key} = {getattr(Settings(), key)}",
                )
            )
    if "substeps" in table:
        table["substeps"] = int(table["substeps"])
    return Settings().with_options(table)


def _trouble(path: Path, code: str, message: str, hint: str) -> Diagnostic:
    return Diagnostic(code, message, Position(str(path), 1, 1), hint)
