"""The search for the Pareto front of a product in robots, cycle time and floor area.

The sweep covers the forms of the product as written and those that are best by estimate under
bounds on cycles from long to short; for each of them one robot for each label, and lines filled for
cycles from short to long. The forms of the best estimates are also estimated with one form changed.
The Pareto-optimal estimates are laid out, then those next to them, since estimates are off by up to
half; the fastest with one robot for each label also with relays. The certified layouts then decide
which points are on the front.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import ceil, inf

from factory.api import FactoryError, Plan, Project
from factory.apps.few_robots.aim import Aim, least_robots, usual_effort
from factory.apps.few_robots.candidate import Candidate
from factory.apps.few_robots.estimating import Estimate, Estimator
from factory.apps.few_robots.parallel import Branches
from factory.apps.few_robots.search import SINGLE, Search
from factory.apps.pareto.front import Ended, FrontPoint, ParetoFront, candidates_front, undominated
from factory.support.allowance import Allowance

WIDE = 2
"""Effort for a front, over that of a search for one factory."""

HELD = 0.15
"""Share of the effort for forms with which each robot has a hand."""

NEXT = 1.5
"""Upper bound on the cycle time of estimates that are laid out, over that of the front."""

EACH = 3
"""Number of estimates that are laid out for each number of robots."""

RELAYED = 6
"""Number of the fastest factories with one robot for each label, of different numbers of robots,
that are also tried with relays."""


@dataclass(frozen=True, slots=True)
class Effort:
    """Effort for a front: whether `layouts` are made; the greatest number of them and of forms
    that are estimated (`factories`), None for the default; nothing is begun after `seconds`.
    `branches` of all its factories: labels, with the number of copies of the branch that brings
    each."""

    layouts: bool = True
    factories: int | None = None
    seconds: float = inf
    branches: Branches = ()


@dataclass(frozen=True, slots=True)
class Step:
    """Progress of a sweep: the present step, how many of how many are `done` (`total` None where
    that is unknown), and the number of points on the front."""

    what: str
    done: int
    total: int | None
    points: int


Seen = Callable[[Step], None]


def pareto(
    project: Project,
    effort: Effort = Effort(),
    seen: Seen = lambda _: None,
) -> ParetoFront:
    """The Pareto front found for a project's product, with its settings. `seen` is called with each
    step. Raises InputError, RunError where no factory has a layout."""
    sweep = FrontSweep(project, effort, seen)
    sweep.look()
    return sweep.front()


class FrontSweep:
    """Search for the front of a project's product; `points`: the Pareto-optimal points found so
    far."""

    def __init__(self, project: Project, effort: Effort, seen: Seen = lambda _: None) -> None:
        self.project, self.effort, self.seen = project, effort, seen
        factories = effort.factories or WIDE * usual_effort(len(project.pag))
        self.forms = Allowance(factories, effort.seconds)
        self.changes = Allowance(factories, effort.seconds)
        self.budget = Allowance(factories, effort.seconds)
        bare = replace(project.ground, relay=False, cycle=None)
        self.estimator = Estimator(project.with_plan(Plan()).with_ground(bare), effort.branches)
        self.written: FrontPoint | None = None
        self.points: list[FrontPoint] = []
        self.estimates: list[Estimate] = []
        self.laid_out = 0
        self.ended: Ended = "stopped"

    @cached_property
    def troubles(self) -> int:
        """Number of operations in trouble in the product as written."""
        return self.estimator.written.troubles

    def front(self) -> ParetoFront:
        """The front found so far."""
        if not self.effort.layouts:
            self._count()
        return ParetoFront(
            self.project.name,
            tuple(self.points),
            least_robots(self.project.pag, self.project.templates),
            self.written,
            len(self.estimates),
            self.laid_out,
            self.ended,
        )

    def look(self) -> None:
        """Search for points, as long as there is effort left."""
        layouts = self.effort.layouts
        if layouts:
            self.written = self._added(Candidate(self.project, self.estimator.written.forms))
        whole = self._estimate()
        if layouts:
            self._hold()
            whole = self._lay_out() and self._relay() and whole
            if not self.points:
                self.project.layout  # noqa: B018 (says why there is none)
        late = self.budget.spent < self.budget.effort and self.budget.time_used >= 1
        self.ended = "complete" if whole else "seconds" if late else "effort"

    def _estimate(self) -> bool:
        """Estimate the sweep, then the best with one form changed; whether the sweep is
        complete."""
        for one in self.estimator.estimates(self.forms):
            self._note(one)
        whole = not self.forms.over()
        for one in self._changed():
            self._note(one)
        return whole

    def _note(self, one: Estimate) -> None:
        self.estimates.append(one)
        self._say("estimating", len(self.estimates), None)

    def _changed(self) -> Iterator[Estimate]:
        """The estimates of the forms of the best with one form changed."""
        best = [one.forms for share, one in candidates_front(self.estimates) if share <= 1]
        tried = {tuple(one.forms.values()) for one in self.estimates}
        for label, form, forms in product(self.estimator.written.forms, (Plan.THIRD, 0, 1), best):
            changed = {**forms, label: form}
            key = tuple(changed.values())
            if key not in tried:
                if self.changes.over():
                    return
                self.changes.spend()
                tried.add(key)
                yield from self.estimator.of(self.estimator.candidate(changed))

    def _say(self, what: str, done: int, total: int | None) -> None:
        self.seen(Step(what, done, total, len(self.points)))

    def _count(self) -> None:
        """The points of estimates alone, as there are no layouts."""
        shares = [one for share, one in candidates_front(self.estimates) if share <= 1]
        made = [self._candidate(one) for one in shares]
        points = [FrontPoint.of_estimate(*pair) for pair in zip(made, shares, strict=True)]
        self.points = undominated(points)

    def _hold(self) -> None:
        """Lay out those with a robot for each label in which each robot has a hand."""
        if self.budget.over():
            return
        aim = Aim(effort=ceil(HELD * self.budget.effort / SINGLE), seconds=self.budget.left)
        search = Search(self.project, aim, self.estimator)
        for number, one in enumerate(search.singles()):
            self._say("fitting hands", number, None)
            self._added(one)

    def _lay_out(self) -> bool:
        """Lay out the promising estimates; whether all were laid out."""
        chosen = list(self._promising())
        for number, one in enumerate(chosen):
            if self.budget.over():
                return False
            self._say("laying out", number, len(chosen))
            self._added(self._candidate(one), one.seconds)
        return True

    def _promising(self) -> Iterator[Estimate]:
        """The estimates of the front, then those next to it."""
        counts, chosen = Counter[int](), set[tuple[int, float]]()
        for share, one in candidates_front(self.estimates):
            key = one.robots, round(one.seconds, 2)
            if share <= NEXT and key not in chosen and counts[one.robots] < EACH:
                chosen.add(key)
                counts[one.robots] += 1
                yield one

    def _relay(self) -> bool:
        """Lay out the fastest with one robot for each label again, with relays; whether all were
        laid out."""
        plain = sorted(
            (one for one in self.estimates if one.filling is None), key=lambda one: -one.seconds
        )
        fast = {one.robots: one for one in plain}.values()  # of those with as many robots the best
        fastest = map(self._candidate, sorted(fast, key=lambda one: one.seconds)[:RELAYED])
        every = [one for one in fastest if not one.project.planned.folded]
        for number, one in enumerate(every):
            if self.budget.over():
                return False
            self._say("with relays", number, len(every))
            ground = replace(one.single.ground, relay=True)
            self._added(replace(one, single=one.single.with_ground(ground)))
        return True

    def _candidate(self, one: Estimate) -> Candidate:
        """The factory of an estimate."""
        return self.estimator.candidate(one.forms, one.filling)

    def _added(self, one: Candidate, estimated: float | None = None) -> FrontPoint | None:
        """The point of a candidate, which is then on the front unless it is dominated; None where
        it has no layout, or more operations in trouble than the product as written."""
        self.laid_out += 1
        self.budget.spend()
        if one.troubles > self.troubles:
            return None
        try:
            point = FrontPoint.laid_out(one, estimated)
        except FactoryError:
            return None
        self.points = undominated([*self.points, point])
        return point
