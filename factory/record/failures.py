"""What went wrong in a run, and what was done about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Protocol

from factory.record.exchange import Exchange


@dataclass(frozen=True, slots=True)
class Failing:
    """A failure that was found at `t` [s]: the `test` that failed, in which `operation` (its
    label), of which `robot`, "" for none; the `response`, and what was `scrapped`, by label.
    `until`: when a dead robot is replaced [s], None where none is; `deputy`: the robot that then
    takes over its tours, "" for none."""

    t: float
    test: str
    operation: str
    robot: str
    response: str
    scrapped: tuple[str, ...] = ()
    until: float | None = None
    deputy: str = ""

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "t": round(self.t, 6),
            "test": self.test,
            "operation": self.operation,
            "robot": self.robot or None,
            "response": self.response,
            "scrapped": list(self.scrapped),
            **({"until": round(self.until, 6)} if self.until is not None else {}),
            **({"deputy": self.deputy} if self.deputy else {}),
        }

    @property
    def is_death(self) -> bool:
        """Whether a robot is dead, not only stuck in its operation."""
        return self.test == "jammed" and self.robot != ""

    @property
    def what(self) -> str:
        """What failed, in words."""
        things = ", ".join(self.scrapped) or self.operation
        in_feeder = self.scrapped == (self.operation,)
        match self.test:
            case "lost":
                return f"{self.robot or self.operation} lost {things}"
            case "jammed":
                return f"{self.robot} is dead" if self.is_death else f"{self.operation} is jammed"
            case "misplaced":
                return f"{self.operation} lies askew in its feeder"
            case "rejected":
                return f"{self.operation} is {'no good' if in_feeder else 'rejected'}"
            case "residual":
                return f"{self.operation} does not fit"
        return f"{self.operation} fails the test {self.test}"

    @property
    def done(self) -> str:
        """What is done about it, in words."""
        if self.is_death:
            if self.until is None or not isfinite(self.until):
                return "a spare comes" if self.response == "spare" else "there is no spare"
            after = f"in {self.until - self.t:.0f} s"
            if self.deputy:
                return f"{self.deputy} takes over the tours of {self.robot} (deputy) {after}"
            return f"a spare comes {after}"
        if self.response in ("again", "stop"):
            return "done again" if self.response == "again" else "the run ends"
        if self.scrapped == (self.operation,) and self.test in ("rejected", "misplaced"):
            return "taken back"
        made = ", ".join(self.scrapped)
        return "made again" if self.test == "lost" or not made else f"{made} made again"

    def __str__(self) -> str:
        return f"{self.what}: {self.done}"


Stood = tuple[float, tuple[str, ...]]
"""From when on [s] which robots stand, by name, and no others."""


@dataclass(frozen=True)
class Failures:
    """All of a run. `struck`: faults of the world, by kind; `missed`: those that no sensor told of;
    `false_alarms`: failures that nothing caused; `undone`: how many transitions were fired
    backwards; `spares`: how many were used; `contacts`: of what fell, which are no unintended
    ones; `stood`: from when on [s] which robots stood, by name; `binned`: how often scrap has
    fallen into a bin; `spilled`: the robots, by name, that have let some fall elsewhere, since
    there is no room for a bin."""

    found: tuple[Failing, ...] = ()
    struck: Mapping[str, int] = field(default_factory=dict)
    missed: int = 0
    false_alarms: int = 0
    undone: int = 0
    spares: int = 0
    contacts: int = 0
    stood: tuple[Stood, ...] = ()
    binned: int = 0
    spilled: tuple[str, ...] = ()

    @property
    def scrapped(self) -> int:
        """How many parts and sub-assemblies were scrapped."""
        return sum(len(one.scrapped) for one in self.found)

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "struck": dict(self.struck),
            "found": len(self.found),
            "missed": self.missed,
            "false_alarms": self.false_alarms,
            "transitions_undone": self.undone,
            "scrapped": self.scrapped,
            "spares_used": self.spares,
            "fault_contacts": self.contacts,
            "binned": self.binned,
            "spilled": list(self.spilled),
            "standing": [{"t": round(t, 6), "robots": list(robots)} for t, robots in self.stood],
            "failures": [one.as_json() for one in self.found],
        }


class Account(Protocol):
    """What a run that goes on after failures tells of them: those that it has `found`, which robots
    `stood` and were exchanged so far, and all of it; `given`: the faults that it was asked for, as
    values of JSON."""

    @property
    def given(self) -> Mapping[str, object]: ...

    @property
    def found(self) -> Sequence[Failing]: ...
    @property
    def stood(self) -> Sequence[Stood]: ...
    @property
    def exchanges(self) -> Sequence[Exchange]: ...
    def report(self) -> Failures: ...
