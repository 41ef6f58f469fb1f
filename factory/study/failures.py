"""What each failure of a factory costs, and the proof that retries are bounded.

The state of a factory is how often each transition has fired; a failure makes that less
(`factory.nets.undo`). What is undone most is what is undone where everything has run ahead as far
as it can while the operation is at work: counts that are greater undo no less.

Delays are estimated from sizes, since nothing is laid out yet; `analyze` has those of a layout.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from factory.nets.marked import least_tokens, marked
from factory.nets.undo import times_undone, undo
from factory.plant.factory import Factory, Operation
from factory.plant.material import joins_of
from factory.problem.shapes import is_shaped
from factory.problem.template import Failure
from factory.timing.failing import (
    SCRAPS,
    Chance,
    FailingNet,
    FailingRun,
    Mishap,
    asked_by,
    failing_run,
)

if TYPE_CHECKING:
    from factory.pipeline import Project

COSTED = 16
"""Of a factory of so many operations at most the costs are found without being asked for."""

WARM, AFTER = 12, 12
"""A mishap comes so many products after the first, and is looked at for so many more."""


@dataclass(frozen=True, slots=True)
class FailureCost:
    """What is gone where a `lost` label is scrapped, or with "" where an operation is done again:
    so many `parts` in the bin, firings `undone` typically and at `most`, and how much `later` the
    products come, as estimated [s]."""

    lost: str
    parts: int
    undone: int
    most: int
    later: float

    def as_json(self) -> dict[str, Any]:
        """The cost as `check --json` lists it."""
        return {
            "lost": self.lost or None,
            "parts": self.parts,
            "undone": self.undone,
            "undone_at_most": self.most,
            "later_s": self.later,
        }


@dataclass(frozen=True, slots=True)
class OperationFailure:
    """A failure of an operation, with what doing it `again` costs, and a `scrap` of the dearest of
    what may be scrapped; None where that is no response or costs were not asked for."""

    operation: Operation
    failure: Failure
    again: FailureCost | None = None
    scrap: FailureCost | None = None

    def as_json(self) -> dict[str, Any]:
        """The failure as `check --json` lists it."""
        return {
            "operation": self.operation.label,
            **self.failure.as_json(),
            "retries": self.failure.retries,
            "again": self.again and self.again.as_json(),
            "scrap": self.scrap and self.scrap.as_json(),
        }


@dataclass(frozen=True)
class FailureStudy:
    """The failures of all operations. Derived, for a live net: `retries`, how often operations are
    done again at most while one unit is made and nothing is scrapped, and `attempts`, how often one
    operation is tried at most before it succeeds or the run stops.

    Theorem 6. A test's failures on end are at most its `again n` before a scrap or a stop, and
    SCRAPS scraps on end stop the run; the others of the same operation add to them. Between two
    failures each transition fires a bounded number of times, since the net is live after each
    (Theorem 5). So if no operation fails for ever, dropoff recurs for ever; else the run stops and
    names the operation.
    """

    failures: tuple[OperationFailure, ...] = field(repr=False)
    costed: bool = False

    @cached_property
    def _retries(self) -> Mapping[int, int]:
        """The sum of `again n` of each operation."""
        found: dict[int, int] = {}
        for one in self.failures:
            number = one.operation.index
            found[number] = found.get(number, 0) + one.failure.retries
        return found

    @property
    def retries(self) -> int:
        """The sum of `again n` over the operations of one unit."""
        first = (one for one in self.failures if one.operation.turn == 0)
        return sum(one.failure.retries for one in first)

    @property
    def attempts(self) -> int:
        """The most attempts on end at one operation."""
        return SCRAPS * (1 + max(self._retries.values(), default=0))

    def as_json(self) -> dict[str, Any]:
        """The key `failures` of `check --json`."""
        bound = {"retries": self.retries, "scraps": SCRAPS, "attempts": self.attempts}
        return {
            "bound": bound,
            "costed": self.costed,
            "tests": [f.as_json() for f in self.failures],
        }


def failure_study(project: Project, costs: bool | None = None) -> FailureStudy:
    """The failures of a project's factory; with their costs if that is said, or where that is not
    said of small factories only, whose parts have shapes. Linear without costs."""
    factory = project.factory
    pairs = [(o, failure) for o in factory.operations for failure in o.template.failures]
    if costs is None:
        costs = len(factory.operations) <= COSTED and is_shaped(project.pag)
    if not costs:
        return FailureStudy(tuple(OperationFailure(*pair) for pair in pairs))
    found = _Costs(estimated_net(project))
    return FailureStudy(tuple(found.of(*pair) for pair in pairs), True)


def estimated_net(project: Project) -> FailingNet:
    """The timed net of a project's factory with delays estimated from sizes."""
    from factory.layout.durations import Pace
    from factory.layout.repeated import repeated
    from factory.layout.shapes import payload_boxes
    from factory.study.allocation.bundles import SizeTiming
    from factory.study.allocation.lines import estimated_delays

    factory = project.factory
    boxes, pace = (
        payload_boxes(factory, repeated(project.product, factory)),
        Pace.of(project.settings),
    )
    delays = estimated_delays(SizeTiming.of(factory, boxes, pace))
    net = marked(factory.net)
    seconds = [*delays, *[0.0] * (len(net.tokens) - len(delays))]
    pairs = zip(delays, factory.operations, strict=True)
    return FailingNet(factory, net, seconds, [delay - o.dwell for delay, o in pairs])


class _Costs:
    """Finds the costs of failures, each outcome of an operation once."""

    def __init__(self, subject: FailingNet) -> None:
        self.subject, self.factory = subject, subject.factory
        self.rules = joins_of(self.factory)
        self.units = (WARM + AFTER) * self.factory.period
        self.plain = self._run(lambda operation, ended: None).dates[-1]
        self.known: dict[tuple[int, tuple[str, ...]], FailureCost] = {}

    def of(self, operation: Operation, failure: Failure) -> OperationFailure:
        """A failure with its costs."""
        again = self._cost(operation, ()) if failure.retries else None
        if failure.last == "stop":
            return OperationFailure(operation, failure, again)
        labels = operation.inputs or (operation.label,)
        every = [(x,) for x in labels] if failure.test == "lost" else [labels]
        costs = [self._cost(operation, lost) for lost in every]
        dearest = max(costs, key=lambda cost: (cost.later, cost.most))
        return OperationFailure(operation, failure, again, dearest)

    def _cost(self, operation: Operation, lost: tuple[str, ...]) -> FailureCost:
        key = operation.index, lost
        if key not in self.known:
            run = self._run(_once(operation, lost))
            undone = sum(run.undone.values())
            parts = sum(len(_parts(self.factory, label)) for label in lost)
            later = max(0.0, run.dates[-1] - self.plain)
            most = self._most(operation, lost)
            self.known[key] = FailureCost(", ".join(lost), parts, undone, most, later)
        return self.known[key]

    def _most(self, operation: Operation, lost: tuple[str, ...]) -> int:
        """The most firings that are undone, over all markings in which the operation is at work."""
        net, base = self.subject.net, 2 * len(self.subject.net.net.transitions)
        ahead = least_tokens(net, operation.end)
        full = [base + (more or 0) for more in ahead]
        asked = asked_by(self.factory, operation, lost)
        return sum(times_undone(full, undo(net, full, asked, self.rules)).values())

    def _run(self, chance: Chance) -> FailingRun:
        return failing_run(self.subject, chance, self.units)


def _once(operation: Operation, lost: tuple[str, ...]) -> Chance:
    """A chance of one mishap, at one end of an operation."""
    left = [Mishap(lost)]

    def chance(here: Operation, ended: int) -> Mishap | None:
        return left.pop() if left and here.index == operation.index and ended == WARM else None

    return chance


def _parts(factory: Factory, label: str) -> list[str]:
    """The parts that a label is made of."""
    found, queue = [], [label]
    for one in queue:
        inputs = factory.by_label[one].inputs
        queue += inputs
        found += [] if inputs else [one]
    return found
