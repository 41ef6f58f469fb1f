"""The response to a failure: the net fires backwards to the greatest marking without it
(undo.py); robots return to where they wait in that marking and drop what has become scrap."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from factory.api import (
    NOPART,
    Diagnostic,
    Failing,
    LayoutMachines,
    Marking,
    Operation,
    Simulation,
    Undone,
)
from factory.apps.deviations.campaign import Campaign
from factory.apps.recovery.books import RunState
from factory.apps.recovery.plant import Plant
from factory.apps.recovery.returning import Goal, ReturnMotion, WayBack, order_of
from factory.apps.recovery.standing import MotionHold
from factory.apps.recovery.undo import marking_after, undo
from factory.apps.recovery.wasting import OnEnd, ScrapRouting

SCRAPS = 20
"""So many scraps of one operation on end stop the run: something else is wrong."""

BINNED = 1.0
"""What falls into a bin is gone so long after that [s]."""


class RecoveryPolicy:
    """Responds to detected failures as the templates say.

    Attributes:
        found: all failures.
        dead: by robot (index) known to be dead, the time of its replacement [s]; inf without a
            spare.
        used_spares: number of spares that replaced a robot.
        returning: the motion of robots that return.
        standing: the robots that are stopped.
    """

    def __init__(
        self, simulation: Simulation, books: RunState, plant: Plant, campaign: Campaign
    ) -> None:
        self._simulation, self._books, self._plant, self._campaign = (
            simulation,
            books,
            plant,
            campaign,
        )
        eps = simulation.request.settings.eps
        self.returning = ReturnMotion(simulation.layout, books.supervisor, eps)
        self.standing = MotionHold(simulation, books.supervisor)
        self.found: list[Failing] = []
        self.dead: dict[int, float] = {}
        self.used_spares = 0
        self._on_end = OnEnd()
        self._wasting = ScrapRouting(LayoutMachines(simulation.layout).not_carried_back)

    def passed(self, operation: Operation) -> None:
        """Note that an operation has passed its tests."""
        self._on_end.tried.pop(operation.index, None)

    def used(self, label: str) -> None:
        """Note that a label has been joined: it was not scrapped."""
        self._on_end.scrapped[label] = 0

    def refused(self, leaf: Operation, test: str) -> None:
        """A feeder withdraws a part: its robot makes room for the next one."""
        response = self._on_end.response(leaf, test)
        if response == "stop":
            self._end(test, leaf, f"'{leaf.label}' fails the test '{test}'")
            return
        if response == "again":
            self._on_end.tried[leaf.index] += 1
        self._scrap(test, leaf, -1, (leaf.label,))
        robot = leaf.carrier
        if self._books.operation_of(robot) is not leaf:
            return
        if leaf.index in self._books.supervisor.active.operations:
            self._undo((leaf.start,), leaf, test)
        self._books.supervisor.recall(self.standing.axes([robot]))
        waits, is_up = self.returning.rest(robot, self._books.marking), partial(self._is_up, robot)
        back = partial(self.returning.send, robot, WayBack(waits, ready=is_up))
        self.returning.send(robot, WayBack(self.returning.aside(robot, leaf), done=back))

    def make_way(self) -> None:
        """Send robots that block a late part at their feeders out of its way."""
        books, supervisor = self._books, self._books.supervisor
        active = supervisor.active.operations
        away = supervisor.ordering.axes(books.factory.operations[n].start for n in active)
        late = self._plant.in_the_way(away)
        for robot in late - self.returning.ways.keys() - self.dead.keys():
            if books.step_of(robot)[1] or books.operation_of(robot).inputs:
                continue
            books.supervisor.recall(self.standing.axes([robot]))
            self.returning.send(robot, WayBack(self.returning.rest(robot, books.marking)))

    def lost(self, robot: int) -> None:
        """A robot has lost its payload: undo to where that is made again."""
        label, operation = self._books.holds(robot), self._books.operation_of(robot)
        if self._on_end.response(operation, "lost") == "stop":
            self._end("lost", operation, f"{self._name(robot)} has lost '{label}'", robot)
            return
        self._scrap("lost", operation, robot, (label,))
        self._undo((self._books.factory.by_label[label].end,), operation, "lost")

    def failed(self, operation: Operation, test: str) -> None:
        """An operation has failed a test at its goal: repeat it, or scrap its inputs and make them
        again."""
        response, by_label = self._on_end.response(operation, test), self._books.factory.by_label
        if response == "again":
            self._on_end.tried[operation.index] += 1
            self._note(test, operation, -1, response)
            self._undo((operation.start,), operation, test)
        elif response == "stop":
            self._end(test, operation, f"'{operation.label}' fails the test '{test}'")
        else:
            self._on_end.tried.pop(operation.index, None)
            self._scrap(test, operation, -1, operation.inputs)
            ends = tuple(by_label[label].end for label in operation.inputs)
            self._undo(ends, operation, test)

    def stuck(self, robot: int) -> None:
        """A robot makes no progress. If its operation is under way and its template has the test
        `jammed`, the operation has failed; otherwise, or if the robot had not left where it waited,
        it is dead."""
        if robot in self.dead or robot in self.returning.ways:
            return
        operation = self._books.operation_of(robot)
        begun = operation.index in self._books.supervisor.active.operations
        tests = operation.template.failure("jammed") is not None
        if begun and tests and self.returning.has_left(robot, self._books.marking):
            self.failed(operation, "jammed")
        else:
            self.died(robot)

    def died(self, robot: int) -> None:
        """A robot is dead, and its payload lost. It is replaced by a spare, if one is left, after
        `swap` seconds."""
        label, operation = self._books.holds(robot), self._books.operation_of(robot)
        if self.used_spares == self._campaign.spares:
            self.dead[robot] = np.inf
            self._note("jammed", operation, robot, "no spare")
            return
        self.used_spares += 1
        self.dead[robot] = self._now + self._campaign.swap
        held = () if label == NOPART else (label,)
        self._note("jammed", operation, robot, "spare", held, self.dead[robot])
        ends = tuple(self._books.factory.by_label[label].end for label in held)
        begun = operation.index in self._books.supervisor.active.operations
        if asked := ends or (operation.start,) * begun:
            self._undo(asked, operation, "jammed")

    def replaced(self, now: float) -> list[int]:
        """Replace the robots that are due [s] by spares, and return them."""
        robots = [robot for robot, until in self.dead.items() if until <= now]
        for robot in robots:
            self._replace(robot)
            del self.dead[robot]
            self._plant.supplied()
        return robots

    def _replace(self, robot: int) -> None:
        """Put a spare in the place of a dead robot."""
        self.returning.ways.pop(robot, None)
        supervisor = self._books.supervisor
        stages = supervisor.ahead.going(supervisor.active.ahead).values()
        ahead = {int(stage.axis): stage.goal for stage in stages if stage.robot == robot}
        at = ahead or dict(self.returning.rest(robot, self._books.marking))
        self._plant.lift_out(robot, at)

    def give_up(self) -> None:
        """End the run: all that can be made without the dead robots has been made."""
        robot = next(robot for robot, until in self.dead.items() if until == np.inf)
        operation = self._books.operation_of(robot)
        self._stop(f"{self._name(robot)} is dead, and there is no spare", operation)

    def _undo(self, asked: tuple[int, ...], operation: Operation, reason: str) -> None:
        """Fire the net backwards and send robots back."""
        books, supervisor, factory = self._books, self._books.supervisor, self._books.factory
        before, under_way = books.marking, supervisor.active.operations
        held, joins = books.held(), factory.joins
        fired = undo(factory.net, supervisor.fired, asked, joins)
        while lacking := self._lacking(held, fired):
            asked += lacking
            fired = undo(factory.net, supervisor.fired, asked, joins)
        marking, robots = marking_after(factory.net, fired), range(len(factory.robots))
        going = {r for r in robots if books.step_of(r, before) != books.step_of(r, marking)}
        what = self._now, operation.label, reason
        undone = Undone.between(factory.net, what, asked, supervisor.fired, fired)
        scrap = {*self._plant.undone(books.held(marking, fired), fired, going)}
        supervisor.undo(undone, fired, marking, self.standing.axes(going | scrap))
        over = [factory.operations[n] for n in under_way if n not in marking]
        self._wasting.waste(scrap, {robot: held[robot] for robot in scrap})
        self._send_back(sorted(going | scrap), over, marking)
        self._plant.supplied()

    def _lacking(self, held: Sequence[str], fired: Sequence[int]) -> tuple[int, ...]:
        """End transitions of labels that robots would hold after other firing counts and do not
        `held` now: a skipped unit has no parts, so it cannot replace what was lost."""
        books, marking = self._books, marking_after(self._books.factory.net, fired)
        if books.supervisor.word.demand is None:
            return ()
        pairs = zip(held, books.held(marking, fired), strict=True)
        missing = (label for was, label in pairs if label not in (NOPART, was))
        return tuple(books.factory.by_label[label].end for label in missing)

    def _send_back(
        self,
        robots: Iterable[int],
        over: Sequence[Operation],
        marking: Marking,
    ) -> None:
        """Send robots to where they wait in a marking. A robot with scrap goes to its B end first,
        or drops it at once if it cannot carry it there. The robots of operations that are `over`
        leave in the reverse order of their coming."""
        scrap = self._wasting.held
        after = dict[int, frozenset[int]]()
        for operation in over:
            came = order_of(self._simulation.modes[operation.index], operation.robots)
            for slot, robot in enumerate(came):
                after[robot] = frozenset(came[slot + 1 :])
        for robot in robots:
            rest = self.returning.rest(robot, marking)
            goals, done = rest, partial(self._plant.came_back, robot)
            if robot in scrap and self._wasting.falls_here(robot):
                self._plant.let_go(robot, self._campaign.clear)
            elif robot in scrap:
                goals, done = (
                    self.returning.home(robot),
                    partial(self._bin, robot, scrap[robot], rest),
                )
            first = after.get(robot, frozenset[int]())
            self.returning.send(robot, WayBack(goals, first, done, partial(self._is_up, robot)))

    def _bin(self, robot: int, label: str, rest: list[Goal]) -> None:
        """Drop a robot's scrap into the bin at its B end, and send the robot to where it waits."""
        self._plant.throw_away(robot, label, BINNED)
        self.returning.send(robot, WayBack(rest))

    def _is_up(self, robot: int) -> bool:
        """Whether no part is being withdrawn into a robot's feeder."""
        return not self._plant.takes_back(robot)

    def _scrap(self, test: str, operation: Operation, robot: int, labels: tuple[str, ...]) -> None:
        """Scrap labels; end the run if one is scrapped too many times in succession."""
        self._note(test, operation, robot, "scrap", labels)
        for label in labels:
            self._on_end.scrapped[label] += 1
            if self._on_end.scrapped[label] >= SCRAPS:
                what = f"'{label}' was scrapped {SCRAPS} times on end"
                self._stop(what, self._books.factory.by_label[label])

    def _end(self, test: str, operation: Operation, what: str, robot: int = -1) -> None:
        """Record a failure that ends the run."""
        self._note(test, operation, robot, "stop")
        self._stop(what, operation)

    def _stop(self, what: str, operation: Operation) -> None:
        hint = "`factory run --json` lists all failures"
        trouble = Diagnostic("Failed", what, operation.position, hint)
        self._simulation.world.hooks.trouble = trouble

    def _note(
        self,
        test: str,
        operation: Operation,
        robot: int,
        response: str,
        scrapped: tuple[str, ...] = (),
        until: float | None = None,
    ) -> None:
        name = "" if robot < 0 else self._name(robot)
        what = self._now, test, operation.label, name, response, scrapped, until
        self.found.append(Failing(*what))

    def _name(self, robot: int) -> str:
        return self._books.factory.robots[robot].name

    @property
    def _now(self) -> float:
        return float(self._simulation.world.time)
