"""When deviations occur: at the start, at their time, or drawn for each operation that starts and
each part that is presented."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from factory.api import NOPART, Operation, Simulation
from factory.apps.deviations.campaign import Campaign, check_deviations
from factory.apps.deviations.condition import Breakable, PlantCondition
from factory.apps.deviations.deviation import KINDS, Deviation
from factory.apps.deviations.effects import EFFECTS, Strike
from factory.apps.deviations.kind import OCCASIONS, Occasion
from factory.support.arrays import Array

Hit = tuple[str, str, int]
"""The kind of a fault, and the label and the unit that it struck."""


class FaultInjector:
    """Applies the deviations of a campaign to a simulation that has not begun.

    Without a `plant` the factory does not continue after failures: it can only be disturbed, and
    its feeders emptied. With one, whoever recovers calls `started`, `presented` and `tick`. Raises
    InputError (BadFault) for a deviation that is impossible here.

    Attributes:
        condition: what the deviations have made of the plant.
        struck: number of deviations of each kind that have occurred.
        hits: the faults that have struck an operation or a part.
    """

    def __init__(
        self,
        simulation: Simulation,
        campaign: Campaign = Campaign(),  # noqa: B008
        plant: Breakable | None = None,
    ) -> None:
        self._factory, hooks = simulation.layout.factory, simulation.world.hooks
        self._has_bodies = simulation.model is not None
        check_deviations(campaign, self._factory, self._has_bodies)
        self.condition = PlantCondition(simulation, plant, campaign.seed)
        self._hooks, self._recovers = hooks, plant is not None
        self._indices = {robot.name: robot.index for robot in self._factory.robots}
        self._faults, self._spent = list[Deviation](), set[int]()
        self.struck: dict[str, int] = {}
        self.hits: list[Hit] = []
        for fault in campaign.faults:
            if fault.of_kind.is_disturbance:
                self._apply(fault, fault.at or 0.0)
            else:
                self.condition.require_recovery()
                self._faults.append(fault)
        hooks.gates.append(self._admits)
        if self._recovers:
            hooks.sensors.append(self._sensed)

    def strike(self, fault: Deviation, now: float) -> None:
        """Let a deviation that names what it concerns strike now, or as soon as possible: a robot
        that holds nothing drops its next payload; a feeder presents the next part so; the next
        joint slips. Whatever time or unit it names does not matter. Raises InputError (BadFault)
        where it is impossible here."""
        check_deviations(Campaign((fault,)), self._factory, self._has_bodies)
        if not (fault.of_kind.is_disturbance or fault.of_kind.occasion == "feeder"):
            self.condition.require_recovery()
        if not self._apply(fault, now):
            self._faults.append(fault)

    def _apply(self, fault: Deviation, now: float) -> bool:
        """Let a deviation strike outside its occasion, if it can."""
        robot = self._indices[fault.robot] if fault.robot else -1
        has_struck = EFFECTS[fault.kind](self.condition, Strike(fault, now, robot, fault.label))
        if has_struck:
            self.count(fault.kind)
        if self.condition.is_waiting and not self._recovers and self.tick not in self._hooks.ticks:
            self._hooks.ticks.append(self.tick)
        return has_struck

    def started(self, operation: Operation, unit: int, now: float) -> None:
        """Apply the faults that strike an operation of a unit as it starts."""
        for occasion, robot, label in _occasions(operation):
            for kind in _BY_OCCASION[occasion]:
                if fault := self._drawn(kind, unit, now, label, robot):
                    strike = Strike(fault, now, robot, label, operation)
                    EFFECTS[kind](self.condition, strike)

    def presented(self, leaf: Operation, unit: int, now: float) -> None:
        """Apply the fault, at most one, of the part that a feeder is about to present for a unit to
        an operation."""
        for kind in _BY_OCCASION["part"]:
            if fault := self._drawn(kind, unit, now, leaf.label):
                EFFECTS[kind](self.condition, Strike(fault, now, -1, leaf.label, leaf))
                return

    def count(self, kind: str, times: int = 1) -> None:
        """Add to the number of deviations of a kind; negative if one vanished undetected."""
        self.struck[kind] = self.struck.get(kind, 0) + times

    def tick(self) -> None:
        """At the end of a tick, drop payloads that are due, and end what is over."""
        if missed := self.condition.tick():
            self.count("drop", -missed)

    def _admits(self, operation: Operation, unit: int) -> bool:
        return not self.condition.is_dark and operation.label not in self.condition.empty

    def _sensed(self, x: Array, v: Array) -> tuple[Array, Array]:
        dark = self.condition.is_dark
        return (np.full_like(x, np.nan), np.full_like(v, np.nan)) if dark else (x, v)

    def _drawn(
        self, kind: str, unit: int, now: float, label: str, robot: int = -1
    ) -> Deviation | None:
        """The fault of a kind that strikes, drawn for those with a rate."""
        name = self._factory.robots[robot].name if robot >= 0 else ""
        for number, fault in enumerate(self._faults):
            if fault.kind != kind or number in self._spent:
                continue
            if fault.label not in ("", label, label.partition("@")[0]):
                continue
            if fault.robot not in ("", name):
                continue
            if fault.rate is not None:
                hit = bool(self.condition.draw.random() < fault.rate)
            else:
                hit = fault.unit == unit + 1 if fault.unit is not None else now >= (fault.at or 0)
                if hit:
                    self._spent.add(number)
            if hit:
                self.count(kind)
                self.hits.append((kind, label, unit))
                return fault
        return None


_BY_OCCASION: Mapping[Occasion, Sequence[str]] = MappingProxyType(
    {
        occasion: [kind.name for kind in KINDS.values() if kind.occasion == occasion]
        for occasion in OCCASIONS
    }
)
"""The kinds of deviations that can begin at an occasion, in the order of the catalogue."""


def _occasions(operation: Operation) -> Iterator[tuple[Occasion, int, str]]:
    """The occasions of an operation that starts, each with the robot (index), -1 for none, and the
    label that may be struck."""
    for robot, label in zip(operation.robots, operation.before, strict=True):
        if label != NOPART:
            yield "payload", robot, label
        yield "robot", robot, label
    if len(operation.inputs) > 1:
        yield "joint", -1, operation.label
    if not operation.inputs:
        yield "feeder", -1, operation.label
    yield "operation", -1, operation.label


def deviate(simulation: Simulation, *deviations: Deviation, seed: int = 0) -> Simulation:
    """The same simulation, disturbed; call it once, before `run`. It does not continue after
    failures. Raises InputError (BadFault) for deviations that need this (`recover`), that name what
    is not there, or that need bodies in the ideal world."""
    if deviations:
        FaultInjector(simulation, Campaign(deviations, seed))
    return simulation
