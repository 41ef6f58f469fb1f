"""Robot types (paper, section 4.2), as they are read from their files (`factory.floor.robots`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from factory.theory.problem.robot_bodies import CARRIAGE, WAY, RobotAxis, RobotBody

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

    def with_chain(
        self,
        name: str,
        mjcf: Path,
        extends: str,
        masses: tuple[float, float],
        joints: Sequence[str],
    ) -> Catalogue:
        """The catalogue with a type whose one axis moves several joints along a curve, each with
        an actuator of its name; `masses`: of all of it, and of what moves [kg]."""
        axis = RobotAxis(WAY, masses[1], moves=tuple((joint, joint) for joint in joints))
        made = RobotType(name, mjcf, RobotBody(CARRIAGE, masses[0], (axis,)), extends)
        return Catalogue({**self.types, name: made})

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
