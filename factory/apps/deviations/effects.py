"""What each kind of deviation does to a plant: one function for each kind of the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from types import MappingProxyType

from factory.api import Operation
from factory.apps.deviations.condition import PlantCondition
from factory.apps.deviations.deviation import Deviation

EARLY, LATE = 0.1, 0.9
"""A robot drops what it carries after a share of its operation's time between these."""


@dataclass(frozen=True, slots=True)
class Strike:
    """A deviation that strikes.

    Attributes:
        deviation: what strikes.
        now: the time [s].
        robot: the robot that it strikes (index), -1 for none.
        label: the label that it strikes, "" for none.
        operation: the operation that starts, or that takes the part presented; None for a strike at
            any other moment.
    """

    deviation: Deviation
    now: float
    robot: int = -1
    label: str = ""
    operation: Operation | None = None

    @property
    def end(self) -> float:
        """When a deviation with a duration is over [s]."""
        return self.now + self.deviation.number("seconds")


Effect = Callable[[PlantCondition, Strike], bool]
"""Applies a strike. Returns False where it cannot strike now, and waits for its occasion."""


def _drop(plant: PlantCondition, strike: Strike) -> bool:
    if strike.operation is None:
        return strike.robot >= 0 and plant.plant.lose(strike.robot)
    share = plant.draw.uniform(EARLY, LATE)
    plant.fall(strike.robot, strike.now + share * plant.delay(strike.operation))
    return True


def _spoil(plant: PlantCondition, strike: Strike) -> bool:
    if strike.operation is not None:
        plant.plant.spoil(strike.label, strike.deviation)
    return strike.operation is not None


def _slip(plant: PlantCondition, strike: Strike) -> bool:
    if strike.operation is not None:
        plant.plant.slip(strike.operation, strike.deviation.way)
    return strike.operation is not None


def _push(plant: PlantCondition, strike: Strike) -> bool:
    deviation = strike.deviation
    plant.push(deviation.body, deviation.force or (0.0, 0.0, 0.0), strike.now, strike.end)
    return True


def _always(act: Callable[[PlantCondition, Strike], None]) -> Effect:
    """An effect that needs no occasion."""

    def effect(plant: PlantCondition, strike: Strike) -> bool:
        act(plant, strike)
        return True

    return effect


def _factor(strike: Strike) -> float:
    return strike.deviation.number("factor")


EFFECTS: Mapping[str, Effect] = MappingProxyType(
    {
        "drop": _drop,
        "bad_part": _spoil,
        "misplaced": _spoil,
        "bad_joint": _slip,
        "no_part": _always(lambda plant, s: plant.starve(s.label, s.end)),
        "blackout": _always(lambda plant, s: plant.darken(s.end)),
        "down": _always(lambda plant, s: plant.stand(s.robot, s.end)),
        "dead": _always(lambda plant, s: plant.stand(s.robot, inf)),
        "push": _push,
        "slow": _always(lambda plant, s: plant.slow(s.now, s.robot, _factor(s))),
        "drag": _always(lambda plant, s: plant.drag(s.robot, _factor(s))),
        "mass": _always(lambda p, s: p.interference.weigh(p.parts(s.label), _factor(s))),
        "gain": _always(lambda p, s: p.interference.weaken(p.axes(s.robot), _factor(s))),
        "friction": _always(
            lambda p, s: p.interference.rub(p.axes(s.robot), s.deviation.number("newtons"))
        ),
        "noise": _always(
            lambda p, s: p.mismeasure_noisily(
                s.deviation.number("metres"), s.deviation.number("speed")
            )
        ),
        "delay": _always(lambda plant, s: plant.mismeasure_late(s.deviation.number("seconds"))),
    }
)
"""The effect of each kind of deviation, by its name."""
