"""The deviations of a run together, and whether a factory has what they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from factory.api import Diagnostic, Factory, InputError
from factory.apps.deviations.deviation import Deviation
from factory.support.errors import did_you_mean
from factory.support.tables import value_of


@dataclass(frozen=True, slots=True)
class Sensors:
    """Quality of the sensors that detect faults.

    Attributes:
        noise: standard deviation of a measured distance [m].
        delay: time for which a grip sensor must report a loss before it is believed [s].
    """

    noise: float = 5e-5
    delay: float = 0.03


CLEAR, SWAP = 10.0, 30.0
"""How long what has fallen lies, and how long it takes to replace a robot, unless asked otherwise
[s]."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """The deviations of a run.

    Attributes:
        faults: the deviations, faults and disturbances.
        seed: seed of all random draws.
        clear: time until a thing that has fallen is removed [s].
        sensors: the quality of the sensors.
        spares: number of spare robots.
        swap: time to replace a dead robot by a spare [s].
    """

    faults: tuple[Deviation, ...] = ()
    seed: int = 0
    clear: float = CLEAR
    sensors: Sensors = field(default_factory=Sensors)
    spares: int = 0
    swap: float = SWAP


def campaign_of(values: Mapping[str, Any]) -> Campaign:
    """The campaign in a table. Raises ValueError if the table is not a campaign."""
    return value_of(Campaign, values, "faults")


def check_deviations(campaign: Campaign, factory: Factory, has_bodies: bool) -> None:
    """Raises InputError (BadFault) with everything that is wrong for a factory, in a world with or
    without bodies."""
    faults = campaign.faults
    wrong = [one for fault in faults for _, one in impossible(fault, factory, has_bodies)]
    if wrong:
        raise InputError(wrong)


def impossible(
    fault: Deviation, factory: Factory | None, has_bodies: bool
) -> Iterator[tuple[str, Diagnostic]]:
    """What is wrong (BadFault) with a deviation for a factory, if one is given, in a world with or
    without bodies, with the key that is wrong: it names a robot or label that the factory lacks, or
    a label that its kind cannot concern, or it needs bodies."""
    if fault.of_kind.is_disturbance and not has_bodies:
        message = f"'{fault.kind}' acts on bodies, and the ideal world has none"
        yield "kind", Diagnostic("BadFault", message, None, "take the world mujoco")
    if factory is None:
        return
    robots = [robot.name for robot in factory.robots]
    operations = {
        "parts": factory.leaves,
        "joined labels": [o for o in factory.making if len(o.inputs) > 1],
        "labels": factory.making,
    }
    what = fault.of_kind.labels
    labels = [*dict.fromkeys(name for o in operations[what] for name in (o.label, o.written))]
    for key, names, kinds in (("robot", robots, "robots"), ("label", labels, what)):
        name = getattr(fault, key)
        if name and name not in names:
            message = f"'{fault.kind}' names '{name}', which is none of the {kinds}"
            hint = did_you_mean(name, names, kinds)
            yield key, Diagnostic("BadFault", message, None, hint)
