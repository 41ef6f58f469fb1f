"""A plan: how a product is made, as a value. Every variant of a factory follows from one."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import ClassVar

MOST_RELAYS, MOST_ROBOTS = 99, 10**6
"""Upper bounds on numbers in a table that comes from elsewhere."""

Turns = Sequence[Sequence[int]]
"""For each unit of a period, and each robot of the factory that has one robot for each tour, the
robot (index) that does its tour; `Plan.NOBODY` where its product is not made in it."""

NAME = re.compile(r"r[1-9][0-9]*")
"""A name of a robot."""


def in_turn(label: str, turn: int) -> str:
    """What a label is called for a unit of a period, counted from 0: `x` for the first, `x@2` for
    the next."""
    return f"{label}@{turn + 1}" if turn else label


def out_of_turn(label: str, turn: int) -> str:
    """What a label of a unit of a period is called for the first unit: as the PAG has it."""
    return label.removesuffix(in_turn("", turn))


@dataclass(frozen=True, slots=True)
class Plan:
    """The variant of a factory. `Plan()` is the factory of the paper: one robot for each tour, and
    the forms as they are written.

    Attributes:
        THIRD: the form of a join whose inputs a third robot takes; others are the number of the
            input that stays on its robot.
        NOBODY: the robot that does a tour which is not made.
        forms: the form of each join, by label, that differs from the written one.
        relays: number of robots that hand over what a label names, on its way to the operation that
            takes it.
        turns: the robot (index) that does each tour, for each turn; empty for one robot for each
            tour.
        lifts: robots (index) whose lift is set for each of their tours; None where the hands have
            not been chosen.
        names: names of the robots, as `r9`; empty for r1, r2 and so on. A robot that stays in the
            next revision of a product keeps its name.
        tees: pairs of robots (index) that share the last stretch of their guidepaths, though they
            bring different labels.
    """

    THIRD: ClassVar[int] = -1
    NOBODY: ClassVar[int] = -1

    forms: Mapping[str, int] = field(default_factory=dict)
    relays: Mapping[str, int] = field(default_factory=dict)
    turns: tuple[tuple[int, ...], ...] = ()
    lifts: frozenset[int] | None = None
    names: tuple[str, ...] = ()
    tees: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        for name, values, least, most in (
            ("forms", self.forms.values(), self.THIRD, 1),
            ("relays", self.relays.values(), 1, MOST_RELAYS),
            ("turns", chain.from_iterable(self.turns), self.NOBODY, MOST_ROBOTS),
            ("lifts", self.lifts or (), 0, MOST_ROBOTS),
            ("tees", chain.from_iterable(self.tees), 0, MOST_ROBOTS),
        ):
            if wrong := [value for value in values if not least <= value <= most]:
                words = f"whole numbers from {least} to {most}, not {wrong[0]}"
                raise ValueError(f"{name} must be {words}")
        valid = all(NAME.fullmatch(name) for name in self.names)
        if not valid or len({*self.names}) < len(self.names):
            raise ValueError("names must be different names of robots, as 'r9'")

    @property
    def is_as_written(self) -> bool:
        """Whether it is the plan of the paper's factory, but for names of robots."""
        return replace(self, names=()) == AS_WRITTEN

    def then(self, turns: Turns) -> Plan:
        """The plan in which other robots do what the robots of this one do: in turn t robot
        `turns[t][r]` (index) what robot r does. Its lifts are to be found again."""
        first: Turns = self.turns or [range(len(turns[0]))]
        every = tuple(
            tuple(turn[robot] if robot != self.NOBODY else self.NOBODY for robot in unit)
            for turn in turns
            for unit in first
        )
        alone = len(every) == 1 and every[0] == tuple(range(len(every[0])))
        return replace(self, turns=() if alone else every, lifts=None, names=(), tees=())


AS_WRITTEN = Plan()
"""The plan of the paper's factory."""
