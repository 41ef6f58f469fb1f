"""Settings by option, environment or `factory.toml`: speeds, timestep, clearance."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace

from factory.support.errors import Diagnostic, InputError

RANGES = {
    "speed": (1e-3, 100.0),
    "acceleration": (1e-3, 1e4),
    "eps": (1e-6, 0.02),
    "timestep": (1e-5, 0.02),
    "substeps": (1, 100),
    "clearance": (1e-4, 10.0),
    "force": (1e-3, 1e6),
    "settle": (0.0, 10.0),
    "outfeed": (1e-3, 10.0),
    "stage": (0, 1),
}
"""Least and greatest value of each setting; beyond them a run overflows or never ends."""

LOOK = 0.1
"""Longest time between two checks of what is not checked in every tick [s]."""

MOST = 10
"""The most ticks that the engine takes at once."""

WHOLE = ("substeps", "stage")
"""Settings that are whole numbers."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Speed [m/s] and acceleration [m/s²] of a robot; `eps`, radius of a goal ball [m]; `timestep`
    of the engine [s] and `substeps` of it in one tick of the supervisor; least `clearance` [m];
    `force`: the actuators' limit as a multiple of what the payload needs; `settle`: time to come to
    rest within eps [s], used only to predict; `outfeed` speed [m/s]; `stage`: 1 where robots that
    wait empty-handed go ahead to where their next operation needs them.
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
    stage: int = 0

    @property
    def outfeed_acceleration(self) -> float:
        """Acceleration of the outfeed's tray: twice that of a robot [m/s²]."""
        return 2 * self.acceleration

    @property
    def tick(self) -> float:
        """Period of the supervisor [s]."""
        return self.timestep * self.substeps

    @property
    def stride(self) -> int:
        """Ticks between two checks of what is not checked in every tick; the engine takes no more
        at once."""
        return min(max(1, int(LOOK / self.tick * (1 + 1e-9))), MOST)

    @property
    def samples(self) -> int:
        """Setpoints in a drive's buffer: one for each step of a stride, the last one, which holds
        from then on, and one to spare."""
        return self.stride * self.substeps + 2

    def with_options(self, options: Mapping[str, float | int | None]) -> Settings:
        """These settings with every option that is not None.

        Raises InputError (BadValue) with every number that is not within its range.
        """
        given = {name: value for name, value in options.items() if value is not None}
        faults = [_out_of_range(name, value) for name, value in given.items()]
        if any(faults):
            raise InputError(fault for fault in faults if fault)
        return replace(self, **given)  # type: ignore[arg-type]


def environment() -> dict[str, float]:
    """The settings in the environment: `FACTORY_SPEED` and so on; an empty variable sets nothing.
    Raises InputError (BadValue) with every one that is no number within its range."""
    found, faults = {}, []
    for name in RANGES:
        variable = f"FACTORY_{name.upper()}"
        text = os.environ.get(variable, "").strip()
        if not text:
            continue
        value = _number(text, int if name in WHOLE else float)
        fault = _out_of_range(name, value) if value is not None else wrong_type(name, value)
        if fault is not None:
            faults.append(replace(fault, message=f"in the environment {variable}: {fault.message}"))
        elif value is not None:
            found[name] = value
    if faults:
        raise InputError(faults)
    return found


def _number(text: str, kind: type[int] | type[float]) -> float | None:
    try:
        return kind(text)
    except ValueError:
        return None


def wrong_type(name: str, value: object) -> Diagnostic | None:
    """What is wrong with the value of a setting, if it is no number within its range."""
    kind = "whole number" if name in WHOLE else "number"
    if isinstance(value, bool) or not isinstance(value, int if name in WHOLE else int | float):
        return Diagnostic("BadValue", f"{name} must be a {kind}", None, _example(name))
    return _out_of_range(name, value)


def _out_of_range(name: str, value: float) -> Diagnostic | None:
    low, high = RANGES[name]
    if low <= value <= high:
        return None
    shown = f"{value:g}" if isinstance(value, float) else f"{value}"[:20]
    message = f"{name} = {shown} is not between {low:g} and {high:g}"
    return Diagnostic("BadValue", message, None, _example(name))


def _example(name: str) -> str:
    return f"for example {name} = {getattr(Settings(), name)}"
