"""Parameters of operations: what values each takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

from factory.theory.problem.pag import Value


@dataclass(frozen=True, slots=True)
class ParameterKind:
    """What values a parameter takes.

    Attributes:
        GEOMETRY: the kinds of the parameters of a part, by name.
        length: 0 for a text, 1 for a number, n for a vector of n numbers.
        example: a value as it is written, shown with an error.
        low, high: the least and the greatest that a number may be.
        positive: whether each number is above 0.
        zero: whether a vector may be all zero.
        long: whether it is a length, in the unit of the text.
    """

    GEOMETRY: ClassVar[Mapping[str, ParameterKind]]

    length: int
    example: str
    low: float = -math.inf
    high: float = math.inf
    positive: bool = False
    zero: bool = True
    long: bool = False

    @classmethod
    def of(cls, default: Value, high: float = math.inf) -> ParameterKind:
        """The kind of a template's parameter, from its default: one >= 0 has no negative values."""
        if isinstance(default, str):
            return cls(0, f'"{default}"')
        if isinstance(default, tuple):
            return cls(len(default), "( " + ", ".join(map(repr, default)) + " )")
        return cls(1, repr(default), low=0.0 if default >= 0 else -math.inf, high=high)

    def allows(self, number: float) -> bool:
        """Whether one number lies within the bounds."""
        return self.low <= number <= self.high and (number > 0 or not self.positive)

    def fits(self, numbers: tuple[float, ...]) -> bool:
        """Whether these finite numbers are a value of this kind."""
        if not 0 < len(numbers) == self.length or not (self.zero or any(numbers)):
            return False
        return all(math.isfinite(value) and self.allows(value) for value in numbers)

    @property
    def wanted(self) -> str:
        """The kind in words."""
        if self.length == 0:
            return "a text in double quotes"
        sort = "positive " if self.positive else ""
        among = f" from {self.low:g} to {self.high:g}" if math.isfinite(self.high) else ""
        if self.low == 0 and not among:
            among = " >= 0"
        return (
            f"a {sort}number{among}" if self.length == 1 else f"{self.length} {sort}numbers{among}"
        )


GEOMETRY: Mapping[str, ParameterKind] = MappingProxyType(
    {
        "mesh": ParameterKind(0, '"bricks/3001.obj"'),
        "scale": ParameterKind(1, "0.001", positive=True, long=True),
        "pos": ParameterKind(3, "( 0, 0, 0.1 )", long=True),
        "quat": ParameterKind(4, "( 1, 0, 0, 0 )", zero=False),
        "density": ParameterKind(1, "1050", positive=True),
        "mass": ParameterKind(1, "0.1", positive=True),
        "rgba": ParameterKind(4, "( 0.8, 0.1, 0.1, 1 )", low=0.0, high=1.0),
        "box": ParameterKind(3, "( 0.1, 0.1, 0.05 )", positive=True, long=True),
        "cylinder": ParameterKind(2, "( 0.02, 0.1 )", positive=True, long=True),
        "sphere": ParameterKind(1, "0.05", positive=True, long=True),
        "fed": ParameterKind(1, "0.61", low=-3.15, high=3.15),
    }
)
"""The kinds of the parameters of a part, by name."""

ParameterKind.GEOMETRY = GEOMETRY

WRITTEN: Mapping[str, ParameterKind] = MappingProxyType(
    {**GEOMETRY, "turn": ParameterKind(3, "( 0, 0, 90 )")}
)
"""The same, and those that a text may have in their place: `turn`, which is read as a `quat`."""
