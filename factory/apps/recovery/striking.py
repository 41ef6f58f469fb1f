"""When faults occur: drawn for each operation that starts and each part that is presented."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from factory.api import NOPART, Operation
from factory.apps.recovery.faults import Campaign, WorldFault
from factory.apps.recovery.plant import Plant

EARLY, LATE = 0.1, 0.9
"""A robot drops what it carries after a share of its operation's time between these."""


Hit = tuple[str, str, int]
"""The kind of a fault, and the label and the unit that it struck."""


class Striking:
    """Applies the faults of a campaign to a plant whose operations take `delays` [s]. `struck`:
    number of faults of each kind; `dark` [s]: end of the sensor blackout; `empty`: by label, when
    its feeder gives parts again; `standing`: by robot (index), when it moves again."""

    def __init__(
        self, campaign: Campaign, plant: Plant, names: tuple[str, ...], delays: tuple[float, ...]
    ) -> None:
        self._faults, self._plant = [*campaign.faults], plant
        self._names, self._delays = names, delays
        self._draw = np.random.default_rng(campaign.seed)
        self._spent: set[int] = set()
        self._due: list[tuple[float, int]] = []
        self.struck: dict[str, int] = {}
        self.hits: list[Hit] = []
        self.dark = -np.inf
        self.empty: dict[str, float] = {}
        self.standing: dict[int, float] = {}

    def strike(self, fault: WorldFault, now: float) -> None:
        """Apply a fault that names a robot or label, or a blackout, now or as soon as possible: a
        robot that holds nothing drops its next payload; a feeder presents the next part so; the
        next joint slips."""
        robot = self._names.index(fault.robot) if fault.robot else -1
        match fault.kind:
            case "down" | "dead":
                self.stand(robot, now + fault.seconds if fault.kind == "down" else np.inf)
            case "no_part":
                self.starve(fault.label, now + fault.seconds)
            case "blackout":
                self.darken(now + fault.seconds)
            case "drop" if robot >= 0 and self._plant.lose(robot):
                pass
            case _:
                self._faults.append(fault)
                return
        self.count(fault.kind)

    def started(self, operation: Operation, unit: int, now: float) -> None:
        """Apply the faults that are due as an operation starts."""
        for robot, label in zip(operation.robots, operation.before, strict=True):
            name = self._names[robot]
            if label != NOPART and self._strikes("drop", unit, now, label, name):
                share = self._draw.uniform(EARLY, LATE)
                heappush(self._due, (now + share * self._delays[operation.index], robot))
            for kind in ("down", "dead"):
                if fault := self._strikes(kind, unit, now, label, name):
                    self.stand(robot, now + fault.seconds if kind == "down" else np.inf)
        label, count = operation.label, len(operation.inputs)
        if count > 1 and (fault := self._strikes("bad_joint", unit, now, label)):
            self._plant.slip(operation, fault.way)
        if not count and (fault := self._strikes("no_part", unit, now, label)):
            self.starve(label, now + fault.seconds)
        if fault := self._strikes("blackout", unit, now, label):
            self.darken(now + fault.seconds)

    def stand(self, robot: int, until: float) -> None:
        """Stop a robot (index) until a time [s]."""
        self.standing[robot] = max(self.standing.get(robot, 0.0), until)

    def starve(self, label: str, until: float) -> None:
        """Stop a feeder until a time [s]."""
        self.empty[label] = max(self.empty.get(label, 0.0), until)

    def darken(self, until: float) -> None:
        """Blind all sensors until a time [s]."""
        self.dark = max(self.dark, until)

    def shown(self, label: str, unit: int, now: float) -> WorldFault | None:
        """The fault of the part that a feeder is about to present for a unit, if any."""
        return self._strikes("bad_part", unit, now, label) or self._strikes(
            "misplaced", unit, now, label
        )

    def count(self, kind: str, times: int = 1) -> None:
        """Add to the number of faults of a kind; negative if one vanished undetected."""
        self.struck[kind] = self.struck.get(kind, 0) + times

    def tick(self, now: float) -> None:
        """Drop payloads that are due, and end faults that are over."""
        while self._due and self._due[0][0] <= now:
            if not self._plant.lose(heappop(self._due)[1]):
                self.count("drop", -1)
        for over in [label for label, until in self.empty.items() if until <= now]:
            del self.empty[over]
            self._plant.supplied()
        for robot in [robot for robot, until in self.standing.items() if until <= now]:
            del self.standing[robot]
        if -np.inf < self.dark <= now:
            self.dark = -np.inf
            self._plant.supplied()

    def _strikes(
        self, kind: str, unit: int, now: float, label: str, robot: str = ""
    ) -> WorldFault | None:
        for number, fault in enumerate(self._faults):
            if fault.kind != kind or number in self._spent:
                continue
            written = label.partition("@")[0]
            if fault.label not in ("", label, written) or fault.robot not in (None, "", robot):
                continue
            if fault.rate is not None:
                hit = bool(self._draw.random() < fault.rate)
            else:
                hit = fault.unit == unit + 1 if fault.unit is not None else now >= (fault.at or 0)
                if hit:
                    self._spent.add(number)
            if hit:
                self.count(kind)
                self.hits.append((kind, label, unit))
                return fault
        return None
