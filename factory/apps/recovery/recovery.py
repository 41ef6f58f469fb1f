"""Recovery of a run: sensor readings become failures of operations, and templates say how to
respond."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from factory.api import (
    Diagnostic,
    Event,
    Factory,
    Failing,
    Failures,
    InputError,
    Operation,
    Simulation,
    Undone,
)
from factory.apps.deviations.campaign import Campaign
from factory.apps.deviations.deviation import KINDS, Deviation
from factory.apps.deviations.injector import FaultInjector, Hit
from factory.apps.recovery.books import RunState
from factory.apps.recovery.plant import Plant
from factory.apps.recovery.responding import RecoveryPolicy
from factory.apps.recovery.standing import Stood, patience
from factory.engine.simulation.supervisor import Supervisor
from factory.support.tables import table_of

IN_VAIN = 2.0
"""Nothing more will happen when nothing fires for so many times the longest delay of all."""


CAUSES = {"knocked": "lost"} | {kind.name: kind.test for kind in KINDS.values() if kind.test}
"""The test that finds each kind of fault, of those that some test finds."""


def summed(
    failures: Sequence[Failing],
    struck: Mapping[str, int],
    undone: int,
    spares: int,
    contacts: int,
    stood: Sequence[Stood],
    binned: int = 0,
    spilled: tuple[str, ...] = (),
) -> Failures:
    """The failures of a run. A dead robot that was never asked to move does not count as missed. A
    robot that is stuck in its operation does not count as a false alarm: it indicates an input that
    has slipped. Where there are disturbances, any failure may follow from them, and none is a false
    alarm."""
    stuck = sum(one.test == "jammed" and not one.is_death for one in failures)
    tests, wanted = Counter(one.test for one in failures), Counter[str]()
    tests["jammed"] -= stuck
    for kind, count in struck.items():
        if kind in CAUSES:
            wanted[CAUSES[kind]] += count
    wanted["jammed"] = min(wanted["jammed"], tests["jammed"])
    missed, alarms = wanted - tests, tests - wanted
    missed["residual"] -= min(stuck, missed["residual"])
    if any(kind in KINDS and KINDS[kind].is_disturbance for kind in struck):
        alarms.clear()
    return Failures(
        tuple(failures),
        {kind: count for kind, count in struck.items() if count},
        missed.total(),
        alarms.total(),
        undone,
        spares,
        contacts,
        tuple(stood),
        binned,
        spilled,
    )


def _unseen(failures: Failures, hits: Sequence[Hit]) -> Iterator[str]:
    """The missed faults among those that struck parts, in words: those that struck a label oftener
    than failures of their test concern it."""
    named = Counter((one.test, one.operation) for one in failures.found)
    for kind, label, unit in hits if failures.missed else ():
        test = CAUSES.get(kind, "")
        if named[test, label] > 0:
            named[test, label] -= 1
        elif test:
            yield f"{kind} '{label}' of unit {unit + 1}"


class Recovery:
    """The detection of failures in a simulation and the responses; see `recover`.

    Attributes:
        pending: by operation (index) at its goal that has failed a test, the name of the test.
    """

    def __init__(self, simulation: Simulation, books: RunState, plant: Plant, campaign: Campaign):
        self.simulation, self.books, self.plant = simulation, books, plant
        self.injector = FaultInjector(simulation, campaign, plant)
        self.condition = self.injector.condition
        self.responding = RecoveryPolicy(simulation, books, plant, campaign)
        self.condition.limit = self.responding.standing.limit
        self.pending: dict[int, str] = {}
        self._campaign = campaign
        self._seen = 0
        hooks = simulation.world.hooks
        hooks.gates.append(self._admits)
        hooks.judges.append(self._judge)
        hooks.ticks.append(self._tick)
        hooks.account = self

    @property
    def found(self) -> Sequence[Failing]:
        """All failures so far."""
        return self.responding.found

    @property
    def stood(self) -> Sequence[Stood]:
        """For each change of the robots that stand: the time, and which."""
        return self.responding.standing.stood

    @property
    def _factory(self) -> Factory:
        return self.books.factory

    @property
    def _now(self) -> float:
        return float(self.simulation.world.time)

    @property
    def _stopped(self) -> frozenset[int]:
        """Robots that may not start an operation."""
        busy = self.responding
        return frozenset({*self.plant.closed, *busy.dead, *busy.returning.ways})

    def _admits(self, operation: Operation, unit: int) -> bool:
        return self._stopped.isdisjoint(operation.robots)

    def _judge(self, operation: Operation, unit: int) -> bool:
        """Whether an operation at its goal passes its tests."""
        if operation.index in self.pending or not self.plant.feels(operation.robots):
            return False
        if not operation.inputs and not self.plant.offers(operation.label):
            return False
        for failure in operation.template.failures if operation.inputs else ():
            if self._fails(failure.test, failure.limit or 0.0, operation):
                self.pending[operation.index] = failure.test
                return False
        self.responding.passed(operation)
        return True

    def _fails(self, test: str, limit: float, operation: Operation) -> bool:
        """Whether an operation fails a test, with a limit [m]."""
        if test == "residual":
            return self.plant.residual(operation) > limit
        if test == "rejected":
            return self.plant.rejects(operation.carrier)
        return False

    def _tick(self) -> None:
        """Act after a tick of the world."""
        now = self._now
        self._take_notice(now)
        self.injector.tick()
        for label, unit in self.plant.fresh():
            number = self.books.supervisor.word.number(unit)
            self.injector.presented(self._factory.by_label[label], number, now)
        self.plant.tick()
        if not self.condition.is_dark:
            self._sense(now)
        self._go_on(now)

    def _take_notice(self, now: float) -> None:
        """Process the transitions that have fired since the last tick."""
        supervisor, factory = self.books.supervisor, self._factory
        fresh, self._seen = supervisor.events[self._seen :], len(supervisor.events)
        firings = [event.transition for event in fresh if isinstance(event, Event)]
        later = Counter(firings)
        for transition in firings:
            later[transition] -= 1
            number = factory.net.threaded.net.transition_index[transition]
            operation = factory.operation_of(number)
            unit = factory.unit(operation, supervisor.fired[number] - 1 - later[transition])
            if not supervisor.word.is_made(unit):
                continue
            if number == operation.start:
                self.responding.standing.begun(operation, now)
                self.injector.started(operation, supervisor.word.number(unit), now)
            for label in operation.inputs if number == operation.end else ():
                self.responding.used(label)

    def _sense(self, now: float) -> None:
        """Read the sensors and respond."""
        respond, by_label = self.responding, self._factory.by_label
        untested = self.plant.slipped - self.pending.keys()
        for label, _, test in self.plant.refused():
            respond.refused(by_label[label], test)
        for robot in self.plant.lost():
            if self.plant.knocked(robot):
                self.injector.count("knocked")
            respond.lost(robot)
        for number, test in [*self.pending.items()]:
            del self.pending[number]
            if number in self.books.supervisor.active.operations:
                respond.failed(self._factory.operations[number], test)
        excused = frozenset({*self.plant.closed, *respond.dead})
        for robot in respond.standing.jammed(now, excused):
            respond.stuck(robot)
        for robot in respond.returning.late(now - patience(max(self.simulation.delays))):
            if robot not in respond.dead:
                respond.died(robot)
        for kind in (*self.plant.unseen(), *["bad_joint"] * len(untested - self.plant.slipped)):
            self.injector.count(kind, -1)

    def _go_on(self, now: float) -> None:
        """Update which robots stand, return and are replaced."""
        respond = self.responding
        for robot in respond.replaced(now):
            self.condition.standing.pop(robot, None)
        respond.make_way()
        closed = self.plant.closed
        respond.standing.let_stand({*closed, *self.condition.standing, *respond.dead})
        respond.returning.tick({*closed, *respond.dead}, now)
        self.books.supervisor.enabled |= not self._stopped
        self.simulation.world.hooks.busy = max(self.simulation.world.hooks.busy, self._ends(now))
        silent, longest = self.simulation.silent, max(self.simulation.delays)
        if np.inf in respond.dead.values() and silent > IN_VAIN * longest:
            respond.give_up()

    def _ends(self, now: float) -> float:
        """Time until which a standstill is excused [s]."""
        condition, respond = self.condition, self.responding
        ends = [*self.plant.lying, *condition.empty.values(), condition.dark]
        ends += [*respond.dead.values(), *condition.standing.values()]
        ends += [now] * bool(respond.returning.ways) + [respond.standing.latest(now)]
        return max((end for end in ends if np.isfinite(end)), default=0.0)

    @property
    def given(self) -> Mapping[str, object]:
        """The campaign as JSON values."""
        return dict(table_of(self._campaign))

    def strike(self, fault: Deviation) -> None:
        """Apply a deviation as soon as possible, whatever time or unit it names."""
        self.injector.strike(fault, self._now)

    def report(self) -> Failures:
        """Summary of faults and failures so far."""
        undone = (e for e in self.books.supervisor.events if isinstance(e, Undone))
        failures = summed(
            self.responding.found,
            self.injector.struck,
            sum(len(event.transitions) for event in undone),
            self.responding.used_spares,
            self.plant.contacts,
            self.stood,
            self.plant.binned,
            tuple(dict.fromkeys(self.plant.spilled)),
        )
        return replace(failures, unseen=tuple(_unseen(failures, self.injector.hits)))


def recover(simulation: Simulation, campaign: Campaign = Campaign()) -> Recovery:  # noqa: B008
    """Enable recovery in a simulation, and apply the faults of a campaign to it. Call it once,
    before `run`.

    Raises InputError (BadFault) if a deviation names what is not there or needs bodies in the ideal
    world, or if the robots run their own programs; Usage for robots without guidepaths.
    """
    supervisor = simulation.supervisor
    simulation.layout.factory.check_rails("recovery (--faults, --spares)")
    if not isinstance(supervisor, Supervisor):
        message = "robots that run their own programs do not recover"
        raise InputError(Diagnostic("BadFault", message, None, "leave out --distributed"))
    books = RunState(simulation.layout.factory, supervisor)
    plant: Plant
    if simulation.model is None:
        from factory.apps.recovery.ideal import IdealPlant

        plant = IdealPlant(simulation, books)
    else:
        from factory.apps.recovery.mujoco.plant import MujocoPlant

        plant = MujocoPlant(simulation.physical, campaign)
    return Recovery(simulation, books, plant, campaign)
