"""Points of which no other is as good in everything: robots, cycle time, floor."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

from factory.pipeline import Project
from factory.study.allocation.candidate import Candidate
from factory.study.allocation.estimating import Estimate
from factory.study.allocation.least import Least
from factory.study.pareto.trial import Trial
from factory.support.errors import FactoryError


@dataclass(frozen=True, slots=True)
class FrontPoint:
    """A factory for a product: its `robots`, of which so many are `tools` and `relays`; its cycle
    time as it is `estimated` from sizes and as it is `predicted` for its layout [s]; the floor that
    takes, `area` [m²], and what its robots spend in operations in a cycle, `work` [robot s]. What
    comes from a layout is None without one. `trial`: what runs of it gave, if there were any."""

    project: Project = field(repr=False)
    robots: int
    tools: int
    estimated: float | None = None
    predicted: float | None = None
    area: float | None = None
    work: float | None = None
    relays: int = 0
    trial: Trial | None = None

    @classmethod
    def laid_out(cls, one: Candidate, estimated: float | None = None) -> FrontPoint:
        """That of a candidate by its layout. Raises FactoryError where there is none."""
        layout = one.project.layout
        robots = layout.factory.robots
        return cls(
            one.project,
            len(robots),
            sum(robot.type == "tool" for robot in robots),
            estimated,
            one.seconds,
            layout.area,
            one.work,
            len(robots) - len(one.project.plain.robots),
        )

    @classmethod
    def of_estimate(cls, one: Candidate, estimate: Estimate) -> FrontPoint:
        """That of an estimate, without a layout."""
        robots = one.project.plain.robots
        tools = sum(robot.type == "tool" for robot in robots)
        return cls(one.project, len(robots), tools, estimate.seconds)

    def __str__(self) -> str:
        area = "" if self.area is None else f", {self.area:.2f} m²"
        return f"{self.robots} robots, {self.seconds:.2f} s{area}"

    @property
    def seconds(self) -> float:
        """The cycle time it is judged by [s]: predicted where it has a layout, else estimated."""
        found = self.estimated if self.predicted is None else self.predicted
        return inf if found is None else found

    @property
    def lines(self) -> tuple[tuple[str, ...], ...]:
        """The labels that share a robot, line by line."""
        factory = self.project.plain
        served = (factory.deliveries(robot.index) for robot in factory.robots)
        return tuple(labels for labels in served if len(labels) > 1)

    @property
    def certified(self) -> bool:
        """Whether it has a layout with a clearance certificate that holds."""
        if self.predicted is None:
            return False
        certificate = self.project.layout.certificate
        return certificate is not None and certificate.holds

    @property
    def bound(self) -> float | None:
        """The least cycle time that so many robots allow for its operations [s]; None without a
        layout."""
        return None if self.work is None else self.work / self.robots

    @property
    def figures(self) -> tuple[float, ...]:
        """What it is judged by, the less the better: robots, cycle time to 10 ms, floor to 1 dm²,
        as they are printed."""
        area = () if self.area is None else (round(self.area, 2),)
        return self.robots, round(self.seconds, 2), *area

    def beats(self, other: FrontPoint) -> bool:
        """Whether it is as good as another in everything."""
        return all(a <= b for a, b in zip(self.figures, other.figures, strict=True))

    def as_json(self) -> dict[str, Any]:
        """It as `pareto --json` lists it."""
        trial = self.trial
        return {
            "robots": self.robots,
            "tools": self.tools,
            "cycle_time_s": trial and trial.measured,
            "predicted_cycle_time_s": self.predicted,
            "estimated_cycle_time_s": self.estimated,
            "area_m2": self.area,
            "lines": [list(line) for line in self.lines],
            "relays": self.relays,
            "parallel": {},
            "bound_s": self.bound,
            "certified": self.certified,
            "validated": trial is not None and trial.holds,
            "validation": trial and trial.as_json(),
        }


def undominated(points: Iterable[FrontPoint]) -> list[FrontPoint]:
    """Those that no other is as good as in everything, fewest robots first; of equal ones the
    first."""
    found: list[FrontPoint] = []
    for point in points:
        if not any(other.beats(point) for other in found):
            found = [other for other in found if not point.beats(other)] + [point]
    return sorted(found, key=lambda point: point.figures)


@dataclass(frozen=True)
class ParetoFront:
    """The front that was found of a product: `points` by their robots; the `least` number of robots
    that can make it; how many factories were `estimated` and `laid_out`; the `written` product as a
    point, None where it has no layout; whether all was looked at that was to be (`complete`)."""

    name: str
    points: tuple[FrontPoint, ...]
    least: Least
    written: FrontPoint | None = None
    estimated: int = 0
    laid_out: int = 0
    complete: bool = True

    @property
    def work(self) -> float | None:
        """The least that the robots of a point spend in operations in a cycle [robot s]: over a
        number of robots it is a bound of their cycle time. None without layouts."""
        known = [point.work for point in self.points if point.work is not None]
        return min(known, default=None)

    @property
    def trials(self) -> list[Trial]:
        """What runs gave, point by point."""
        return [point.trial for point in self.points if point.trial is not None]

    @property
    def unproved(self) -> str:
        """That points were not run, in words; nothing where all were."""
        count = len(self.points)
        if not (left := count - len(self.trials)):
            return ""
        what = (
            "its cycle time is a prediction" if left == 1 else "their cycle times are predictions"
        )
        run = "was" if left == 1 else "were"
        return f"{left} of {count} points {run} not run: {what} (--validate {count} runs all)"

    def with_trial(self, number: int, trial: Trial) -> ParetoFront:
        """The same with the trial of a point."""
        points = [*self.points]
        points[number] = replace(points[number], trial=trial)
        return replace(self, points=tuple(points))

    def spread(self, count: int) -> list[int]:
        """The numbers of so many points, spread from the first to the last."""
        last = len(self.points) - 1
        if count > last:
            return list(range(last + 1))
        steps = max(count - 1, 1)
        return sorted({round(last * n / steps) for n in range(count)})

    def as_json(self) -> dict[str, Any]:
        """The document of `pareto --json`, without what its files are called."""
        least = {"robots": self.least.robots, "tools": self.least.tools, "total": self.least.total}
        return {
            "product": self.name,
            "points": [point.as_json() for point in self.points],
            "written": self.written and self.written.as_json(),
            "least_robots": least["total"],
            "least": least,
            "bound": self.work,
            "estimated": self.estimated,
            "laid_out": self.laid_out,
            "complete": self.complete,
        }


def candidates_front(found: Sequence[Estimate]) -> list[tuple[float, Estimate]]:
    """Estimates with how many times the cycle time they have of the best with no more robots, those
    of the front, with 1, first."""
    best: dict[int, float] = {}
    for one in sorted(found, key=lambda e: e.robots):
        before = min(best.values(), default=inf)
        best[one.robots] = min(before, best.get(one.robots, inf), one.seconds)
    ranked = [(one.seconds / best[one.robots], one) for one in found]
    return sorted(ranked, key=lambda pair: (round(pair[0], 3), pair[1].robots, pair[1].seconds))


def point_of(one: Candidate, estimated: float | None = None) -> FrontPoint | None:
    """The point of a candidate; None where it has no layout."""
    try:
        return FrontPoint.laid_out(one, estimated)
    except FactoryError:
        return None
