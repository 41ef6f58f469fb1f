"""Choose which robot does what, for few robots and a cycle time: the forms of operations, and the
lines of robots.

The search begins with the product as it is written, and with forms and lines that are best by
estimate (`forms.py`, `lines.py`) under bounds of cycles from long to short. Those of them that no
other is as good as are laid out, the most promising first. Then the best is changed, one join at a
time, those of the slowest robot first, as long as that makes it better. All are judged by their
layouts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from time import monotonic
from typing import Literal

from factory.compiler.mating.mating import judged
from factory.compiler.mating.admitting import admitted
from factory.layout.durations import Pace
from factory.layout.shapes import payload_boxes
from factory.modes.modes import operation_modes, robot_limits
from factory.modes.staging import stages_of
from factory.pipeline import Project
from factory.problem.shapes import is_shaped
from factory.study.allocation.blame import blamed, joins_of
from factory.study.allocation.forms import (
    THIRD,
    FormsTask,
    Order,
    best_forms,
    forms_task,
    reformed,
    written_forms,
)
from factory.study.allocation.least import least_robots
from factory.study.allocation.lines import Shift, labels_on
from factory.support.errors import Diagnostic, FactoryError, InputError
from factory.support.settings import LEAST
from factory.timing.cycle_time import CycleTime
from factory.timing.prediction import all_ways, operation_delays, predict

STEP = 1.15
"""The bounds on estimated cycles that are tried: each is the one before divided by this."""

WIDE = 1.6
"""The same for LARGE products, and for what lines are filled for."""

LARGE = 400
"""So many labels make a product large."""

FILLED = 1.12
"""What lines are filled for is each time so much more."""

ROUNDS = 8
"""So often forms are chosen anew where no hand can hold what they ask for."""

CHANGES = 60
"""So many changes are tried in a row, none of which is better, before the search ends."""

LOOKED_AT = 40
"""So many of the most promising estimates are laid out."""

SECONDS = 60.0
"""How long is looked for few robots, where nothing else is said [s]."""


@dataclass(frozen=True, slots=True)
class Aim:
    """How many `robots` there are, LEAST for as few as found, None for as many as it takes; the
    `cycle` time to be reached [s], None for the shortest; how many `seconds` may be spent on the
    choice."""

    robots: int | Literal["least"] | None = None
    cycle: float | None = None
    seconds: float = SECONDS

    @property
    def asks(self) -> bool:
        """Whether it asks for anything."""
        return self.robots is not None or self.cycle is not None

    def rank(self, robots: int, seconds: float, troubles: int = 0) -> tuple[float, ...]:
        """What a factory is judged by, the less the better: how many of its operations are worse
        than as they are written, its robots, its cycle time [s]."""
        seconds = round(seconds, 3)
        if self.robots == LEAST:
            return troubles, robots, seconds
        more = max(0, robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return troubles, more, seconds, robots
        return troubles, more, max(0.0, seconds - self.cycle), robots, seconds

    def wants(self, robots: int, seconds: float) -> bool:
        """Whether estimates may be those of what is wanted."""
        if isinstance(self.robots, int) and robots > self.robots:
            return False
        return self.cycle is None or seconds < self.cycle * STEP


@dataclass(frozen=True)
class Candidate:
    """A product with `forms` chosen, by the joins of the product as it is written, and with lines
    that are filled for a `target` [s], None for a robot for each label, as a `project`."""

    project: Project
    forms: Mapping[str, int]
    target: float | None = None

    @property
    def robots(self) -> int:
        """How many robots its factory has, tools included."""
        return len(self.project.factory.robots)

    @property
    def seconds(self) -> float:
        """The cycle time that is predicted for its layout [s]."""
        return self.pace.seconds

    @cached_property
    def pace(self) -> CycleTime:
        """The same, and what allows no less."""
        layout, settings = self.project.layout, self.project.settings
        modes, (limits, _) = operation_modes(layout, settings.eps), robot_limits(layout, settings)
        stages = stages_of(layout, modes, settings)
        delays = operation_delays(layout, modes, limits, settings, "mujoco", stages)
        ways = all_ways(layout, stages, delays, limits, settings, "mujoco")
        return predict(layout, delays, settings, "mujoco", None, ways)

    @cached_property
    def troubles(self) -> int:
        """How many of its operations are blocked, or have what no hand of a robot for one label can
        hold."""
        found = self.project.matings
        blocked = len(found.of_kind("blocked")) if found else 0
        return blocked + sum(not grip.shared for grip in self.project.no_grips)


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is estimated of forms and lines: `robots`, cycle time [s], how many operations are
    `blocked`; the `forms`, and what the lines are filled for, `target` [s]."""

    robots: int
    seconds: float
    blocked: int
    forms: Mapping[str, int]
    target: float


def allocated(project: Project, aim: Aim) -> Project:
    """The project with forms and lines chosen for an aim: as few robots as found for a cycle time,
    or the shortest cycle time found with so many robots; `project` itself where it asks for
    neither. Where nothing found is fast enough, with relays. Raises InputError (TooFewRobots) where
    more robots are needed, or none of the factories found has as few."""
    if not aim.asks:
        return project
    if isinstance(aim.robots, int):
        least = least_robots(project.pag, project.templates)
        if aim.robots < least.total:
            message = f"{aim.robots} robots are too few: {least}"
            raise InputError(Diagnostic("TooFewRobots", message, None, f"--robots {least.total}"))
    search = Search(project, aim)
    search.look()
    best = search.best
    if isinstance(aim.robots, int) and best.robots > aim.robots:
        message = f"{aim.robots} robots are too few: found with {best.robots}"
        hint = f"--robots {best.robots}; with more --seconds fewer may be found"
        raise InputError(Diagnostic("TooFewRobots", message, None, hint))
    if aim.robots is None and aim.cycle is not None and best.seconds > aim.cycle:
        plain = best if best.target is None else search.written
        ground = replace(project.ground, formed=plain.project.ground.formed)
        relayed = replace(plain, project=plain.project.with_pag(plain.project.pag, ground))
        best = min(best, relayed, key=search.rank)
    return best.project


class Search:
    """Looks for the best forms and lines for an aim; `best`: what was found; `estimates`: those of
    which no other is as good in everything."""

    def __init__(self, project: Project, aim: Aim) -> None:
        bare = replace(project.ground, relay=False, cycle=None)
        self.aim, self.begun = aim, monotonic()
        self.project = project.with_pag(project.pag, bare)
        self.written = self.best = Candidate(self.project, written_forms(self.task))
        self.estimates: list[Estimate] = []

    def late(self, share: float = 1.0) -> bool:
        """Whether a share of the time is over."""
        return monotonic() - self.begun > share * self.aim.seconds

    def rank(self, one: Candidate) -> tuple[float, ...]:
        """What a candidate is judged by, the less the better."""
        troubles = max(0, one.troubles - self.written.troubles)
        return self.aim.rank(one.robots, one.seconds, troubles)

    def look(self, seen: Callable[[Candidate], None] = lambda _: None) -> None:
        """For forms and lines, as long as there is time and something better may be found. Each
        candidate is `seen`."""
        seen(self.written)
        for one in (*self._singles(), *self._shared()):
            seen(one)
            self._judge(one)
        while self._better(self._changed(), seen):
            pass

    def _singles(self) -> Iterator[Candidate]:
        """The candidates by estimate with a robot for each label, each forms once, under bounds
        from long to short. Forms that leave a robot without a hand are refused from then on."""
        task, before = self.task, dict[str, int]()
        for bound in self._bounds(task) if task.free else ():
            for _ in range(ROUNDS):
                forms, _ = best_forms(task, bound)
                if forms == before or self.late(0.3):
                    break
                one, before = self._candidate(forms), forms
                refused = task.refused | frozenset(blamed(task, one.project, forms))
                if one.troubles <= self.written.troubles or refused == task.refused:
                    yield one
                    break
                task = replace(task, refused=refused)

    def _shared(self) -> Iterator[Candidate]:
        """The candidates by estimate with robots that serve several labels, the most promising
        first."""
        self.estimate()
        promising = sorted(self.estimates, key=lambda e: self.aim.rank(e.robots, e.seconds))
        for one in promising[:LOOKED_AT]:
            if self.late(0.8):
                return
            found = self._candidate(one.forms, one.target)
            if found is not None:
                yield found

    def estimate(self) -> None:
        """Fills the `estimates`."""
        most = self._blocked(self.written.project)
        tried = set[tuple[int, ...]]()
        for task in self._tasks():
            for bound in self._bounds(task):
                if self.late(0.5):
                    return
                forms, _ = best_forms(task, bound)
                key = tuple(forms.values())
                if key in tried:
                    continue
                tried.add(key)
                project = self._reformed(forms)
                blocked = self._blocked(project)
                if blocked <= most:
                    self._add(project, forms, blocked)

    def _tasks(self) -> Iterator[FormsTask]:
        orders: tuple[Order, ...] = ("lines", "fewest", "robots")
        for order in orders if self.task.free else orders[:1]:
            yield replace(self.task, order=order)

    def _add(self, project: Project, forms: Mapping[str, int], blocked: int) -> None:
        """The estimates of forms with lines for all that they may be filled for."""
        shift, before = self._shift(project), -1
        for target in shift.targets(FILLED if len(self.task.nodes) < LARGE else WIDE):
            lines = shift.lines(target)
            robots = shift.count(lines)
            few = not isinstance(self.aim.robots, int) or robots <= self.aim.robots
            if robots == before or not few or not lines:
                continue
            before = robots
            seconds = shift.seconds(lines)
            if not any(e.robots <= robots and e.seconds <= seconds for e in self.estimates):
                one = Estimate(robots, seconds, blocked, forms, target)
                worse = [
                    e for e in self.estimates if e.robots >= robots and e.seconds >= seconds
                ]
                self.estimates = [e for e in self.estimates if e not in worse] + [one]

    def _shift(self, project: Project) -> Shift:
        factory = judged(project.compiled, project.product)
        boxes = payload_boxes(factory, project.product)
        return Shift.of(factory, project.catalogue, boxes, self.task.pace)

    @staticmethod
    def _blocked(project: Project) -> int:
        return len(project.matings.of_kind("blocked")) if project.matings else 0

    @cached_property
    def task(self) -> FormsTask:
        """What forms are estimated by."""
        project = self.project
        pag, templates, product = project.pag, project.templates, project.product
        admits = admitted(pag, templates, product) if is_shaped(pag) else {}
        boxes = payload_boxes(project.compiled, product)
        return forms_task(pag, templates, admits, boxes, Pace.of(project.settings))

    def _bounds(self, task: FormsTask) -> Iterator[float]:
        """No bound on estimated cycles, and those that can be kept, the longest first."""
        yield inf
        bound = sum(task.pace.rest(task.size(label)) + task.pace.lost for label in task.nodes)
        step = STEP if len(task.nodes) < LARGE else WIDE
        while best_forms(task, bound)[1] == 0.0:
            yield bound
            bound /= step

    def _reformed(self, forms: Mapping[str, int]) -> Project:
        """The product with these forms, a robot for each label."""
        ground = replace(self.project.ground, formed=forms != self.written.forms, lines=())
        if not ground.formed:
            return self.project.with_pag(self.project.pag, ground)
        pag = reformed(self.project.pag, self.project.templates, forms)
        return self.project.with_pag(pag, ground)

    def _candidate(self, forms: Mapping[str, int], target: float | None = None) -> Candidate:
        """The product with these forms, and with lines that are filled for a target if one is
        given."""
        project = self._reformed(forms)
        if target is not None:
            shift = self._shift(project)
            lines = labels_on(shift.factory, shift.lines(target))
            project = project.with_pag(project.pag, replace(project.ground, lines=lines))
        return Candidate(project, forms, target)

    def _judge(self, one: Candidate) -> bool:
        """Whether it is better than the best so far; then it is the best."""
        try:
            better = self.rank(one) < self.rank(self.best)
        except FactoryError:  # there is no layout of it
            return False
        if better:
            self.best = one
        return better

    def _better(self, changed: Iterator[Candidate], seen: Callable[[Candidate], None]) -> bool:
        """Whether one of the first changes is better than the best, which it is then."""
        for _ in range(CHANGES):
            one = next(changed, None)
            if one is None or self.late():
                return False
            seen(one)
            if self._judge(one):
                return True
        return False

    def _changed(self) -> Iterator[Candidate]:
        """The best with one form changed: those of joins of the slowest robot first; on lines that
        are filled for the same."""
        best, factory = self.best, self.best.project.plain
        known = joins_of(self.task, best.project)
        slow = [r for r in factory.robots if r.name == best.pace.bottleneck]
        first = [known.get(factory.operations[n].label, "") for r in slow for n in r.operations]
        order = dict.fromkeys(label for label in (*first, *best.forms) if label in best.forms)
        for label in order:
            for form in (THIRD, 0, 1):
                if form != best.forms[label]:
                    yield self._candidate({**best.forms, label: form}, best.target)
