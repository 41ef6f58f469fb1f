"""Robot types (paper, section 4.2): each is an MJCF file and an entry in `mjcf/catalogue.toml`, or
in that of a package that an entry point of `factory.robots` names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.extensions import extension_folders
from factory.support.resources import mjcf_folder
from factory.support.toml_files import read_toml
from factory.theory.problem.robot_bodies import RobotBody
from factory.theory.problem.robot_reader import read_body

HINT = "see the shipped mjcf/catalogue.toml"

LIFT = "lift"
"""The type of a robot that can lower what it brings, or set its hand to different heights."""


@dataclass(frozen=True, slots=True)
class RobotType:
    """T: its name, its MJCF file and the `body` that was read from it, the type it extends ("" for
    none) and its purpose."""

    name: str
    mjcf: Path
    body: RobotBody = field(repr=False)
    extends: str = ""
    summary: str = ""

    @property
    def travels(self) -> bool:
        """Whether it goes along a guidepath; else it stands at its station, and turns what it
        holds."""
        return self.body.travels

    @property
    def turns(self) -> bool:
        """Whether it turns what it holds about the vertical."""
        return "turn" in self.body.motions

    @property
    def lowers(self) -> bool:
        """Whether it lowers what it delivers."""
        return any(axis.motion.lowers for axis in self.body.axes)


@dataclass(frozen=True)
class Catalogue:
    """Robot types by name.

    Attributes:
        types: each type with what was read of its MJCF.
    """

    types: Mapping[str, RobotType]

    def __post_init__(self) -> None:
        object.__setattr__(self, "types", MappingProxyType(dict(self.types)))

    def __getitem__(self, name: str) -> RobotType:
        return self.types[name]

    def fits(self, name: str, wanted: str) -> bool:
        """Whether a robot of type `name` can take the role of a `wanted` one: it is that type or
        extends it, directly or not."""
        while name != wanted:
            kind = self.types.get(name)
            if kind is None or not kind.extends:
                return False
            name = kind.extends
        return True

    def meet(self, one: str, other: str) -> str | None:
        """The more special of two types where one fits the other's role, else None."""
        if self.fits(one, other):
            return one
        return other if self.fits(other, one) else None


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
