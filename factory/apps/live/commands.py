"""The commands to a running factory: JSON messages, checked before they act."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Speeds of a run, simulated seconds a second; 0: as fast as it goes."""

FACTORS = (0.1, 0.25, 0.5, 1.0)
"""Factors on a robot's speed."""

SHARES = (-1.0, -0.5, 0.5, 1.0)
"""Pushes, as shares of the greatest force of a robot's drive, which can hold no more."""


PUSH, LASTS = 0.3, 5.0
"""Durations of a push, and of a stand-still of a robot [s]."""

FAULTS: Mapping[str, tuple[str, ...]] = {"down": ("robot",), "dead": ("robot",)}
"""The commands to a factory that recovers from failures, with the keys of each: a robot stands
still for LASTS seconds, or dies. They are kinds of faults; others come from a file of faults."""

KEYS: Mapping[str, tuple[str, ...]] = {
    "pause": (),
    "play": (),
    "step": (),
    "restart": (),
    "speed": ("factor",),
    "push": ("robot", "share"),
    "slow": ("robot", "factor"),
    "block": ("part", "blocked"),
}
"""The commands by name, with the keys of each: stop at the end of a tick; go on; go on until the
next transition fires; restart from the initial marking, with nothing slowed or blocked; run at one
of SPEEDS; push a robot (index) for PUSH seconds with one of SHARES; run a robot at one of FACTORS
of its speed; block the feeder of a part, or open it."""


@dataclass(frozen=True, slots=True)
class Command:
    """What to `do`, and the values of its keys; keys of other commands keep their defaults."""

    do: str
    robot: int = 0
    factor: float = 1.0
    share: float = 0.0
    part: str = ""
    blocked: bool = False


def command_of(
    message: str | bytes, robots: int, parts: Collection[str], fails: bool = False
) -> Command:
    """The command in a message such as `{"do": "slow", "robot": 3, "factor": 0.5}`, to a factory
    with so many robots and these parts; `fails`: whether the factory recovers from failures. Raises
    ValueError with what is wrong and what is valid."""
    try:
        table = json.loads(message)
    except (ValueError, RecursionError):
        raise ValueError("a command is a JSON object") from None
    if not isinstance(table, dict):
        raise ValueError("a command is a JSON object")
    name, keys = table.get("do"), {**KEYS, **(FAULTS if fails else {})}
    if not isinstance(name, str) or name not in keys:
        raise ValueError(f"'do' is {name!r}: there are {', '.join(keys)}")
    factors = SPEEDS if name == "speed" else FACTORS
    valid: Mapping[str, tuple[Callable[[Any], bool], str]] = {
        "robot": (lambda v: type(v) is int and 0 <= v < robots, f"a number from 0 to {robots - 1}"),
        "part": (lambda v: isinstance(v, str) and v in parts, "the label of a part"),
        "blocked": (lambda v: isinstance(v, bool), "true or false"),
        "share": (lambda v: _is_number_in(v, SHARES), f"one of {SHARES}"),
        "factor": (lambda v: _is_number_in(v, factors), f"one of {factors}"),
    }
    for key in keys[name]:
        is_valid, words = valid[key]
        if not is_valid(table.get(key)):
            raise ValueError(f"'{key}' of '{name}' is {table.get(key)!r}: {words} is needed")
    return Command(name, **{key: table[key] for key in keys[name]})


def _is_number_in(value: object, values: Collection[float]) -> bool:
    return type(value) in (int, float) and value in values
