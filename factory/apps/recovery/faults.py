"""Faults of the world, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, radians
from types import MappingProxyType
from typing import Any

from factory.api import value_of
from factory.engine.record.verdict import MOST

KINDS: Mapping[str, str] = MappingProxyType(
    {
        "drop": "a robot drops its payload",
        "misplaced": "a feeder shows a part that lies askew or upside down",
        "bad_part": "a feeder shows a defective part",
        "no_part": "a feeder is empty for some time",
        "bad_joint": "an input has slipped in its hand when it is joined",
        "blackout": "no sensor gives a reading for some time",
        "down": "a robot stands still for some time",
        "dead": "a robot never moves again",
    }
)
"""Every kind of fault, in words."""

ASKEW, SLIPPED = 5e-3, 1e-3
"""How far a part lies askew that is not turned, and how far one has slipped, unless asked otherwise
[m]: more than the tests of the shipped templates allow."""

OF_ROBOT, OF_LABEL = {"down", "dead"}, {"misplaced", "bad_part", "no_part", "bad_joint"}
"""Kinds that name a robot, and that may name a label: of a part, or of what is joined."""


@dataclass(frozen=True, slots=True)
class WorldFault:
    """A fault of some kind: in the operations of a `unit` (from 1 on), once from a time `at` [s]
    on, or in a share of all operations (`rate`); exactly one of these.

    `robot`, `label`: which one it concerns; any where there is a rate and none is named. `seconds`:
    how long it lasts. `metres`, `degrees`: how far a part is off or has slipped, and how far it is
    turned; `way` has the usual where no `metres` are given. `hidden`: a bad part that only an
    inspection finds. Raises ValueError.
    """

    kind: str
    label: str = ""
    robot: str = ""
    unit: int | None = None
    at: float | None = None
    rate: float | None = None
    seconds: float = 5.0
    metres: float | None = None
    degrees: float = 0.0
    hidden: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"there is no fault '{self.kind}'")
        if sum(value is not None for value in (self.unit, self.at, self.rate)) != 1:
            raise ValueError("one of 'unit', 'at' and 'rate' is needed")
        if self.kind in OF_ROBOT and not self.robot:
            raise ValueError(f"'{self.kind}' needs a 'robot'")
        if self.robot and self.kind not in {*OF_ROBOT, "drop"}:
            raise ValueError(f"'{self.kind}' concerns no 'robot'")
        named = self.label or self.robot or self.kind == "blackout"
        if self.rate is None and not named:
            raise ValueError(f"'{self.kind}' needs a 'label'")
        if self.unit is not None and self.unit < 1:
            raise ValueError(f"'unit' is {self.unit}: they are counted from 1")
        if self.rate is not None and not 0 <= self.rate <= 1:
            raise ValueError(f"'rate' is {self.rate}: a share from 0 to 1 is needed")
        for name in ("at", "seconds", "metres", "degrees"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value >= 0):
                raise ValueError(f"'{name}' is {value}: a number from 0 on is needed")

    @property
    def way(self) -> float:
        """Displacement of a part that is misplaced or has slipped [m]."""
        if self.metres is not None:
            return self.metres
        return ASKEW if self.kind == "misplaced" and not self.degrees else SLIPPED


@dataclass(frozen=True, slots=True)
class Sensors:
    """Quality of sensors: the standard deviation of a measured distance (`noise` [m]), and the time
    for which a grip sensor must report a loss before it is believed (`delay` [s])."""

    noise: float = 5e-5
    delay: float = 0.03


SHARE = 0.5
"""A feeder's camera finds what is off by this share of what a hand-off may be (`verdict.LIMITS`):
the rest is left to its noise and to the robot that takes the part."""

SHIFTED = SHARE * MOST["handoff_gap_max_mm"] / 1e3
"""Largest displacement that no camera finds [m]; a template may ask for less."""

TURNED = SHARE * radians(MOST["handoff_angle_max_deg"])
"""Largest angle that no camera finds [rad]."""

CLEAR, SWAP = 10.0, 30.0
"""How long what has fallen lies, and how long it takes to replace a robot, unless asked otherwise
[s]."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """The faults of a run, drawn by `seed`. `clear` [s]: time until a thing that has fallen is
    removed; `swap` [s]: time to replace a dead robot by one of `spares`."""

    faults: tuple[WorldFault, ...] = ()
    seed: int = 0
    clear: float = CLEAR
    sensors: Sensors = field(default_factory=Sensors)
    spares: int = 0
    swap: float = SWAP


def campaign_of(values: Mapping[str, Any]) -> Campaign:
    """The campaign in a table. Raises ValueError if the table is not a campaign."""
    return value_of(Campaign, values, "faults")
