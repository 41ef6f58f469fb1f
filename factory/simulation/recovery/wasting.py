"""What robots hold that is scrap. On its way to its bin a robot holds nothing by the books."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from factory.problem.pag import NOPART


@dataclass(slots=True)
class Wasting:
    """`held`: the label that each robot (index) holds that is scrap; `barred`: robots with the
    labels that they cannot carry back to B."""

    barred: frozenset[tuple[int, str]]
    held: dict[int, str] = field(default_factory=dict)

    def waste(self, robots: Iterable[int], held: Mapping[int, str]) -> None:
        """What these robots hold is scrap, and nothing else is; by the books they have `held` it,
        until now or until earlier."""
        known = self.held | {robot: label for robot, label in held.items() if label != NOPART}
        self.held = {robot: known.get(robot, NOPART) for robot in robots}

    def falls_here(self, robot: int) -> bool:
        """Whether a robot cannot carry its scrap to B."""
        return (robot, self.held[robot]) in self.barred
