"""Robots that die in a run, as its record tells: until when each is dead, and which are gone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

from factory.nets.undone import Entry, exchanges
from factory.record.failures import Failing


@dataclass(frozen=True, slots=True)
class Death:
    """A `robot` that is known to be dead from `start` to `end` [s], inf where nothing takes its
    place; then its `deputy` does its tours, or, where that is "", a spare is in its place."""

    robot: str
    start: float
    end: float
    deputy: str = ""

    @property
    def then(self) -> str:
        """What is so from its end on, in words."""
        if self.deputy:
            return f"{self.robot} is gone: {self.deputy} does its tours"
        return f"a spare is in the place of {self.robot}"


def gone(entries: Iterable[Entry], time: float = inf) -> dict[str, str]:
    """The robots that have been lifted out for good by a time [s], each with the deputy that does
    its tours from then on, by name: those that the entries of a record up to then exchange."""
    return {one.robots[0]: one.robots[1] for one in exchanges(entries) if one.t <= time}


def deaths(found: Iterable[Failing], entries: Iterable[Entry]) -> list[Death]:
    """All deaths among the failures that a record tells of. One with a deputy ends when an entry
    exchanges the two: a deputy that dies before that never takes over."""
    exchanged = {one.robots: one.t for one in exchanges(entries)}
    return [
        Death(one.robot, one.t, _end(one, exchanged), one.deputy) for one in found if one.is_death
    ]


def _end(one: Failing, exchanged: dict[tuple[str, ...], float]) -> float:
    if one.deputy:
        return exchanged.get((one.robot, one.deputy), inf)
    return inf if one.until is None else one.until
