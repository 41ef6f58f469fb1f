"""What failed in a run, what was done about it, and the robots that died or were exchanged."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Protocol

from factory.nets.gears import GearNet
from factory.nets.undone import Entry, exchanges
from factory.plant.factory import Factory


@dataclass(frozen=True, slots=True)
class Exchange:
    """A `deputy` that took over the tours of a robot that is `dead`, by their names, at time t [s].

    `fired`: n', the counts from which the run went on in another `net`, which was proved before;
    `crew`: its factory, in which all robots keep their numbers; `cycle_time`: what is predicted for
    it [s].
    """

    t: float
    dead: str
    deputy: str
    fired: tuple[int, ...] = field(repr=False)
    net: GearNet = field(repr=False)
    crew: Factory = field(repr=False)
    cycle_time: float

    def __str__(self) -> str:
        return (
            f"{self.deputy} takes over the tours of {self.dead} (deputy);"
            f" predicted from then on: {self.cycle_time:.3f} s"
        )

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it, the counts by the names of transitions."""
        names = (transition.name for transition in self.net.threaded.transitions)
        return {
            "t": round(self.t, 6),
            "dead": self.dead,
            "deputy": self.deputy,
            "predicted_cycle_time_s": self.cycle_time,
            "fired": dict(zip(names, self.fired, strict=True)),
        }


@dataclass(frozen=True, slots=True)
class Failing:
    """A failure detected at `t` [s]: the failed `test`, the `operation` (its label), the `robot`,
    "" for none; the `response`, and the labels that were `scrapped`. `until`: when a dead robot is
    replaced [s], None where it is not; `deputy`: the robot that takes over its tours, "" for
    none."""

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
"""A time [s], and the names of all robots that stand still from then on."""


@dataclass(frozen=True)
class Failures:
    """All failures of a run. `struck`: number of faults of each kind; `missed`: of those that no
    sensor detected; `false_alarms`: of failures without a fault; `undone`: of transitions fired
    backwards; `spares`: of spares used; `contacts`: of contacts with fallen parts, which do not
    count as unintended; `stood`: the robots that stood still over time; `binned`: number of times
    that scrap fell into a bin; `spilled`: names of robots that dropped scrap elsewhere, where there
    is no space for a bin; `unseen`: the missed faults, in words."""

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
    still or were exchanged, and the `report` of all; `given`: the requested faults, as JSON."""

    @property
    def given(self) -> Mapping[str, object]: ...

    @property
    def found(self) -> Sequence[Failing]: ...
    @property
    def stood(self) -> Sequence[Stood]: ...
    @property
    def exchanges(self) -> Sequence[Exchange]: ...
    def report(self) -> Failures: ...


@dataclass(frozen=True, slots=True)
class Death:
    """Outage of a `robot` from its detection at `start` to `end` [s], inf where nothing replaces
    it; from then on its `deputy` does its tours or, where that is "", a spare replaces it."""

    robot: str
    start: float
    end: float
    deputy: str = ""

    @property
    def then(self) -> str:
        """The situation after its end, in words."""
        if self.deputy:
            return f"{self.robot} is gone: {self.deputy} does its tours"
        return f"a spare is in the place of {self.robot}"


def gone(entries: Iterable[Entry], time: float = inf) -> dict[str, str]:
    """The robots removed for good up to a time [s], each with the deputy that does its tours, by
    name: those exchanged by the entries of a record."""
    return {undone.robots[0]: undone.robots[1] for undone in exchanges(entries) if undone.t <= time}


def deaths(failings: Iterable[Failing], entries: Iterable[Entry]) -> list[Death]:
    """The deaths among the failures of a record. One with a deputy ends when an entry exchanges
    the two: a deputy that dies before that never takes over."""
    exchanged = {undone.robots: undone.t for undone in exchanges(entries)}
    return [
        Death(failing.robot, failing.t, _end(failing, exchanged), failing.deputy)
        for failing in failings
        if failing.is_death
    ]


def _end(death: Failing, exchanged: dict[tuple[str, ...], float]) -> float:
    if death.deputy:
        return exchanged.get((death.robot, death.deputy), inf)
    return inf if death.until is None else death.until
