"""Estimates of robots and cycle times for forms and lines, without a layout."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

from factory.compiler.expanding import expand
from factory.compiler.folding import Line
from factory.compiler.mating.mating import admitted
from factory.compiler.parallel import Branches
from factory.layout.durations import Pace
from factory.layout.shapes import payload_boxes
from factory.pipeline import Project
from factory.problem.plan import Plan
from factory.problem.shapes import is_shaped
from factory.study.allocation.aim import STEP
from factory.study.allocation.bundles import Filling
from factory.study.allocation.candidate import Candidate
from factory.study.allocation.forms import (
    FormsTask,
    Order,
    best_forms,
    written_forms,
)
from factory.study.allocation.lines import SLACKS, Shift
from factory.support.allowance import Allowance

WIDE = 1.3
"""Ratio of successive bounds on cycles for LARGE products (else `aim.STEP`)."""

LARGE = 400
"""Number of labels from which a product is large."""

FILLED = 1.12
"""Ratio of successive limits of the lines' loads."""

FEWER = 0.7
"""Least number of robots that is estimated, over the number asked for."""

SHARED = 8.0
"""Greatest duration of a tour over its share of the work, where a number of robots is asked for."""

NEAR = 1.3
"""Ratio of cycle times from which one estimate is clearly faster; layouts hide smaller ones."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate for forms and lines: the number of `robots`, tools included, and the cycle time [s];
    the `forms`, and the `filling` of the lines, None for one robot for each label."""

    robots: int
    seconds: float
    forms: Mapping[str, int]
    filling: Filling | None = None

    def beats(self, other: Estimate) -> bool:
        """Whether it has no more robots than another and is clearly faster, or equals it."""
        faster = self.seconds * NEAR <= other.seconds
        same = self.robots == other.robots and abs(self.seconds - other.seconds) < 1e-9
        return same or (self.robots <= other.robots and faster)


@dataclass(frozen=True)
class Estimator:
    """Estimates for the product of a `project` with one robot for each label and no relays;
    `branches` that its factories have several times."""

    project: Project
    branches: Branches = ()

    @cached_property
    def task(self) -> FormsTask:
        """The task by which forms are estimated."""
        project = self.project
        pag, templates, product = project.pag, project.templates, project.product
        admits = admitted(expand(pag, templates), product) if is_shaped(pag) else {}
        boxes = payload_boxes(project.compiled, product)
        return FormsTask(pag, templates, admits, boxes, Pace.of(project.settings))

    @cached_property
    def written(self) -> Mapping[str, int]:
        """The forms of the product as written."""
        return written_forms(self.task)

    def candidate(self, forms: Mapping[str, int], filling: Filling | None = None) -> Candidate:
        """The product with these forms, and with lines if a filling is given."""
        project = self._formed(forms)
        if filling is not None:
            project = project.with_plan(self._shift(project).plan(filling))
        return Candidate(project, forms, filling, self.branches)

    def front(self, budget: Allowance, robots: float = inf) -> list[Estimate]:
        """The estimates with lines of which no other is clearly better (see `estimates`)."""
        front: list[Estimate] = []
        for one in self.estimates(budget, robots):
            if one.filling is not None and not any(other.beats(one) for other in front):
                front = [other for other in front if not one.beats(other)] + [one]
        return front

    def estimates(self, budget: Allowance, robots: float = inf) -> Iterator[Estimate]:
        """All estimates with at most `robots` robots and no more blocked operations than the
        product as written, for as many forms as the budget allows, those as written first: for
        each, the one with one robot for each label, then those with lines."""
        tried = {tuple(self.written.values())}
        yield from self.of_forms(self.written, robots)
        for task in self._tasks():
            for bound in self.bounds(task, robots):
                if budget.over():
                    return
                forms, _ = best_forms(task, bound)
                key = tuple(forms.values())
                if key in tried:
                    continue
                tried.add(key)
                budget.spend()
                yield from self.of_forms(forms, robots)

    def of_forms(self, forms: Mapping[str, int], robots: float = inf) -> Iterator[Estimate]:
        """The estimates for forms; none where more operations are blocked than in the product as
        written."""
        project = self._formed(forms)
        if _blocked(project) <= self._blocked_as_written:
            yield from self._filled(project, forms, robots)

    @cached_property
    def _blocked_as_written(self) -> int:
        return _blocked(self._formed(self.written))

    def _tasks(self) -> Iterator[FormsTask]:
        orders: tuple[Order, ...] = ("lines", "fewest", "robots")
        for order in orders if self.task.free else orders[:1]:
            yield replace(self.task, order=order)

    def bounds(self, task: FormsTask, robots: float = inf) -> Iterator[float]:
        """Bounds on estimated cycles: none, then those that can be kept, the longest first. Where a
        number of `robots` is asked for, they begin at SHARED times the work of each."""
        yield inf
        bound = sum(task.pace.rest(task.size(label)) + task.pace.lost for label in task.nodes)
        bound = min(bound, SHARED * 2 * bound / robots) if robots < inf else bound
        step = STEP if len(task.nodes) < LARGE else WIDE
        while best_forms(task, bound)[1] == 0.0:
            yield bound
            bound /= step

    def _filled(
        self, project: Project, forms: Mapping[str, int], robots: float
    ) -> Iterator[Estimate]:
        """The estimates for forms with one robot for each label, and with lines for each
        filling."""
        shift, tried = self._shift(project), set[tuple[Line, ...]]()
        large = len(self.task.nodes) >= LARGE
        if shift.count(()) <= robots:
            yield Estimate(shift.count(()), shift.seconds(()), forms)
        for filling in shift.fillings(FILLED, SLACKS[:1] if large else SLACKS):
            lines = shift.lines(filling)
            count = shift.count(lines)
            wanted = robots == inf or FEWER * robots <= count <= robots
            if lines and lines not in tried and wanted:
                tried.add(lines)
                yield Estimate(count, shift.seconds(lines), forms, filling)

    def _shift(self, project: Project) -> Shift:
        factory = project.approached
        boxes = payload_boxes(factory, project.product)
        return Shift.of(factory, project.catalogue, boxes, self.task.pace)

    def _formed(self, forms: Mapping[str, int]) -> Project:
        """The product with these forms, and one robot for each label."""
        other = {label: form for label, form in forms.items() if form != self.written[label]}
        return self.project.with_plan(Plan(other))


def _blocked(project: Project) -> int:
    """Number of blocked operations of a project."""
    return len(project.matings.of_kind("blocked")) if project.matings else 0
