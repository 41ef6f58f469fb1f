"""A factory that goes on: what sensors tell is a failure of an operation, and its template says what
is done. The net fires backwards to the greatest marking without it (nets/undo.py); robots go back
to where they wait there, and let fall on the way what nobody asks for any more."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from factory.control.mode import Array
from factory.nets.petri import Marking
from factory.nets.undo import marking_after, undo
from factory.nets.undone import Undone
from factory.plant.factory import Factory, Operation
from factory.plant.material import joins_of
from factory.problem.pag import NOPART
from factory.problem.template import Failure, Response
from factory.record.failing import Failing
from factory.simulation.recovery.faults import Campaign
from factory.simulation.recovery.held import held, marking_of, step_of
from factory.simulation.recovery.plant import Plant
from factory.simulation.failures import Failures
from factory.simulation.recovery.returning import Goal, Returning, WayBack, order_of
from factory.simulation.recovery.standing import Standing
from factory.simulation.recovery.striking import Striking
from factory.simulation.run import Event
from factory.simulation.simulation import Simulation
from factory.simulation.supervisor import Supervisor
from factory.support.errors import Diagnostic, InputError

MOST_SCRAPPED = 20
"""A label of which so many are scrapped on end stops the run."""

CAUSES = {
    "drop": "lost",
    "knocked": "lost",
    "misplaced": "misplaced",
    "bad_part": "rejected",
    "bad_joint": "residual",
    "dead": "jammed",
}
"""The test that finds each kind of fault, of those that some test finds."""

IN_VAIN = 2.0
"""Nothing more will happen when nothing fires for so many times the longest delay of all."""


class Recovery:
    """What goes wrong in a simulation, and what is done about it; see `recover`.

    `found`: every failure; `pending`: operations that must not end as they are, each with the test
    that says so; `dead`: robots that are known to be dead, and until when they are replaced [s].
    """

    def __init__(self, simulation: Simulation, campaign: Campaign, plant: Plant) -> None:
        factory = simulation.layout.factory
        self.simulation, self.campaign, self.plant = simulation, campaign, plant
        names = tuple(robot.name for robot in factory.robots)
        self.striking = Striking(campaign, plant, names, tuple(simulation.delays))
        settings = simulation.request.settings
        self.returning = Returning(simulation.layout, self._supervisor, settings.eps)
        self.standing = Standing(simulation)
        self.found: list[Failing] = []
        self.pending: dict[int, str] = {}
        self.dead: dict[int, float] = {}
        self._seen, self._spares = 0, campaign.spares
        self._times: Counter[tuple[str, str]] = Counter()
        hooks = simulation.world.hooks
        hooks.gates.append(self._admits)
        hooks.judges.append(self._judge)
        hooks.sensors.append(self._sensed)
        hooks.ticks.append(self._tick)
        hooks.account = self

    @property
    def _factory(self) -> Factory:
        return self.simulation.layout.factory

    @property
    def _supervisor(self) -> Supervisor:
        assert isinstance(self.simulation.supervisor, Supervisor)
        return self.simulation.supervisor

    @property
    def at_rest(self) -> frozenset[int]:
        """The robots (index) that stand, for whatever reason."""
        return self.standing.now

    @property
    def _now(self) -> float:
        return float(self.simulation.world.time)

    @property
    def _is_dark(self) -> bool:
        return self._now < self.striking.dark

    @property
    def _stopped(self) -> frozenset[int]:
        """Robots that begin nothing."""
        return frozenset({*self.plant.closed, *self.dead, *self.returning.ways})

    def _sensed(self, x: Array, v: Array) -> tuple[Array, Array]:
        return (np.full_like(x, np.nan), np.full_like(v, np.nan)) if self._is_dark else (x, v)

    def _admits(self, operation: Operation, unit: int) -> bool:
        if self._is_dark or operation.label in self.striking.empty:
            return False
        return self._stopped.isdisjoint(operation.robots)

    def _judge(self, operation: Operation, unit: int) -> bool:
        """Whether an operation that has come to its goal is as it should be."""
        if operation.index in self.pending or not self.plant.feels(operation.robots):
            return False
        if not operation.inputs:
            return self.plant.offers(operation.label)
        for failure in operation.template.failures:
            if self._fails(failure, operation):
                self.pending[operation.index] = failure.test
                return False
        self._times[operation.label, "again"] = 0
        return True

    def _fails(self, failure: Failure, operation: Operation) -> bool:
        if failure.test == "residual":
            return self.plant.residual(operation) > (failure.limit or 0.0)
        if failure.test == "rejected":
            return self.plant.rejects(operation.carrier)
        return False

    def _tick(self) -> None:
        """After every tick of the world."""
        now = self._now
        self._take_notice(now)
        self.striking.tick(now)
        for label, unit in self.plant.fresh():
            if fault := self.striking.shown(label, unit, now):
                self.plant.spoil(label, fault)
        self.plant.tick()
        if not self._is_dark:
            self._sense(now)
        self._go_on(now)

    def _take_notice(self, now: float) -> None:
        """Of what has fired since the last tick."""
        supervisor, factory = self._supervisor, self._factory
        fresh, self._seen = supervisor.events[self._seen :], len(supervisor.events)
        for event in fresh:
            if not isinstance(event, Event):
                continue
            number = factory.net.threaded.net.transition_index[event.transition]
            operation = factory.operations[number // 2]
            if number == operation.start:
                unit = factory.unit(operation, supervisor.fired[number] - 1)
                self.standing.begun(operation, now)
                self.striking.started(operation, unit, now)
            for label in operation.inputs if number == operation.end else ():
                self._times[label, "scrap"] = 0

    def _sense(self, now: float) -> None:
        """What sensors tell, and what is done about it."""
        for label, _, test in self.plant.refused():
            self._refused(self._factory.by_label[label], test)
        for robot in self.plant.lost():
            self._lost(robot)
        for number, test in [*self.pending.items()]:
            del self.pending[number]
            if number in self._supervisor.active.operations:
                self._failed(self._factory.operations[number], test)
        excused = frozenset({*self.plant.closed, *self.dead})
        for robot in self.standing.jammed(now, excused):
            if robot not in self.dead:
                self._died(robot, now)

    def _refused(self, leaf: Operation, test: str) -> None:
        """A feeder takes a part back: its robot gets out of the way of the next."""
        self._note(test, leaf.label, "", "scrap", (leaf.label,))
        self._count(leaf.label)
        robot = leaf.carrier
        step = self._place_of(robot)
        if self._factory.robots[robot].operations[step // 2] != leaf.index:
            return
        if leaf.index in self._supervisor.active.operations:
            self._undo((leaf.start,), leaf, test)
        self._supervisor.recall(self.standing.axes([robot]))
        rest = WayBack(self.returning.rest(robot, self._marking), ready=partial(self._is_up, robot))
        back = partial(self.returning.send, robot, rest)
        self.returning.send(robot, WayBack(self.returning.aside(robot, leaf), done=back))

    def _is_up(self, robot: int) -> bool:
        """Whether nothing goes back up in a robot's feeder."""
        return not self.plant.takes_back(robot)

    def _lost(self, robot: int) -> None:
        """A robot has lost what it held: that is made again."""
        label = self._held()[robot]
        if self.plant.knocked(robot):
            self.striking.struck["knocked"] = self.striking.struck.get("knocked", 0) + 1
        step = self._place_of(robot)
        operation = self._factory.operations[self._factory.robots[robot].operations[step // 2]]
        if self._stops(operation, "lost"):
            self._stop(f"{self._name(robot)} has lost '{label}'", operation)
            return
        self._note("lost", operation.label, self._name(robot), "scrap", (label,))
        self._count(label)
        self._undo((self._factory.by_label[label].end,), operation, "lost")

    def _stops(self, operation: Operation, test: str) -> bool:
        responses = self._responses(operation, test)
        return bool(responses) and responses[0].kind == "stop"

    def _responses(self, operation: Operation, test: str) -> Sequence[Response]:
        found = (f.responses for f in operation.template.failures if f.test == test)
        return next(found, ())

    def _failed(self, operation: Operation, test: str) -> None:
        """An operation has come to its goal and is no good: again, or all that it was to join is
        made again."""
        tried, kind = self._times[operation.label, "again"], "stop"
        for response in self._responses(operation, test):
            kind = response.kind
            if kind != "again" or tried < response.times:
                break
            tried -= response.times
        if kind == "again":
            self._times[operation.label, "again"] += 1
            self._note(test, operation.label, "", "again")
            self._undo((operation.start,), operation, test)
            return
        if kind == "stop":
            self._stop(f"'{operation.label}' fails the test {test}", operation)
            return
        self._times[operation.label, "again"] = 0
        self._note(test, operation.label, "", "scrap", operation.inputs)
        for label in operation.inputs:
            self._count(label)
        ends = (self._factory.by_label[label].end for label in operation.inputs)
        self._undo(tuple(ends), operation, test)

    def _died(self, robot: int, now: float) -> None:
        """A robot makes no progress. One from the depot takes its place after some time; what it
        held is lost with it."""
        label = self._held()[robot]
        operation = self._factory.operations[
            self._factory.robots[robot].operations[self._place_of(robot) // 2]
        ]
        spared = self._spares > 0
        self.dead[robot] = now + self.campaign.swap if spared else np.inf
        scrapped = () if label == NOPART else (label,)
        response, until = ("spare", self.dead[robot]) if spared else ("none", None)
        self._note("jammed", operation.label, self._name(robot), response, scrapped, until)
        if not spared:
            return
        self._spares -= 1
        asked = operation.start if label == NOPART else self._factory.by_label[label].end
        self._undo((asked,), operation, "jammed")

    def _undo(self, asked: tuple[int, ...], operation: Operation, reason: str) -> None:
        """The net fires backwards, and robots go back."""
        supervisor, factory = self._supervisor, self._factory
        before, under_way = self._marking, supervisor.active.operations
        joins = joins_of(factory)
        fired = undo(factory.net, supervisor.fired, asked, joins)
        marking = marking_after(factory.net, fired)
        robots = [r for r in range(len(factory.robots)) if step_of(factory, r, before) != step_of(factory, r, marking)]
        what = self._now, operation.label, reason
        undone = Undone.between(factory.net, what, asked, supervisor.fired, fired)
        untested = self.plant.slipped - marking - {operation.index}
        self.striking.dissolved(len(untested))
        scrap = self.plant.undone(held(factory, marking), fired, {*robots})
        free = self.standing.axes([*robots, *scrap])
        supervisor.undo(undone, fired, marking, free)
        over = [factory.operations[n] for n in under_way if n not in supervisor.active.operations]
        self._send_back([*dict.fromkeys((*robots, *scrap))], {*scrap}, over, marking)
        self.plant.supplied()

    def _send_back(
        self, robots: Iterable[int], scrap: set[int], over: Sequence[Operation], marking: Marking
    ) -> None:
        """Robots go to where they wait in a marking, by way of their B ends with `scrap`; those of
        operations that are `over` leave in the reverse order of their coming."""
        after = dict[int, frozenset[int]]()
        for operation in over:
            came = order_of(self.simulation.modes[operation.index], operation.robots)
            for slot, robot in enumerate(came):
                after[robot] = frozenset(came[slot + 1 :])
        for robot in robots:
            rest, home = self.returning.rest(robot, marking), self.returning.home(robot)
            goals, done = rest, partial(self.plant.came_back, robot)
            if robot in scrap:
                goals, done = home, partial(self._bin, robot, rest)
            first = after.get(robot, frozenset[int]())
            self.returning.send(robot, WayBack(goals, first, done, partial(self._is_up, robot)))

    def _bin(self, robot: int, rest: list[Goal]) -> None:
        """A robot at the B end of its guidepath lets scrap fall into the bin there, and goes to
        where it waits."""
        self.plant.let_go(robot)
        self.returning.send(robot, WayBack(rest))

    def _go_on(self, now: float) -> None:
        """Robots stand, go on and come back; spares come."""
        for robot in [robot for robot, until in self.dead.items() if until <= now]:
            del self.dead[robot]
            self.striking.standing.pop(robot, None)
            self.returning.ways.pop(robot, None)
            self.plant.lift_out(robot, dict(self.returning.rest(robot, self._marking)))
            self.plant.supplied()
        closed = self.plant.closed
        self.standing.let_stand({*closed, *self.striking.standing, *self.dead})
        self.returning.tick({*closed, *self.dead})
        self._supervisor.enabled |= not self._stopped
        hooks = self.simulation.world.hooks
        ends = [*self.plant.lying, *self.striking.empty.values(), self.striking.dark]
        ends += [until for until in (*self.dead.values(), *self.striking.standing.values())]
        hooks.busy = max([hooks.busy, *(until for until in ends if np.isfinite(until))])
        if self.returning.ways:
            hooks.busy = now
        if np.inf in self.dead.values() and self.simulation.silent > IN_VAIN * max(self.simulation.delays):
            robot = next(robot for robot, until in self.dead.items() if until == np.inf)
            operation = self._factory.operations[self._factory.robots[robot].operations[0]]
            self._stop(f"{self._name(robot)} is dead, and there is no spare", operation)

    def _count(self, label: str) -> None:
        """Something is scrapped; too often on end, and the run stops."""
        self._times[label, "scrap"] += 1
        if self._times[label, "scrap"] >= MOST_SCRAPPED:
            what = f"'{label}' was scrapped {MOST_SCRAPPED} times on end"
            self._stop(what, self._factory.by_label[label])

    def _stop(self, what: str, operation: Operation) -> None:
        hint = "look at `failures` of `run --json`"
        self.simulation.world.hooks.trouble = Diagnostic("Failed", what, operation.position, hint)

    def _note(
        self,
        test: str,
        operation: str,
        robot: str,
        response: str,
        scrapped: tuple[str, ...] = (),
        until: float | None = None,
    ) -> None:
        self.found.append(Failing(self._now, test, operation, robot, response, scrapped, until))

    def _name(self, robot: int) -> str:
        return self._factory.robots[robot].name

    @property
    def _marking(self) -> Marking:
        return marking_of(self._supervisor.marked)

    def _held(self) -> list[str]:
        return held(self._factory, self._marking)

    def _place_of(self, robot: int) -> int:
        return step_of(self._factory, robot, self._marking)

    def report(self) -> Failures:
        """What went wrong so far."""
        struck = self.striking.struck
        found = Counter(one.test for one in self.found)
        wanted = Counter[str]()
        for kind, count in struck.items():
            if kind in CAUSES:
                wanted[CAUSES[kind]] += count
        wanted["jammed"] = min(wanted["jammed"], found["jammed"])  # none has to move before the end
        missed, alarms = wanted - found, found - wanted
        as_lost = min(missed["residual"], alarms["lost"])
        knocked = min(missed["residual"] - as_lost, struck.get("knocked", 0))
        undone = (e for e in self._supervisor.events if isinstance(e, Undone))
        return Failures(
            tuple(self.found),
            dict(struck),
            missed.total() - as_lost - knocked,
            alarms.total() - as_lost,
            sum(len(event.transitions) for event in undone),
            self.campaign.spares - self._spares,
            self.plant.contacts,
        )


def recover(simulation: Simulation, campaign: Campaign = Campaign()) -> Recovery:  # noqa: B008
    """Let a simulation that is ready to run go on when its operations fail as the faults of a
    campaign make them; call it once, before `run`.

    Raises InputError (BadFault) where a fault names a robot or label that is not there, and where
    the robots run their own programs.
    """
    if not isinstance(simulation.supervisor, Supervisor):
        message = "robots that run their own programs do not recover"
        raise InputError(Diagnostic("BadFault", message, None, "leave out --distributed"))
    plant: Plant
    if simulation.model is None:
        from factory.simulation.recovery.ideal import IdealPlant

        plant = IdealPlant(simulation)
    else:
        from factory.simulation.mujoco.failing.plant import MujocoPlant

        plant = MujocoPlant(simulation.physical, campaign)
    return Recovery(simulation, campaign, plant)
