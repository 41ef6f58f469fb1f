"""Scrap in robots' hands. In the marking, a robot that carries scrap to its bin holds nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from factory.api import NOPART, Operation


@dataclass(slots=True)
class OnEnd:
    """Consecutive repetitions of each operation (`tried`, by index) and consecutive scrappings of
    each label (`scrapped`)."""

    tried: Counter[int] = field(default_factory=Counter)
    scrapped: Counter[str] = field(default_factory=Counter)

    def response(self, operation: Operation, test: str) -> str:
        """The response of the template to a failure of an operation repeated so many times."""
        failure, tried = operation.template.failure(test), self.tried[operation.index]
        responses = failure.responses if failure else ()
        left = (r for r in responses if r.kind != "again" or tried < r.times)
        return next((response.kind for response in left), "scrap")


@dataclass(slots=True)
class ScrapRouting:
    """Decides where robots put their scrap.

    Attributes:
        barred: pairs (robot, label) that the robot cannot carry back to B.
        held: by robot (index), the label of the scrap that it holds.
    """

    barred: frozenset[tuple[int, str]]
    held: dict[int, str] = field(default_factory=dict)

    def waste(self, robots: Iterable[int], held: Mapping[int, str]) -> None:
        """Declare the payloads of exactly these robots scrap; their labels are those of `held`, or
        known from before."""
        labels = self.held | {robot: label for robot, label in held.items() if label != NOPART}
        self.held = {robot: labels.get(robot, NOPART) for robot in robots}

    def falls_here(self, robot: int) -> bool:
        """Whether a robot cannot carry its scrap to B."""
        return (robot, self.held[robot]) in self.barred
