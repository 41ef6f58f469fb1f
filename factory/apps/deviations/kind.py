"""What a kind of deviation is: when it begins, what it acts on, and its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Literal

Occasion = Literal["payload", "robot", "joint", "feeder", "operation", "part", "time", "always"]

OCCASIONS: Mapping[Occasion, str] = MappingProxyType(
    {
        "payload": "an operation starts in which the robot carries something",
        "robot": "an operation of the robot starts",
        "joint": "an operation starts that joins inputs",
        "feeder": "an operation starts that takes a part from a feeder",
        "operation": "an operation starts",
        "part": "a feeder presents a part",
        "time": "at a time",
        "always": "from the start of the run to its end",
    }
)
"""When a deviation can begin, in words."""

TIMES = ("unit", "at", "rate")
"""The keys that say when a deviation strikes."""


@dataclass(frozen=True, slots=True)
class DeviationParameter:
    """A parameter of a kind of deviation: a number, a vector or a truth value.

    Attributes:
        name: its key in a file.
        unit: its unit, "" for none.
        what: its meaning, in words.
        default: its value where none is given; None where one is needed.
        valid: its range, in words; a vector is in any.
    """

    name: str
    unit: str
    what: str
    default: float | bool | None = None
    valid: Literal["a number from 0 on", "a positive number", "three numbers", "true or false"] = (
        "a number from 0 on"
    )

    def admits(self, value: object) -> bool:
        """Whether a value of the right type is in the range."""
        if isinstance(value, tuple):
            return len(value) == 3 and all(map(isfinite, value))
        if not (isinstance(value, int | float) and isfinite(value)):
            return False
        return value > 0 if self.valid == "a positive number" else value >= 0


@dataclass(frozen=True, slots=True)
class DeviationKind:
    """A kind of deviation.

    Attributes:
        name: its name in files, reports and code.
        what: its definition, in words.
        occasion: when it can begin, a key of `OCCASIONS`.
        concerns: keys of which one must name what it acts on, unless it has a `rate`.
        narrowed: further keys that may restrict what it acts on.
        parameters: the parameters that it takes.
        test: the test of a template by which it should be detected, "" for none.
        response: what the factory does, in words.
    """

    name: str
    what: str
    occasion: Occasion
    concerns: tuple[str, ...] = ()
    narrowed: tuple[str, ...] = ()
    parameters: tuple[DeviationParameter, ...] = ()
    test: str = ""
    response: str = "it is not told"

    @property
    def is_disturbance(self) -> bool:
        """Whether it changes the physics or its measurement, so that it needs bodies, and any
        failure may follow from it; the others are single faults."""
        return self.occasion in ("time", "always")

    @property
    def times(self) -> tuple[str, ...]:
        """The keys that may say when it strikes: one must, but for a disturbance."""
        if self.is_disturbance:
            return ("at",) if self.occasion == "time" else ()
        return TIMES

    @property
    def names(self) -> tuple[str, ...]:
        """The keys that may name what it acts on."""
        return self.concerns + self.narrowed

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys that it takes, but for its kind."""
        return (*self.names, *self.times, *(parameter.name for parameter in self.parameters))

    @property
    def labels(self) -> str:
        """What its `label` may be, in the words of a diagnosis."""
        if self.occasion == "joint":
            return "joined labels"
        return "parts" if self.occasion in ("feeder", "part", "always") else "labels"

    def parameter(self, name: str) -> DeviationParameter:
        """One of its parameters, by name."""
        return next(parameter for parameter in self.parameters if parameter.name == name)
