"""Catalogues of robot types: `mjcf/catalogue.toml`, with an MJCF file for each type, and those of
packages that an entry point of `factory.robots` names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from factory.floor.robots.reader import read_body
from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.extensions import extension_folders
from factory.support.resources import mjcf_folder
from factory.support.toml_files import read_toml
from factory.theory.problem.robot_types import Catalogue, RobotType

HINT = "see the shipped mjcf/catalogue.toml"

KEYS = ["mjcf", "extends", "summary"]
"""What an entry of a catalogue may have; `mjcf` it must have."""


def load_catalogue() -> Catalogue:
    """The shipped catalogue, with those of entry points.

    Raises InputError where a file is not readable TOML, or a type extends one that is not there,
    or itself, or is there already; where its MJCF is not that of a robot (BadRobot).
    """
    types: dict[str, RobotType] = {}
    for path in (each / "catalogue.toml" for each in (mjcf_folder(), *extension_folders("robots"))):
        more = _types(path)
        if twice := sorted(more.keys() & types.keys()):
            raise InputError(_trouble(path, f"there is a robot type '{twice[0]}' already"))
        types |= more
        for robot in more.values():
            _check_ancestry(path, robot, types)
    return Catalogue(types)


def _types(path: Path) -> dict[str, RobotType]:
    _, table = read_toml(path, HINT)
    types: dict[str, RobotType] = {}
    for name, entry in table.items():
        if not isinstance(entry, dict):
            raise InputError(_trouble(path, f"'{name}' is no table of a robot type"))
        for key, value in entry.items():
            if key not in KEYS:
                hint = did_you_mean(key, KEYS, "keys")
                raise InputError(_trouble(path, f"'{name}' has the unknown key '{key}'", hint))
            if not isinstance(value, str):
                raise InputError(_trouble(path, f"{key} of '{name}' is {value!r}, not a text"))
        if "mjcf" not in entry:
            raise InputError(_trouble(path, f"'{name}' has no 'mjcf', the name of its file"))
        file = path.parent / entry["mjcf"]
        extends, summary = entry.get("extends", ""), entry.get("summary", "")
        types[name] = RobotType(name, file, read_body(name, file), extends, summary)
    return types


def _check_ancestry(path: Path, robot: RobotType, types: Mapping[str, RobotType]) -> None:
    seen, current = {robot.name}, robot
    while current.extends:
        if current.extends not in types:
            hint = did_you_mean(current.extends, list(types), "robot types")
            raise InputError(
                _trouble(path, f"'{current.name}' extends unknown '{current.extends}'", hint)
            )
        if current.extends in seen:
            raise InputError(_trouble(path, f"'{robot.name}' extends itself"))
        current = types[current.extends]
        seen.add(current.name)
        lacking = [word for word in current.body.motions if word not in robot.body.motions]
        if lacking or current.travels != robot.travels:
            message = f"'{robot.name}' extends '{current.name}' and cannot do as that does"
            hint = f"valid: an MJCF with all joints of {current.mjcf.name}"
            raise InputError(Diagnostic("BadRobot", message, Position(str(robot.mjcf), 1, 1), hint))


def _trouble(path: Path, message: str, hint: str = HINT) -> Diagnostic:
    return Diagnostic("BadTemplate", message, Position(str(path), 1, 1), hint)
