"""Scrap in robots' hands. In the marking, a robot that carries scrap to its bin holds nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from factory.problem.pag import NOPART


@dataclass(slots=True)
class Wasting:
    """`held`: the label of the scrap that each robot (index) holds; `barred`: pairs (robot, label)
    that the robot cannot carry back to B."""

    barred: frozenset[tuple[int, str]]
    held: dict[int, str] = field(default_factory=dict)

    def waste(self, robots: Iterable[int], held: Mapping[int, str]) -> None:
        """Declare the payloads of exactly these robots scrap; their labels are those of `held`, or
        known from before."""
        known = self.held | {robot: label for robot, label in held.items() if label != NOPART}
        self.held = {robot: known.get(robot, NOPART) for robot in robots}

    def falls_here(self, robot: int) -> bool:
        """Whether a robot cannot carry its scrap to B."""
        return (robot, self.held[robot]) in self.barred
