"""Choose the forms of a product's operations, for few robots and a cycle time.

The search begins with the product as it is written, and with the forms that are best by estimate
(`forms.py`) under bounds of cycles from long to short. The best of these is changed, one join at a
time, those of the slowest robot first, as long as that makes it better. All are judged by their
layouts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from time import monotonic
from typing import Literal

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
    best_forms,
    forms_task,
    reformed,
    written_forms,
)
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import LEAST
from factory.timing.cycle_time import CycleTime
from factory.timing.prediction import all_ways, operation_delays, predict

STEP = 1.15
"""The bounds on estimated cycles that are tried: each is the one before divided by this."""

LONGEST = 1e4
"""The greatest of them [s]."""

ROUNDS = 8
"""So often forms are chosen anew where no hand can hold what they ask for."""

CHANGES = 60
"""So many changes are tried in a row, none of which is better, before the search ends."""

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

    def rank(self, one: Candidate) -> tuple[float, ...]:
        """What a candidate is judged by, the less the better."""
        seconds = round(one.seconds, 3)
        if self.robots == LEAST:
            return one.troubles, one.robots, seconds
        more = max(0, one.robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return one.troubles, more, seconds, one.robots
        return one.troubles, more, max(0.0, seconds - self.cycle), one.robots, seconds


@dataclass(frozen=True)
class Candidate:
    """A product with `forms` chosen, by the joins of the product as it is written, as a
    `project`."""

    project: Project
    forms: Mapping[str, int]

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
        """How many of its operations are blocked, or have what no hand can hold."""
        found = self.project.matings
        blocked = len(found.of_kind("blocked")) if found else 0
        return blocked + len(self.project.no_grips)


def allocated(project: Project, aim: Aim) -> Project:
    """The project with forms chosen for an aim: as few robots as found for a cycle time, or the
    shortest cycle time found with so many robots; `project` itself where it asks for neither. Where
    no forms are fast enough, with relays. Raises InputError (TooFewRobots) where forms alone need
    more robots."""
    if not aim.asks:
        return project
    search = Search(project, aim)
    search.look()
    best = search.best
    if isinstance(aim.robots, int) and best.robots > aim.robots:
        message = f"{aim.robots} robots are too few: found with {best.robots}"
        hint = f"--robots {best.robots}"
        raise InputError(Diagnostic("TooFewRobots", message, None, hint))
    if aim.robots is None and aim.cycle is not None and best.seconds > aim.cycle:
        ground = replace(project.ground, formed=best.project.ground.formed)
        relayed = replace(best, project=best.project.with_pag(best.project.pag, ground))
        best = min(best, relayed, key=aim.rank)
    return best.project


class Search:
    """Looks for the best forms for an aim; `best`: what was found."""

    def __init__(self, project: Project, aim: Aim) -> None:
        bare = replace(project.ground, relay=False, cycle=None)
        self.aim, self.end = aim, monotonic() + aim.seconds
        self.project = project.with_pag(project.pag, bare)
        self.written = self.best = Candidate(self.project, written_forms(self.task))

    def look(self, seen: Callable[[Candidate], None] = lambda _: None) -> None:
        """For forms, as long as there is time and something better may be found. Each candidate
        is `seen`."""
        seen(self.written)
        for one in self.estimated():
            seen(one)
            self._judge(one)
        while self._better(self._changed(), seen):
            pass

    def estimated(self) -> Iterator[Candidate]:
        """The candidates by estimate, each forms once, under bounds from long to short. Forms that
        leave a robot without a hand are refused from then on."""
        task, before = self.task, dict[str, int]()
        for bound in _bounds(task) if task.free else ():
            for _ in range(ROUNDS):
                forms, _ = best_forms(task, bound)
                if forms == before or monotonic() > self.end:
                    break
                one, before = self._candidate(forms), forms
                refused = task.refused | frozenset(blamed(task, one.project, forms))
                if one.troubles <= self.written.troubles or refused == task.refused:
                    yield one
                    break
                task = replace(task, refused=refused)

    @cached_property
    def task(self) -> FormsTask:
        """What forms are estimated by."""
        project = self.project
        pag, templates, product = project.pag, project.templates, project.product
        admits = admitted(pag, templates, product) if is_shaped(pag) else {}
        boxes = payload_boxes(project.plain, product)
        return forms_task(pag, templates, admits, boxes, Pace.of(project.settings))

    def _candidate(self, forms: Mapping[str, int]) -> Candidate:
        pag = reformed(self.project.pag, self.project.templates, forms)
        ground = replace(self.project.ground, formed=True)
        return Candidate(self.project.with_pag(pag, ground), forms)

    def _judge(self, one: Candidate) -> bool:
        """Whether it is better than the best so far; then it is the best."""
        better = self.aim.rank(one) < self.aim.rank(self.best)
        if better:
            self.best = one
        return better

    def _better(self, changed: Iterator[Candidate], seen: Callable[[Candidate], None]) -> bool:
        """Whether one of the first changes is better than the best, which it is then."""
        for _ in range(CHANGES):
            one = next(changed, None)
            if one is None or monotonic() > self.end:
                return False
            seen(one)
            if self._judge(one):
                return True
        return False

    def _changed(self) -> Iterator[Candidate]:
        """The best with one form changed: those of joins of the slowest robot first."""
        best, factory = self.best, self.best.project.plain
        known = joins_of(self.task, best.project)
        slow = [r for r in factory.robots if r.name == best.pace.bottleneck]
        first = [known.get(factory.operations[n].label, "") for r in slow for n in r.operations]
        order = dict.fromkeys(label for label in (*first, *best.forms) if label in best.forms)
        for label in order:
            for form in (THIRD, 0, 1):
                if form != best.forms[label]:
                    yield self._candidate({**best.forms, label: form})


def _bounds(task: FormsTask) -> Iterator[float]:
    """The bounds on estimated cycles that can be kept, the longest first."""
    bound = LONGEST
    while best_forms(task, bound)[1] == 0.0:
        yield bound
        bound /= STEP
