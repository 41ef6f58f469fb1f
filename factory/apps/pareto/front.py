"""The Pareto front in robots, cycle time and floor area: its points, their dominance, trials of
them (runs in both worlds, to measure the error of a predicted cycle time), and the files that
reproduce them."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any, Literal

from factory.api import Observer, Project, Run, RunRequest, Simulation, Timing, write_pag
from factory.apps.analyze.timed import steady_units
from factory.apps.drawing.tables import Tabular, titled
from factory.apps.few_robots.aim import Least
from factory.apps.few_robots.candidate import Candidate
from factory.apps.few_robots.estimating import Estimate
from factory.apps.importing.mesh_files import MeshStore
from factory.apps.log.plan_file import PLAN_NAME, plan_files
from factory.apps.runs.options import fusing_pays
from factory.apps.runs.watched import watched

MESHES = "meshes"
"""A folder that all points share."""


def point_name(number: int) -> str:
    """The folder of a point of a front, counted from 0."""
    return f"p{number + 1:02d}"


def command_of(file: Path) -> str:
    """The command that builds and runs a point whose plan is in a file."""
    return shlex.join(["factory", "run", str(file)])


def commands_of(front: ParetoFront, folder: Path) -> list[str]:
    """The commands of all points, in their order."""
    return [
        command_of(folder / point_name(number) / PLAN_NAME) for number in range(len(front.points))
    ]


def point_files(front: ParetoFront, folder: Path) -> dict[Path, bytes]:
    """The files of all points in a folder. Meshes are copied into the folder, whatever their paths
    in the input. Raises OSError where a mesh no longer exists."""
    store, files = MeshStore(MESHES), dict[Path, bytes]()
    for number, point in enumerate(front.points):
        pag, laid = point.project.pag, point.predicted is not None
        nodes = tuple(store.keep(node, pag.folder, "../") for node in pag.nodes)
        text = write_pag(replace(pag, nodes=nodes))
        files |= plan_files(point.project, folder / point_name(number), text, laid)
    return files | {folder / path: content for path, content in store.files.items()}


Ended = Literal["complete", "effort", "seconds", "stopped"]
"""Whether all that is promising was laid out, or what ended the search before."""

ENDINGS: dict[Ended, str] = {
    "complete": "",
    "effort": "the search used up its effort after {}; a greater --effort may find more",
    "seconds": "the search ran out of time after {}; more --seconds may find more",
    "stopped": "the search was stopped by hand after {}",
}

SEED, JITTER = 0, 0.3
"""Seed and jitter of the robots' speeds and gains."""

MOST = 24
"""Upper bound on the products of a trial, but for those of two periods of the net."""

CLOSE = 0.02
"""Relative error up to which a prediction holds."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Runs of `units` products in both worlds: the cycle time `predicted` for the speeds that were
    drawn, `measured` in MuJoCo, and in the `ideal` world [s]; the `failures` of their verdicts."""

    units: int
    predicted: float
    measured: float | None
    ideal: float | None
    failures: tuple[str, ...] = ()

    @property
    def error(self) -> float | None:
        """The relative error of the prediction; None where the run did not finish."""
        return self.predicted / self.measured - 1 if self.measured else None

    @property
    def holds(self) -> bool:
        """Whether both runs succeeded, and the prediction is CLOSE."""
        return not self.failures and self.error is not None and abs(self.error) <= CLOSE

    def as_json(self) -> dict[str, Any]:
        """The trial as `pareto --json` lists it."""
        return {
            "units": self.units,
            "seed": SEED,
            "jitter": JITTER,
            "predicted_cycle_time_s": self.predicted,
            "cycle_time_s": self.measured,
            "ideal_cycle_time_s": self.ideal,
            "error": self.error,
            "failures": list(self.failures),
        }


def tried(project: Project, glances: Sequence[Observer] = ()) -> Trial:
    """The trial of a project's factory: as many units as are needed to reach the pace of its net,
    at most MOST, or two periods."""
    layout, settings = project.layout, project.settings
    most = max(MOST, Run.steady_from(layout.factory.period))
    units = min(most, steady_units(Timing(layout, settings, "mujoco", SEED, JITTER)))
    fuse = fusing_pays(layout.factory, layout.product)
    asked = RunRequest("mujoco", units, SEED, JITTER, settings, fuse=fuse, shown=False)
    asked = replace(asked, catalogue=project.catalogue)
    run = watched(Simulation(layout, asked), (), None, glances)
    ideal = Simulation(layout, replace(asked, world="ideal", fuse=False)).run((), None, glances)
    failures = [
        f"{each.world}: {failure.code}: {failure.message}"
        for each in (run, ideal)
        for failure in each.verdict.failures
    ]
    predicted = run.predicted_cycle_time_s or 0.0
    return Trial(units, predicted, run.cycle_time_s, ideal.cycle_time_s, tuple(failures))


@dataclass(frozen=True, slots=True)
class FrontPoint:
    """A factory for a product: the number of its `robots`, and of `tools` and `relays` among them;
    its cycle time `estimated` from sizes and `predicted` for its layout [s]; the floor `area` of
    the layout [m²]; the time that its robots spend in operations in a cycle, `work` [robot s].
    Figures of a layout are None without one. `trial`: the results of its runs, if it was run."""

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
        """The point of a candidate, by its layout. Raises FactoryError where there is none."""
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
        """The point of an estimate, without a layout."""
        robots = one.project.plain.robots
        tools = sum(robot.type == "tool" for robot in robots)
        return cls(one.project, len(robots), tools, estimate.seconds)

    def __str__(self) -> str:
        area = "" if self.area is None else f", {self.area:.2f} m²"
        return f"{self.robots} robots, {self.seconds:.2f} s{area}"

    @property
    def seconds(self) -> float:
        """The cycle time that counts [s]: predicted where it has a layout, else estimated."""
        seconds = self.estimated if self.predicted is None else self.predicted
        return inf if seconds is None else seconds

    @property
    def lines(self) -> tuple[tuple[str, ...], ...]:
        """The labels that share a robot, line by line."""
        factory = self.project.plain
        served = (factory.deliveries(robot.index) for robot in factory.robots)
        return tuple(labels for labels in served if len(labels) > 1)

    @property
    def certified(self) -> bool:
        """Whether its layout has a valid clearance certificate."""
        if self.predicted is None:
            return False
        certificate = self.project.layout.certificate
        return certificate is not None and certificate.holds

    @property
    def bound(self) -> float | None:
        """Lower bound on the cycle time with so many robots and its operations [s]; None without a
        layout."""
        return None if self.work is None else self.work / self.robots

    @property
    def figures(self) -> tuple[float, ...]:
        """The objectives, the less the better: robots, cycle time to 10 ms, floor to 1 dm², as they
        are printed."""
        area = () if self.area is None else (round(self.area, 2),)
        return self.robots, round(self.seconds, 2), *area

    def beats(self, other: FrontPoint) -> bool:
        """Whether it is at least as good as another point in all objectives."""
        return all(a <= b for a, b in zip(self.figures, other.figures, strict=True))

    def as_json(self) -> dict[str, Any]:
        """The point as `pareto --json` lists it."""
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
    """The Pareto-optimal points, fewest robots first; of equal ones the first."""
    front: list[FrontPoint] = []
    for point in points:
        if not any(other.beats(point) for other in front):
            front = [other for other in front if not point.beats(other)] + [point]
    return sorted(front, key=lambda point: point.figures)


@dataclass(frozen=True)
class ParetoFront(Tabular):
    """The Pareto front found for a product: `points` in the order of their robots; the `least`
    number of robots that can make it; the numbers of factories `estimated` and `laid_out`; the
    product as `written` as a point, None where it has no layout; how the sweep `ended`."""

    name: str
    points: tuple[FrontPoint, ...]
    least: Least
    written: FrontPoint | None = None
    estimated: int = 0
    laid_out: int = 0
    ended: Ended = "complete"

    def __repr__(self) -> str:
        ends = " to ".join(str(point) for point in (self.points[0], self.points[-1]))
        return f"<ParetoFront of {self.name}: {len(self.points)} points, {ends}>"

    def _repr_html_(self) -> str:
        rows = (
            (p.robots, p.tools, p.seconds, p.area, p.trial.measured if p.trial else None)
            for p in self.points
        )
        columns = ("robots", "tools", "cycle [s]", "floor [m²]", "measured, with jitter [s]")
        return titled(repr(self), columns, rows)

    def records(self) -> list[dict[str, object]]:
        """A row for each point, with the figures of `pareto --json`."""
        rows = (point.as_json().items() for point in self.points)
        return [{k: v for k, v in row if not isinstance(v, list | dict)} for row in rows]

    @property
    def ending(self) -> str:
        """Why the sweep ended before all that is promising was laid out, in words; "" where it did
        not."""
        made = f"{self.laid_out} layouts" if self.laid_out else f"{self.estimated} estimates"
        return ENDINGS[self.ended].format(made)

    @property
    def work(self) -> float | None:
        """The least `work` of a point [robot s]: divided by a number of robots, a lower bound on
        their cycle time. None without layouts."""
        works = [point.work for point in self.points if point.work is not None]
        return min(works, default=None)

    @property
    def trials(self) -> list[Trial]:
        """The trials, point by point."""
        return [point.trial for point in self.points if point.trial is not None]

    @property
    def unproved(self) -> str:
        """How many points were not run, in words; "" where all were."""
        count = len(self.points)
        left = count - len(self.trials)
        if not left:
            return ""
        words = "was not run: its cycle time is a prediction"
        if left > 1:
            words = "were not run: their cycle times are predictions"
        return f"{left} of {count} points {words} (--validate {count} runs all)"

    def with_trial(self, number: int, trial: Trial) -> ParetoFront:
        """The same with the trial of a point."""
        points = [*self.points]
        points[number] = replace(points[number], trial=trial)
        return replace(self, points=tuple(points))

    def spread(self, count: int) -> list[int]:
        """The numbers of `count` points, spread evenly from the first to the last."""
        last = len(self.points) - 1
        if count > last:
            return list(range(last + 1))
        steps = max(count - 1, 1)
        return sorted({round(last * n / steps) for n in range(count)})

    def as_json(self) -> dict[str, Any]:
        """The document of `pareto --json`, without the names of its files."""
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
            "complete": self.ended == "complete",
            "ended": self.ended,
        }


def candidates_front(estimates: Sequence[Estimate]) -> list[tuple[float, Estimate]]:
    """Estimates with their cycle time over that of the best with no more robots; those of the
    front, with a ratio of 1, come first."""
    best: dict[int, float] = {}
    for one in sorted(estimates, key=lambda e: e.robots):
        before = min(best.values(), default=inf)
        best[one.robots] = min(before, best.get(one.robots, inf), one.seconds)
    ranked = [(one.seconds / best[one.robots], one) for one in estimates]
    return sorted(ranked, key=lambda pair: (round(pair[0], 3), pair[1].robots, pair[1].seconds))
