"""What failed in a run, what was done about it, and the robots that died."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Failing:
    """A failure that was detected in a run.

    Attributes:
        t: when it was detected [s].
        test: the test that failed.
        operation: label of the operation.
        robot: name of the robot; "" for none.
        response: what was done.
        scrapped: labels that were scrapped.
        until: when a dead robot is replaced [s]; None where it is not.
    """

    t: float
    test: str
    operation: str
    robot: str
    response: str
    scrapped: tuple[str, ...] = ()
    until: float | None = None

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
        }

    @property
    def is_death(self) -> bool:
        """Whether a robot is dead, not only stuck in its operation."""
        return self.test == "jammed" and self.robot != ""

    @property
    def what(self) -> str:
        """The failure, in words."""
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
        """The response, in words."""
        if self.is_death:
            if self.until is None or not isfinite(self.until):
                return "a spare comes" if self.response == "spare" else "there is no spare"
            return f"a spare comes in {self.until - self.t:.0f} s"
        if self.response in ("again", "stop"):
            return "done again" if self.response == "again" else "the run ends"
        if self.scrapped == (self.operation,) and self.test in ("rejected", "misplaced"):
            return "taken back"
        made = ", ".join(self.scrapped)
        return "made again" if self.test == "lost" or not made else f"{made} made again"

    def __str__(self) -> str:
        return f"{self.what}: {self.done}"


Stood = tuple[float, tuple[str, ...]]
"""A time [s], and the names of all robots that stand still from then on."""


@dataclass(frozen=True)
class Failures:
    """All failures of a run.

    Attributes:
        found: the failures that were detected.
        struck: number of faults of each kind.
        missed: number of faults that no sensor detected.
        false_alarms: number of failures without a fault.
        undone: number of transitions fired backwards.
        spares: number of spares used.
        contacts: number of contacts with fallen parts, which do not count as unintended.
        stood: robots that stood still, over time.
        binned: number of times that scrap fell into a bin.
        spilled: names of robots that dropped scrap elsewhere, where there is no space for a bin.
        unseen: the missed faults, in words.
    """

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
    unseen: tuple[str, ...] = ()

    @property
    def deaths(self) -> list[Death]:
        """The deaths among those that were detected."""
        return deaths(self.found)

    @property
    def scrapped(self) -> int:
        """How many parts and sub-assemblies were scrapped."""
        return sum(len(failing.scrapped) for failing in self.found)

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "struck": dict(self.struck),
            "found": len(self.found),
            "missed": self.missed,
            "unseen": list(self.unseen),
            "false_alarms": self.false_alarms,
            "transitions_undone": self.undone,
            "scrapped": self.scrapped,
            "spares_used": self.spares,
            "fault_contacts": self.contacts,
            "binned": self.binned,
            "spilled": list(self.spilled),
            "standing": [{"t": round(t, 6), "robots": list(robots)} for t, robots in self.stood],
            "failures": [failing.as_json() for failing in self.found],
        }


class Account(Protocol):
    """The failures of a run that recovers from them: those `found` so far, the robots that `stood`
    still, and the `report` of all; `given`: the requested faults, as JSON."""

    @property
    def given(self) -> Mapping[str, object]: ...

    @property
    def found(self) -> Sequence[Failing]: ...
    @property
    def stood(self) -> Sequence[Stood]: ...
    def report(self) -> Failures: ...


@dataclass(frozen=True, slots=True)
class Death:
    """Outage of a `robot` from its detection at `start` to `end` [s], when a spare replaces it; inf
    where none does."""

    robot: str
    start: float
    end: float

    @property
    def then(self) -> str:
        """The situation after its end, in words."""
        return f"a spare is in the place of {self.robot}"


def deaths(failings: Iterable[Failing]) -> list[Death]:
    """The deaths among the failures of a run."""
    return [
        Death(one.robot, one.t, inf if one.until is None else one.until)
        for one in failings
        if one.is_death
    ]
