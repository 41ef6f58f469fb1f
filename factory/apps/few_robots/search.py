"""The search for an allocation: the forms of operations and the lines of robots, for few robots and
a cycle time.

The search begins with the product as written, and with the forms and lines that are best by
estimate (`estimating.py`) under bounds on cycles from long to short. The Pareto-optimal estimates
are laid out, the most promising first. Then one join of the best factory is changed at a time,
those of the slowest robot first, as long as this improves it. All are judged by their layouts,
on rails also where a platen is asked for, whose bends change the cycle time little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import inf

from factory.api import Diagnostic, InputError, Plan, Project
from factory.apps.few_robots.aim import Aim, least_robots, usual_effort
from factory.apps.few_robots.bundles import Filling
from factory.apps.few_robots.candidate import Candidate
from factory.apps.few_robots.estimating import Estimate, Estimator
from factory.apps.few_robots.folding import kept_apart, lines_of
from factory.support.allowance import Allowance

CHANGES = 60
"""Number of changes in a row without improvement after which the search ends."""

SINGLE, SHARED = 0.3, 0.8
"""Shares of the effort after which factories with one robot for each label are no longer tried, and
after which estimates are no longer laid out."""

ESTIMATING = 0.5
"""The share of the time after which no further forms are estimated, so that some are laid out."""

Seen = Callable[[Candidate, Candidate], None]
"""Told of each candidate, and of the best so far."""


def allocated(
    project: Project,
    aim: Aim,
    seen: Seen = lambda *_: None,
    warn: Callable[[Diagnostic], None] = lambda _: None,
) -> Project:
    """The project with forms and lines chosen for an aim: as few robots as found for a cycle time,
    or the shortest cycle time found with so many robots; `project` itself where it asks for
    neither. Where nothing found is fast enough, with relays. Each candidate is `seen`; that the
    time ended the search (OutOfTime), or that the cycle time asked for was not found (SlowCycle),
    is a warning. Raises InputError (TooFewRobots) where more
    robots are needed, or none of the factories found has as few."""
    if not aim.asks:
        return project
    if isinstance(aim.robots, int):
        least = least_robots(project.pag, project.templates)
        if aim.robots < least.total:
            hint = f"--robots {least.total}"
            raise InputError(Diagnostic("TooFewRobots", str(least), None, hint))
    search = Search(project, aim)
    search.look(seen)
    best = search.best
    if search.cut_off:
        spent, effort = search.budget.spent, search.budget.effort
        message = f"the search stopped after {aim.seconds:g} s and {spent} of {effort:g} factories"
        hint = "give it more --seconds, or less --effort"
        warn(Diagnostic("OutOfTime", message, None, hint))
    if isinstance(aim.robots, int) and best.robots > aim.robots:
        message = f"no factory with {aim.robots} robots was found{search.estimated()}"
        hint = f"a longer search with more {'--seconds' if search.cut_off else '--effort'}"
        if not search.cut_off and best.has_layout:
            message += f", only with {best.robots}"
            hint = f"--robots {best.robots}, or {hint}"
        raise InputError(Diagnostic("TooFewRobots", message + search.why(), None, hint))
    if project.ground.tile is not None:
        best = replace(best, single=best.single.with_ground(project.ground))
    elif aim.robots is None and aim.cycle is not None and best.seconds > aim.cycle:
        plain = best if best.filling is None else search.written
        relayed = replace(plain, single=plain.single.with_ground(project.ground))
        best = min(best, relayed, key=search.rank)
    if aim.cycle is not None and best.has_layout and not best.pace.meets(aim.cycle):
        warn(best.pace.too_slow(aim.cycle, "a longer search with more --effort"))
    return best.project


class Search:
    """Looks for the best forms and lines for an aim; `best`: what was found."""

    def __init__(self, project: Project, aim: Aim, estimator: Estimator | None = None) -> None:
        self.aim, effort = aim, aim.effort or usual_effort(len(project.pag))
        self.budget = Allowance(effort, aim.seconds)
        self.forms = Allowance(effort, ESTIMATING * aim.seconds)
        bare = replace(project.ground, relay=False, cycle=None, tile=None)
        if project.ground.tile is not None:  # the floor is that of the bends, which are found last
            bare = replace(bare, floor=None)
        self.estimator = estimator or Estimator(project.with_ground(bare), aim.branches)
        self.written = self.best = self.estimator.written
        self.promising: Estimate | None = None

    @property
    def cut_off(self) -> bool:
        """Whether the time ended the search."""
        return self.budget.cut_off or self.forms.cut_off

    def rank(self, one: Candidate) -> tuple[float, ...]:
        """What a candidate is judged by, the less the better; one without a layout is the worst."""
        return self._ranked(one, one.seconds) if one.has_layout else (inf,)

    def _ranked(self, one: Candidate, seconds: float) -> tuple[float, ...]:
        """The rank of a candidate if its cycle takes so many `seconds`."""
        blocked, bare = one.blocked - self.written.blocked, one.bare - self.written.bare
        return max(0, blocked), *self.aim.rank(one.robots, seconds, max(0, bare))

    def look(self, seen: Seen = lambda *_: None) -> None:
        """For forms and lines, as long as there is effort and time left and something better may be
        found. Each candidate is `seen`."""
        with self.budget.limits():
            self._look(seen)

    def _look(self, seen: Seen) -> None:
        seen(self.written, self.best)
        for candidates in (self.singles(), self._shared()):
            for candidate in candidates:
                self._judge(candidate)
                seen(candidate, self.best)
        while self._better(self._changed(), seen):
            pass

    def estimated(self) -> str:
        """In words, which factory promised most before it was laid out; "" for none."""
        one = self.promising
        if one is None:
            return ""
        return f"; by estimate {one.robots} robots take {one.seconds:.2f} s, not laid out"

    def why(self) -> str:
        """What keeps two lines of the best apart, in words; "" where nothing is known to."""
        best = self.best.single
        words = next(kept_apart(best.approached, lines_of(best.planned.plan), best.catalogue), "")
        return f"; {words}" if words else ""

    def singles(self) -> Iterator[Candidate]:
        """The candidates by estimate with a robot for each label, each forms once, under bounds
        from long to short."""
        if self.estimator.is_free:
            yield from self.estimator.held("robots", self.budget, SINGLE)

    def _shared(self) -> Iterator[Candidate]:
        """The candidates by estimate with robots that serve several labels, the most promising
        first."""
        aim, most = self.aim, self.aim.robots
        robots = most if isinstance(most, int) else inf
        front = self.estimator.front(self.forms, robots)
        bare = replace(self.estimator, refused=set(), bare=True)
        for fewer in (robots, inf):
            self.forms.spent = 0
            front = front or bare.front(self.forms, fewer)
        front.sort(key=lambda one: aim.rank(one.robots, one.seconds, one.bare))
        self.promising = front[0] if front else None
        for one in front:
            if self.budget.over(SHARED):
                return
            yield self._candidate(one.forms, one.filling)

    def _candidate(self, forms: Mapping[str, int], filling: Filling | None = None) -> Candidate:
        self.budget.spend()
        return self.estimator.candidate(forms, filling)

    def _judge(self, one: Candidate) -> bool:
        """Whether it is better than the best so far; then it is the best. Only what can be is laid
        out, and only where its draft can be is it certified."""
        better = one.is_possible and (self._wins(one) or self._may_win(one))
        if better:
            self.best = one
        return better

    def _exceeds(self, one: Candidate) -> bool:
        """Whether it has more robots than are allowed."""
        return isinstance(self.aim.robots, int) and one.robots > self.aim.robots

    def _wins(self, one: Candidate) -> bool:
        """Whether it is better than the best whatever their cycle times, and has a layout or too
        many robots, so that none is needed."""
        surely = self._ranked(one, inf) < self._ranked(self.best, 0.0)
        return surely and (self._exceeds(one) or one.has_layout)

    def _may_win(self, one: Candidate) -> bool:
        """Whether it is better than the best by the layouts of both."""
        if self._exceeds(one) or self._exceeds(self.best):
            return False
        best = self.rank(self.best)
        return (
            self._ranked(one, 0.0) < best
            and self._ranked(one, one.least) < best
            and self.rank(one) < best
        )

    def _better(self, changed: Iterator[Candidate], seen: Seen) -> bool:
        """Whether one of the first changes is better than the best, which it is then."""
        for _ in range(CHANGES):
            one = None if self.budget.over() else next(changed, None)
            if one is None:
                return False
            better = self._judge(one)
            seen(one, self.best)
            if better:
                return True
        return False

    def _changed(self) -> Iterator[Candidate]:
        """The best with one form changed: those of joins of the slowest robot first; on lines that
        are filled for the same."""
        best = self.best
        first = [] if self._exceeds(best) or not best.has_layout else best.of_the_slowest()
        order = dict.fromkeys(label for label in (*first, *best.forms) if label in best.forms)
        for label in order:
            for form in (Plan.THIRD, 0, 1):
                if form != best.forms[label]:
                    yield self._candidate({**best.forms, label: form}, best.filling)
