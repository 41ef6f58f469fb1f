"""Robot types (paper, section 4.2): each is an MJCF file and an entry in `mjcf/catalogue.toml`, or
in that of a package that an entry point of `factory.robots` names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.extensions import extension_folders
from factory.support.resources import mjcf_folder
from factory.support.user_defaults import read_toml

HINT = "see the shipped mjcf/catalogue.toml"

LIFT = "lift"
"""The type of a robot that can lower what it brings, or set its hand to different heights."""


@dataclass(frozen=True, slots=True)
class RobotType:
    """T: its name, MJCF file, the type it extends ("" for none) and its purpose. `moves`: what
    its axes do: go `along` a guidepath, `up`, or `turn` about the vertical. `fixed`: it stands at
    its station, and turns what it holds; `lowers`: it lowers what it delivers."""

    name: str
    mjcf: Path
    extends: str = ""
    summary: str = ""
    moves: tuple[str, ...] = ("along",)
    fixed: bool = False
    lowers: bool = False


@dataclass(frozen=True)
class Catalogue:
    """Robot types by name."""

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


def load_catalogue() -> Catalogue:
    """The shipped catalogue, with those of entry points.

    Raises InputError where a file is not readable TOML, or a type extends one that is not there,
    or itself, or is there already.
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
    try:
        return {
            name: RobotType(
                name,
                path.parent / str(entry["mjcf"]),
                str(entry.get("extends", "")),
                str(entry.get("summary", "")),
                tuple(entry.get("moves", ("along",))),
                bool(entry.get("fixed", False)),
                bool(entry.get("lowers", False)),
            )
            for name, entry in table.items()
        }
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(_trouble(path, f"the robot catalogue is unusable: {error}")) from error


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


def _trouble(path: Path, message: str, hint: str = HINT) -> Diagnostic:
    return Diagnostic("BadTemplate", message, Position(str(path), 1, 1), hint)
