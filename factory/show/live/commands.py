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
"""How long a push lasts, and how long a robot stands, a feeder is empty and no sensor tells
anything [s]."""

FAULTS: Mapping[str, tuple[str, ...]] = {
    "drop": ("robot",),
    "down": ("robot",),
    "dead": ("robot",),
    "bad_part": ("part",),
    "misplaced": ("part",),
    "no_part": ("part",),
    "bad_joint": ("joint",),
    "blackout": (),
}
"""The commands to a factory that goes on after failures, with the keys that each has. They are the
kinds of faults: each strikes as soon as it can, so what comes next is dropped, is no good, lies
askew or slips."""

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
"""The commands by name, with the keys that each has: stop at the end of a tick; go on; go on until
the next transition fires; begin anew, from the initial marking, with nothing slowed or blocked; run
at one of SPEEDS; push a robot (index) for PUSH seconds with one of SHARES; run a robot at one of
FACTORS of its speed; block the feeder of a part, or free it."""


@dataclass(frozen=True, slots=True)
class Command:
    """What to `do`, and the values of its keys; those of other commands' keys mean nothing."""

    do: str
    robot: int = 0
    factor: float = 1.0
    share: float = 0.0
    part: str = ""
    joint: str = ""
    blocked: bool = False


def command_of(
    message: str | bytes,
    robots: int,
    parts: Collection[str],
    joints: Collection[str] | None = None,
) -> Command:
    """The command in a message such as `{"do": "slow", "robot": 3, "factor": 0.5}`, to a factory of
    so many robots and these parts; `joints`: the labels of what is joined, None for a factory that
    does not go on after failures. Raises ValueError with what is wrong and what is valid."""
    try:
        told = json.loads(message)
    except (ValueError, RecursionError):
        raise ValueError("a command is a JSON object") from None
    if not isinstance(told, dict):
        raise ValueError("a command is a JSON object")
    name, keys = told.get("do"), {**KEYS, **({} if joints is None else FAULTS)}
    if not isinstance(name, str) or name not in keys:
        raise ValueError(f"'do' is {name!r}: there are {', '.join(keys)}")
    factors = SPEEDS if name == "speed" else FACTORS
    valid: Mapping[str, tuple[Callable[[Any], bool], str]] = {
        "robot": (lambda v: type(v) is int and 0 <= v < robots, f"a number from 0 to {robots - 1}"),
        "part": (lambda v: isinstance(v, str) and v in parts, "the label of a part"),
        "joint": (
            lambda v: isinstance(v, str) and v in (joints or ()),
            "the label of what is joined",
        ),
        "blocked": (lambda v: isinstance(v, bool), "true or false"),
        "share": (lambda v: _is_one(v, SHARES), f"one of {SHARES}"),
        "factor": (lambda v: _is_one(v, factors), f"one of {factors}"),
    }
    for key in keys[name]:
        holds, words = valid[key]
        if not holds(told.get(key)):
            raise ValueError(f"'{key}' of '{name}' is {told.get(key)!r}: {words} is needed")
    return Command(name, **{key: told[key] for key in keys[name]})


def _is_one(value: object, of: Collection[float]) -> bool:
    return type(value) in (int, float) and value in of
