"""The commands to a running factory: JSON messages, checked before they act."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Speeds of a run, simulated seconds a second; 0: as fast as it goes."""

FACTORS = (0.1, 0.25, 0.5, 1.0)
"""Factors on a robot's speed."""

SHARES = (-1.0, -0.5, 0.5, 1.0)
"""Pushes, as shares of the greatest force of a robot's drive, which can hold no more."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Stop at the end of a tick."""


@dataclass(frozen=True, slots=True)
class Play:
    """Go on."""


@dataclass(frozen=True, slots=True)
class PlayToFiring:
    """Go on until the next transition fires."""


@dataclass(frozen=True, slots=True)
class Restart:
    """Begin anew, from the initial marking, with nothing slowed or blocked."""


@dataclass(frozen=True, slots=True)
class Speed:
    """One of SPEEDS."""

    factor: float


@dataclass(frozen=True, slots=True)
class PushRobot:
    """Push a robot (index) for PUSH seconds with one of SHARES."""

    robot: int
    share: float


@dataclass(frozen=True, slots=True)
class Slow:
    """Run a robot (index) at one of FACTORS of its speed."""

    robot: int
    factor: float


@dataclass(frozen=True, slots=True)
class Block:
    """Block the feeder of a part, or free it."""

    part: str
    blocked: bool


Command = Pause | Play | PlayToFiring | Restart | Speed | PushRobot | Slow | Block

PUSH = 0.3
"""Duration of a push [s]."""


def command_of(message: str | bytes, robots: int, parts: Collection[str]) -> Command:
    """The command in a message such as `{"do": "slow", "robot": 3, "factor": 0.5}`, to a factory of
    so many robots and these parts. Raises ValueError with what is wrong and what is valid."""
    try:
        told = json.loads(message)
    except (ValueError, RecursionError):
        raise ValueError("a command is a JSON object") from None
    if not isinstance(told, dict):
        raise ValueError("a command is a JSON object")
    name = told.get("do")
    if not isinstance(name, str) or name not in KINDS:
        raise ValueError(f"'do' is {name!r}: there are {', '.join(KINDS)}")
    kind = KINDS[name]
    keys = [field.name for field in fields(kind)]
    valid: Mapping[str, tuple[Callable[[Any], bool], str]] = {
        "robot": (lambda v: type(v) is int and 0 <= v < robots, f"a number from 0 to {robots - 1}"),
        "part": (lambda v: isinstance(v, str) and v in parts, "the label of a part"),
        "blocked": (lambda v: isinstance(v, bool), "true or false"),
        "share": (lambda v: _is_one(v, SHARES), f"one of {SHARES}"),
        "factor": (
            lambda v: _is_one(v, SPEEDS if kind is Speed else FACTORS),
            f"one of {SPEEDS if kind is Speed else FACTORS}",
        ),
    }
    for key in keys:
        holds, words = valid[key]
        if not holds(told.get(key)):
            raise ValueError(f"'{key}' of '{name}' is {told.get(key)!r}: {words} is needed")
    return kind(*(told[key] for key in keys))


def _is_one(value: object, of: Collection[float]) -> bool:
    return type(value) in (int, float) and value in of


KINDS: Mapping[str, type[Command]] = {
    "pause": Pause,
    "play": Play,
    "step": PlayToFiring,
    "restart": Restart,
    "speed": Speed,
    "push": PushRobot,
    "slow": Slow,
    "block": Block,
}
"""The commands by name."""
