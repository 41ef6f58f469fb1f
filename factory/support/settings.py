"""Settings by option, environment or `factory.toml`: speeds, timestep, clearance."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from factory.support.bounds import BOUNDS, check_values
from factory.support.errors import Diagnostic, InputError

DWELL = 86_400.0
"""Upper bound on the dwell of an operation [s]: a day."""

MOST_UNITS = MOST_BRANCHES = 60
"""Maximum number of parallel branches, and of units of a period."""

LEAST: Literal["least"] = "least"
"""The fewest robots that are found."""

AUTO: Literal["auto"] = "auto"
"""The timestep that the factory chooses."""

TICK = 0.01
"""Default period of the supervisor [s]. Other periods are not longer, except that of a longer
timestep, or if both timestep and substeps are given."""

LOOK = 0.1
"""Longest time between two of the checks that are not made in every tick [s]."""

MOST = 10
"""Maximum number of ticks that the engine takes at once."""

SWITCHES = ("stage",)
"""Settings that are 0 or 1, or False or True."""

EXAMPLES: Mapping[str, str] = MappingProxyType({"timestep": '0.002, or "auto"', "substeps": "5"})
"""Examples of settings whose default is not a number."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The numbers that a layout and a run depend on, beside the product.

    Attributes:
        RANGES: least and greatest value of each; beyond them a run overflows or never ends.
        WHOLE: those that are whole numbers.
        speed: of a robot [m/s].
        acceleration: of a robot [m/s²].
        eps: radius of a goal ball [m].
        timestep: of the engine [s], or AUTO.
        substeps: timesteps in one tick of the supervisor; None for as many as TICK has room for.
            With AUTO at least so many.
        clearance: least distance between machines that share no mode [m].
        overlap: the most by which parts may overlap and still be tested against each other, by
            shapes that are smaller where they collide [m].
        force: limit of the actuators, as a multiple of what the payload needs.
        settle: time to come to rest within eps [s], used for predictions only.
        outfeed: speed of the outfeed's tray, and of the sliders of feeders [m/s].
        stage: 1 where robots that wait with empty hands go ahead to where their next operation
            needs them, else 0.

    With AUTO a tick is TICK, whatever timestep is chosen for a layout
    (`factory.engine.mjcf.timestep`), so layouts and predictions do not depend on it.

    Raises InputError (BadValue) with every value out of its range.
    """

    BOUNDS: ClassVar[Mapping[str, tuple[float, float]]] = BOUNDS
    FILE: ClassVar[str] = "factory.toml"
    MOST_BRANCHES: ClassVar[int] = MOST_BRANCHES

    RANGES: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {
            "speed": (1e-3, 100.0),
            "acceleration": (1e-3, 1e4),
            "eps": (1e-6, 0.02),
            "timestep": (1e-5, 0.02),
            "substeps": (1, 100),
            "clearance": (1e-4, 10.0),
            "overlap": (0.0, 0.005),
            "force": (1e-3, 1e6),
            "settle": (0.0, 10.0),
            "outfeed": (1e-3, 10.0),
            "stage": (0, 1),
        }
    )
    WHOLE: ClassVar[tuple[str, ...]] = ("substeps", "stage")

    speed: float = 0.5
    acceleration: float = 2.0
    eps: float = 2e-4
    timestep: float | Literal["auto"] = AUTO
    substeps: int | None = None
    clearance: float = 0.02
    overlap: float = 0.0005
    force: float = 3.0
    settle: float = 0.0
    outfeed: float = 1.0
    stage: int = 0

    @staticmethod
    def check_values(values: Mapping[str, object]) -> None:
        """Check values of a run or a search by their names. Raises InputError (Usage) with every
        fault."""
        check_values(values)

    def __post_init__(self) -> None:
        for name in SWITCHES:
            if getattr(self, name) in (False, True):
                object.__setattr__(self, name, int(getattr(self, name)))
        values = {name: getattr(self, name) for name in self.RANGES}
        faults_of = [wrong_type(n, v) for n, v in values.items() if (n, v) != ("substeps", None)]
        if faults := [fault for fault in faults_of if fault]:
            raise InputError(faults)

    @staticmethod
    def is_auto(name: str, value: object) -> bool:
        """Whether a setting is AUTO, which lets the factory choose."""
        return name == "timestep" and value == AUTO

    @property
    def outfeed_acceleration(self) -> float:
        """Acceleration of the outfeed's tray: twice that of a robot [m/s²]."""
        return 2 * self.acceleration

    @property
    def feeder_limits(self) -> tuple[float, float]:
        """Speed [m/s] and acceleration [m/s²] of the feeders' sliders: the speed of the tray, four
        times the acceleration of a robot, with which a heavy part comes no further than to 0.1 mm
        from the pad of a hand."""
        return self.outfeed, 4 * self.acceleration

    @property
    def shutter_limits(self) -> tuple[float, float]:
        """Speed [m/s] and acceleration [m/s²] of the shutter, which carries nothing: twice the
        speed of the tray, four times the acceleration of a robot. It comes to within 0.2 mm of
        the belt, so it is not to overshoot."""
        return 2 * self.outfeed, 4 * self.acceleration

    @property
    def step(self) -> float:
        """The timestep [s]. Raises ValueError where it is still to be chosen."""
        return float(self.timestep)

    @property
    def steps(self) -> int:
        """Timesteps in a tick. Raises ValueError where the timestep is still to be chosen."""
        return self.substeps or min(max(1, int(TICK / self.step * (1 + 1e-9))), 100)

    @property
    def tick(self) -> float:
        """Period of the supervisor [s]."""
        return TICK if self.timestep == AUTO else self.step * self.steps

    @property
    def lag(self) -> float:
        """The time by which the engine's speeds lag its positions [s]: half a timestep; of the
        longest, where it is still to be chosen."""
        return (TICK if self.timestep == AUTO else self.step) / 2

    @property
    def stride(self) -> int:
        """Ticks between two of the checks that are not made in every tick; the engine takes at most
        these at once."""
        return min(max(1, int(LOOK / self.tick * (1 + 1e-9))), MOST)

    @property
    def samples(self) -> int:
        """Setpoints in a drive's buffer: one for each step of a stride, the last one, which holds
        from then on, and one to spare."""
        return self.stride * self.steps + 2

    def with_options(self, options: Mapping[str, float | str | None]) -> Settings:
        """These settings with every option that is not None.

        Raises InputError (BadValue) with every number that is not within its range.
        """
        values = {name: value for name, value in options.items() if value is not None}
        return replace(self, **values)  # type: ignore[arg-type]


def environment() -> dict[str, float | str]:
    """The settings in the environment: `FACTORY_SPEED` and so on; an empty variable sets nothing.
    Raises InputError (BadValue) with every one that is no number within its range."""
    values, faults = dict[str, float | str](), []
    for name in Settings.RANGES:
        variable = f"FACTORY_{name.upper()}"
        text = os.environ.get(variable, "").strip()
        if not text:
            continue
        value = (
            text
            if Settings.is_auto(name, text)
            else _number(text, int if name in Settings.WHOLE else float)
        )
        fault = wrong_type(name, value)
        if fault is not None:
            faults.append(replace(fault, message=f"in the environment {variable}: {fault.message}"))
        elif value is not None:
            values[name] = value
    if faults:
        raise InputError(faults)
    return values


def _number(text: str, kind: type[int] | type[float]) -> float | None:
    try:
        return kind(text)
    except ValueError:
        return None


def wrong_type(name: str, value: Any) -> Diagnostic | None:
    """The error of the value of a setting that is neither a number within its range nor AUTO where
    that is valid; None for a valid value."""
    if Settings.is_auto(name, value):
        return None
    kind = "whole number" if name in Settings.WHOLE else "number"
    right: bool = isinstance(value, Integral if name in Settings.WHOLE else Real)
    if isinstance(value, bool) or not right:
        return Diagnostic("BadValue", f"{name} must be a {kind}", None, _example(name))
    low, high = Settings.RANGES[name]
    if low <= value <= high:
        return None
    shown = f"{value:g}" if isinstance(value, float) else f"{value}"[:20]
    message = f"{name} = {shown} is not between {low:g} and {high:g}"
    return Diagnostic("BadValue", message, None, _example(name))


def _example(name: str) -> str:
    return (
        f"for example {name} = {EXAMPLES.get(name) or Settings.__dataclass_fields__[name].default}"
    )
