"""The options that several commands share, as values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from factory.apps.runs.options import check_together
from factory.support.bounds import pair
from factory.support.errors import Diagnostic, InputError, did_you_mean, usage_error

if TYPE_CHECKING:
    from factory.apps.few_robots.candidate import Candidate
    from factory.apps.log.plan_file import PlanFile
    from factory.film import Picture
    from factory.film.picture import RendererName
    from factory.floor.layout.request import Ground
    from factory.pipeline import Project
    from factory.support.settings import Settings
    from factory.theory.problem.pag import PAG, AllowedOverlap


@dataclass(frozen=True, slots=True)
class OutputOptions:
    """The kind of output: one JSON document, or text; `quiet`: neither progress nor warnings."""

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    @property
    def silent(self) -> bool:
        """Whether no progress is shown."""
        return self.quiet or self.as_json


@dataclass(frozen=True, slots=True)
class ProjectOptions:
    """A PAG's file, folders of additional operations, and the options of SOURCE, FLOOR, RELAY and
    MOTION that a command has; None if not given."""

    file: Path = Path()
    folders: tuple[Path, ...] = ()
    speed: float | None = None
    acceleration: float | None = None
    force: float | None = None
    timestep: float | str | None = None
    substeps: int | None = None
    stage: bool | None = None
    clearance: float | None = None
    overlap: float | None = None
    floor: str | None = None
    platen: bool = False
    tile: float | None = None
    relay: bool = False
    cycle: float | None = None
    robots: int | Literal["least"] | None = None
    effort: int | None = None
    limit: float | None = None
    parallel: tuple[tuple[str, int], ...] = ()
    order: str | None = None
    allow: tuple[AllowedOverlap, ...] = ()
    arm: str | None = None

    def settings(self) -> Settings:
        """The settings: from options, else from the environment, else from the plan or, for a PAG,
        from the `factory.toml` beside it or in the current folder. Raises InputError."""
        from factory.support.settings import environment
        from factory.support.user_defaults import defaults_for

        names = ("speed", "acceleration", "force", "timestep", "substeps", "clearance", "overlap")
        values = {name: getattr(self, name) for name in names}
        values["stage"] = None if self.stage is None else int(self.stage)
        plan = self._plan()
        settings = plan.settings if plan else defaults_for(self.file).settings()
        return settings.with_options(environment()).with_options(values)

    def ground(self) -> Ground:
        """The request of FLOOR and RELAY. Raises InputError (BadValue)."""
        from factory.floor.layout.request import TILE, WIDEST, Ground
        from factory.support.user_defaults import defaults_for

        floor = None if self.floor is None else pair(self.floor, "--floor", "4x3", float, WIDEST)
        kept = defaults_for(self.file)
        check_together(
            {
                "--relay": self.relay,
                "--cycle": self.cycle is not None,
                "--robots": self.robots is not None,
                "--platen": self.platen or self.tile is not None,
                "--arm": self.arm is not None,
                "[arms]": bool(kept.arms()),
                "--floor": self.floor is not None,
                "--parallel": bool(self.branches()),
                "[lines]": bool(kept.lines()),
                "[tees]": bool(kept.tees()),
            }
        )
        tile = self.tile or (TILE if self.platen else None)
        return Ground(floor, self.relay, self.cycle, tile)

    def _allowing(self, pag: PAG) -> PAG:
        """The PAG with the overlaps of --allow. Raises InputError (Usage) for unknown parts."""
        parts = [node.label for node in pag.parts()]
        for label in (label for allowed in self.allow for label in allowed.parts):
            if label not in parts:
                hint = did_you_mean(label, parts, "parts")
                raise usage_error(f"--allow: there is no part '{label}'", hint)
        return replace(pag, allowed=(*pag.allowed, *self.allow))

    def project(self, silent: bool = True, settings: Settings | None = None) -> Project:
        """The project that the options describe, with the plan that they ask for, for these
        `settings` if any are given; unless `silent` the search for few robots shows its progress.
        Raises InputError."""
        from factory.pipeline import read
        from factory.support.console import warn
        from factory.support.user_defaults import defaults_for

        if plan := self._plan():
            ground, warnings = self.ground(), list[Diagnostic]()
            ground = replace(plan.ground, floor=ground.floor or plan.ground.floor)
            planned = plan.project(settings or self.settings(), ground, warnings.append)
            warn(warnings, silent)
            return planned
        project = read(self.file, self.folders, settings or self.settings(), self.ground())
        if self.allow:
            project = project.with_pag(self._allowing(project.pag))
        if self.order is not None:
            project = project.with_pag(project.pag.in_order(self.order.split(",")))
        kept = defaults_for(self.file)
        if self.arm is not None:
            return self._with_arm(project, self.arm, silent)
        if arms := kept.arms():
            from factory.apps.arms.ground import with_arms

            return with_arms(project, arms, kept.at("arms"))
        if self.robots is not None or self.cycle is not None:
            return self._with_few_robots(project, silent)
        from factory.apps.few_robots.sharing import with_branches, with_lines, with_tees

        if lines := kept.lines():
            project = with_lines(project, lines)
        if several := self.branches():
            project = with_branches(project, several)
        if stems := kept.tees():
            project = with_tees(project, stems)
        return project

    def branches(self) -> tuple[tuple[str, int], ...]:
        """The labels that are made in parallel branches, with the number of branches."""
        from factory.support.user_defaults import defaults_for

        asked = {**defaults_for(self.file).parallel(), **dict(self.parallel)}
        return tuple((label, k) for label, k in asked.items() if k > 1)

    def _plan(self) -> PlanFile | None:
        """The plan in the file, None for a PAG. Raises InputError, of code Usage for options that
        the plan already fixes."""
        from factory.support.files import is_plan

        if not is_plan(self.file):
            return None
        faults = [
            Diagnostic(
                "Usage", f"{option} applies to a PAG; '{self.file}' is a plan", None, OF_A_PLAN
            )
            for name, option in PLANNED.items()
            if getattr(self, name) not in (None, False, ())
        ]
        if faults:
            raise InputError(faults)
        from factory.apps.log.plan_file import read_plan

        return read_plan(self.file)

    def _with_arm(self, project: Project, arm: str, silent: bool) -> Project:
        """The project of a cell with the arms that are asked for, or with few for --cycle."""
        from factory.apps.arms.few_arms import with_few_arms
        from factory.apps.arms.ground import with_arm
        from factory.support.console import warn

        if self.cycle is None:
            return with_arm(project, arm)
        warnings = list[Diagnostic]()
        made = with_few_arms(project, arm, self.cycle, warnings.append)
        warn(warnings, silent)
        return made

    def _with_few_robots(self, project: Project, silent: bool) -> Project:
        """The project with the plan that is found for --robots and --cycle."""
        from factory.apps.few_robots.aim import Aim, usual_effort, usual_seconds
        from factory.apps.few_robots.search import allocated
        from factory.support.console import warn
        from factory.support.progress import StepBar

        several = self.branches()
        units = prod(k for _, k in several)
        labels = len(project.pag) * units
        effort = self.effort or usual_effort(labels)
        seconds = self.limit or usual_seconds(labels, self.effort)
        aim = Aim(self.robots, self.cycle, effort, seconds, several)
        looked_at, warnings = count(), list[Diagnostic]()
        with StepBar("searching for few robots", silent) as steps:

            def seen(_: Candidate, best: Candidate) -> None:
                steps.show("searching for few robots", next(looked_at), effort, f"best: {best}")

            made = allocated(project, aim, seen, warnings.append)
        warn(warnings, silent)
        return made


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """The options of PICTURE."""

    size: str
    fps: int
    camera: str
    panels: str | None
    title: str
    poster: Path | None
    renderer: RendererName

    def area(self) -> tuple[int, int]:
        """Width and height [px]. Raises InputError (BadValue)."""
        return pair(self.size, "--size", "1280x720", int, LARGEST)

    def picture(self, pag: PAG | None = None) -> Picture:
        """The picture that the options describe; `pag`: the product whose labels cameras may name,
        None for any. Raises InputError (BadValue) for an unknown name, a size without room for
        the panels, or a poster that cannot be a still."""
        from factory.film import Picture, camera_named, check_output, panels_named

        camera, panels = camera_named(self.camera, pag), panels_named(self.panels)
        picture = Picture(
            self.area(), camera, panels=panels, title=self.title, renderer=self.renderer
        )
        if self.poster is not None:
            check_output(self.poster, picture.size, still=True)
        return picture


PLANNED = {
    "folders": "--templates",
    "relay": "--relay",
    "cycle": "--cycle",
    "robots": "--robots",
    "effort": "--effort",
    "limit": "--seconds",
    "parallel": "--parallel",
    "order": "--order",
    "platen": "--platen",
    "tile": "--tile",
    "allow": "--allow",
    "arm": "--arm",
}
"""The options that a plan already fixes, by their fields."""

OF_A_PLAN = "leave it out, or give the PAG and make another plan: `factory build FILE.pag -o DIR`"

LARGEST = 10**5
"""Upper bound on the width and height of a picture [px]."""
