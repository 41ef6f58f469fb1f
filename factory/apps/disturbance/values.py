"""The disturbances as values, each with its units."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite


def _require(holds: bool, what: str, value: object, valid: str) -> None:
    if not holds:
        raise ValueError(f"{what} is {value}: {valid}")


def _positive(what: str, value: float) -> None:
    _require(isfinite(value) and value > 0, what, value, "a positive number is needed")


def _natural(what: str, value: float) -> None:
    _require(isfinite(value) and value >= 0, what, value, "a number from 0 on is needed")


@dataclass(frozen=True, slots=True)
class Push:
    """A force (x, y, z) [N], in the world's directions, on the centre of mass of a body, from time
    `at` [s] on for `duration` [s], to whole timesteps. `body`: as the model names it, `r3/carriage`
    or `part/part1#2`. A robot gives way along its guidepath only."""

    body: str
    force: tuple[float, float, float]
    at: float
    duration: float

    def __post_init__(self) -> None:
        finite = len(self.force) == 3 and all(map(isfinite, self.force))
        _require(finite, "force", self.force, "three numbers are needed")
        _natural("at", self.at)
        _positive("duration", self.duration)


@dataclass(frozen=True, slots=True)
class Mass:
    """The parts weigh `factor` times what the drives were sized for and feed forward; all of them,
    or those of the labels in `parts`. Moments of inertia go with the mass."""

    factor: float
    parts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _positive("factor", self.factor)


@dataclass(frozen=True, slots=True)
class Gain:
    """Actuators give `factor` times the force that they are asked for: position and speed gain,
    feed-forward and limit. All robots, or those named; the outfeed's tray stays as it is."""

    factor: float
    robots: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _positive("factor", self.factor)


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry friction of `newtons` [N] in every axis of all robots, or of those named, instead of what
    their type has empty (0.2 N). What the weight of a load adds is the same as ever."""

    newtons: float
    robots: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _natural("newtons", self.newtons)


@dataclass(frozen=True, slots=True)
class Noise:
    """White noise in what is measured of every axis, drawn anew in every timestep by `seed`: normal
    with standard deviation `metres` [m] in position and `speed` [m/s] in speed. Both the drive's
    own loop and the supervisor get the same measurement."""

    metres: float
    speed: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        _natural("metres", self.metres)
        _natural("speed", self.speed)


@dataclass(frozen=True, slots=True)
class Delay:
    """What is measured of every axis is `seconds` [s] old, to whole timesteps, for the drive's own
    loop and for the supervisor."""

    seconds: float

    def __post_init__(self) -> None:
        _natural("seconds", self.seconds)


@dataclass(frozen=True, slots=True)
class Slowed:
    """A robot that moves at `factor` times its speed limit: its drive knows and commands no more,
    the others and the prediction do not."""

    robot: str
    factor: float

    def __post_init__(self) -> None:
        _positive("factor", self.factor)


@dataclass(frozen=True, slots=True)
class Dragged:
    """A robot that is held back: viscous friction so great that its drive at full force reaches
    `factor` times its speed limit, while it is still asked for all of it."""

    robot: str
    factor: float

    def __post_init__(self) -> None:
        _positive("factor", self.factor)


Disturbance = Push | Mass | Gain | Friction | Noise | Delay | Slowed | Dragged
