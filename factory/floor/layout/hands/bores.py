"""The bores that parts need for hands with pins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.hands.holding import held
from factory.floor.layout.layout import Layout


@dataclass(frozen=True, slots=True)
class Bore:
    """A bore `at` a place of the surface of a sub-assembly or part (`label`), in the frame of the
    finished product, as wide (`diameter`) as it is deep [m]; the `robot` that holds there, and the
    `kind` of its hand, which tells from where the bore is made."""

    label: str
    robot: str
    kind: str
    at: Point3
    diameter: float

    def as_json(self) -> dict[str, Any]:
        """The bore in `--json` documents."""
        document = {"label": self.label, "robot": self.robot, "from": self.kind}
        return {**document, "at_m": list(self.at), "diameter_mm": round(self.diameter * 1e3, 4)}


def bores(layout: Layout) -> Iterator[Bore]:
    """The bores for a layout's robots, in their order: half as wide as the collars of their
    hands."""
    factory, chains = layout.factory, layout.chains
    for robot, hand in zip(factory.robots, layout.hands, strict=False):
        if chains is not None and robot.index in chains.robots:
            for label in factory.deliveries(robot.index):
                if (tool := chains.hand(label)).tip == "pin":
                    whole = label.partition("/")[0]
                    yield Bore(whole, robot.name, tool.kind, tool.places[0], tool.radius)
        if hand is not None and hand.kind.holds and hand.tip == "pin":
            label = held(layout.factory, robot.index)
            for at in hand.places:
                yield Bore(label, robot.name, hand.kind, at, hand.radius)
