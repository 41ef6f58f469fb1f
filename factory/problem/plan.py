"""A plan: how a product is made, as a value. Every variant of a factory follows from one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

THIRD = -1
"""The form of a join whose inputs a third robot takes; others are the number of the input that
stays on its robot."""

MOST_RELAYS, MOST_ROBOTS = 99, 10**6
"""Upper bounds on numbers in a table that comes from elsewhere."""

Turns = Sequence[Sequence[int]]
"""For each unit of a period, and each robot of the factory that has one robot for each tour, the
robot (index) that does its tour."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Which variant of its factory makes a product. `Plan()` is the factory of the paper, with one
    robot for each tour and the forms as they are written.

    `forms`: the form of each join (by label) that has another than it is written in. `relays`: how
    many robots hand over what each label names, on its way to the operation that takes it. `turns`:
    who does which tour (`Turns`), empty for one robot for each tour. `lifts`: the robots (index)
    whose lift is set for each of their tours, None where the hands have not been chosen yet.
    """

    forms: Mapping[str, int] = field(default_factory=dict)
    relays: Mapping[str, int] = field(default_factory=dict)
    turns: tuple[tuple[int, ...], ...] = ()
    lifts: frozenset[int] | None = None

    def then(self, turns: Turns) -> Plan:
        """The plan in which other robots do what the robots of this one do: in turn t robot
        `turns[t][r]` (index) what robot r does. Its lifts are to be found again."""
        first: Turns = self.turns or [range(len(turns[0]))]
        every = tuple(tuple(turn[robot] for robot in unit) for turn in turns for unit in first)
        alone = len(every) == 1 and every[0] == tuple(range(len(every[0])))
        return replace(self, turns=() if alone else every, lifts=None)

    def as_json(self) -> dict[str, object]:
        """The plan as a table of JSON."""
        return {
            "forms": dict(sorted(self.forms.items())),
            "relays": dict(sorted(self.relays.items())),
            "turns": [list(turn) for turn in self.turns],
            "lifts": None if self.lifts is None else sorted(self.lifts),
        }

    @classmethod
    def of_json(cls, table: Mapping[str, Any]) -> Plan:
        """The plan in such a table. Raises ValueError, KeyError, TypeError, AttributeError where it
        is none."""
        turns, lifts = table["turns"], table["lifts"]
        return cls(
            {str(label): _whole(form, THIRD, 1) for label, form in table["forms"].items()},
            {
                str(label): _whole(number, 1, MOST_RELAYS)
                for label, number in table["relays"].items()
            },
            tuple(tuple(_whole(robot, 0, MOST_ROBOTS) for robot in turn) for turn in turns),
            None if lifts is None else frozenset(_whole(robot, 0, MOST_ROBOTS) for robot in lifts),
        )


def _whole(value: object, least: int, most: int) -> int:
    """A whole number from `least` to `most`. Raises ValueError for anything else."""
    if type(value) is int and least <= value <= most:
        return value
    raise ValueError(f"a whole number from {least} to {most} is needed, not {value!r:.40}")


AS_WRITTEN = Plan()
"""The plan of the paper's factory."""
