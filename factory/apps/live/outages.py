"""Outages of a factory that recovers from failures: robots that stand or are dead, zones closed by
fallen parts, feeders and sensors that are off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import ceil, isfinite

import numpy as np

from factory.apps.recovery import Recovery
from factory.film.marks import Zone, Zones
from factory.support.errors import listing

LONG = 1e8
"""A feeder that is empty for so long [s] is blocked by hand, which is shown elsewhere."""

Message = tuple[str, str]
"""A mark of the page, `dead`, `closed`, `standing`, `dark` or `empty`, and its text."""


@dataclass(frozen=True, slots=True)
class Outages:
    """Robots, by name: those detected as `dead`, each with its remaining outage [s], inf where
    nothing replaces it; `closed`, which must not move while a fallen part lies nearby, for `lying`
    [s] more; `standing` for another reason. `zones`: around fallen parts, closed to robots. `dark`:
    remaining time without sensors [s]; `empty`: feeders without parts, by label, each with the
    remaining time [s]."""

    dead: Mapping[str, float] = field(default_factory=dict)
    closed: tuple[str, ...] = ()
    lying: float = 0.0
    standing: tuple[str, ...] = ()
    zones: tuple[Zone, ...] = ()
    dark: float = 0.0
    empty: Mapping[str, float] = field(default_factory=dict)

    def messages(self) -> Iterator[Message]:
        """One for each outage."""
        for robot, left in self.dead.items():
            then = f"a spare replaces it {_in(left)}" if isfinite(left) else "nothing replaces it"
            yield "dead", f"{robot} is dead: {then}"
        if self.closed:
            stand = f"{listing(self.closed)} stand{_s(self.closed)} still"
            yield "closed", f"{stand}: a fallen part nearby is cleared away {_in(self.lying)}"
        elif self.zones:
            yield "closed", f"a fallen part is cleared away {_in(self.lying)}"
        if self.standing:
            yield "standing", f"{listing(self.standing)} stand{_s(self.standing)} still"
        if self.dark:
            yield "dark", f"all sensors are off: they return {_in(self.dark)}"
        for label, left in self.empty.items():
            yield "empty", f"the feeder of {label} is empty: it is refilled {_in(left)}"

    def as_json(self) -> dict[str, object]:
        """The key `outages` of a frame for the page."""
        return {
            "dead": [*self.dead],
            "closed": self.closed,
            "standing": self.standing,
            "zones": [[round(v, 4) for v in zone] for zone in self.zones],
            "told": [*self.messages()],
        }


class Watch:
    """Reads the outages from a recovery in a world with bodies."""

    def __init__(self, recovery: Recovery) -> None:
        self._recovery, self._world = recovery, recovery.simulation.physical
        self._zones = Zones(self._world.m)

    def now(self) -> Outages:
        """The present outages."""
        recovery, world = self._recovery, self._world
        dead, closed, lying = recovery.responding.dead, recovery.plant.closed, recovery.plant.lying
        condition, time = recovery.condition, world.time
        names = [robot.name for robot in recovery.simulation.layout.factory.robots]
        kept = tuple(names[robot] for robot in sorted(closed - dead.keys()))
        held = world.m.eq_obj2id[np.flatnonzero(world.d.eq_active)]
        stood = recovery.stood[-1][1] if recovery.stood else ()
        by_name = {names[robot]: until - time for robot, until in sorted(dead.items())}
        return Outages(
            by_name,
            kept,
            max(lying, default=time) - time,
            tuple(name for name in stood if name not in by_name and name not in kept),
            tuple(self._zones.at(world.d, held)) if lying else (),
            max(condition.dark - time, 0.0),
            {label: t - time for label, t in condition.empty.items() if t - time < LONG},
        )


def _in(seconds: float) -> str:
    """A remaining time in words."""
    return f"in {ceil(seconds)} s" if seconds > 0 else "soon"


def _s(robots: tuple[str, ...]) -> str:
    """The ending of a verb, for one robot or several."""
    return "s" if len(robots) == 1 else ""
