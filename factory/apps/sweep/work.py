"""One run of a sweep: from a point of its grid to a row of its database."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import lru_cache
from time import perf_counter
from typing import Any, TypeVar

from factory.api import (
    Diagnostic,
    FactoryError,
    Layout,
    LayoutTable,
    Run,
    RunRequest,
    Settings,
    Simulation,
    Timing,
    proved,
)
from factory.apps.deviations import Campaign, Deviation
from factory.apps.recovery import recover
from factory.apps.runs.options import fusing_pays
from factory.apps.runs.watched import watched
from factory.apps.sweep.grid import FAULT_RATE, SETTINGS, Point
from factory.apps.sweep.recipe import Recipe
from factory.engine.simulation.compiled import Compiled

T = TypeVar("T")

FIGURES: Mapping[str, str] = {
    "products": "INTEGER",
    "robots": "INTEGER",
    "sim_time_s": "REAL",
    "wall_time_s": "REAL",
    "physics_time_s": "REAL",
    "supervisor_time_s": "REAL",
    "realtime_factor": "REAL",
    "cycle_time_s": "REAL",
    "predicted_cycle_time_s": "REAL",
    "bottleneck": "TEXT",
    "transitions_fired": "INTEGER",
    "refines_net": "INTEGER",
    "handoffs": "INTEGER",
    "handoff_gap_max_mm": "REAL",
    "weld_residual_max_mm": "REAL",
    "product_error_max_mm": "REAL",
    "unintended_contacts": "INTEGER",
    "engine_warnings": "INTEGER",
    "mating_force_max_n": "REAL",
}
"""Figures of a run in a row, under the names of `run --json`, with their types in the database."""

FAILING_FIGURES: Mapping[str, str] = {
    "failures": "INTEGER",
    "scrapped": "INTEGER",
    "transitions_undone": "INTEGER",
    "fault_contacts": "INTEGER",
}
"""Further figures of a row where the rate of faults varies: number of failures, then as in
`run --json`."""

KEPT = 8
"""Number of layouts and models that a worker keeps; the grid puts the points of one together."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a point. `reason`: why its run failed, "" if it did not; `row_time_s`: time of
    the worker [s], of which the figure `wall_time_s` is the run loop."""

    point: Point
    reason: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    row_time_s: float = 0.0
    worker: str = ""
    tries: int = 1
    finished: str = ""


class Runner:
    """Runs points of a sweep in one process. It keeps layouts and loaded models from run to run:
    they are the same for all seeds."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self._layout = lru_cache(KEPT)(self._lay_out)
        self._compiled = lru_cache(KEPT)(self._compile)

    def __reduce__(self) -> tuple[type[Runner], tuple[Recipe]]:
        return Runner, (self.recipe,)

    def __call__(self, point: Point) -> Outcome:
        """Run a point. Any error is the reason of its outcome."""
        begin = perf_counter()
        figures: dict[str, Any] = {}
        try:
            run = self.run(point)
            reason, document = _told(run.verdict.failures), run.as_json()
            figures = {name: document[name] for name in FIGURES}
            if run.failures is not None:
                counts = run.failures.as_json() | {"failures": len(run.failures.found)}
                figures |= {name: counts[name] for name in FAILING_FIGURES}
        except FactoryError as error:
            reason = _told(error.diagnostics)
        except Exception as error:
            reason = f"Internal {type(error).__name__}: {error}"
        return _outcome(point, reason, figures, perf_counter() - begin)

    def run(self, point: Point) -> Run:
        """The run at a point. Raises FactoryError."""
        values: dict[str, Any] = self.recipe.at(point)
        settings = Settings(**{name: values[name] for name in SETTINGS})
        layout, fuse = _or_raise(self._layout(settings)), self.recipe.fuse
        rate = values.get(FAULT_RATE)
        if fuse is None:
            fuse = fusing_pays(layout.factory, layout.product)
        request = RunRequest(
            values["world"],
            values["units"],
            settings=Timing(layout, settings, values["world"], jitter=values["jitter"]).stepped,
            wip=values["wip"],
            fuse=fuse,
            shown=False,
            recovers=rate is not None,
        )
        shared = _or_raise(self._compiled(settings, request))
        request = replace(request, seed=values["seed"], jitter=values["jitter"])
        simulation = Simulation(layout, request, shared)
        if rate is None:
            return watched(simulation, max_time=self.recipe.max_time)
        faults = tuple(Deviation(kind, rate=rate) for kind in ("drop", "bad_joint"))
        recovery = recover(simulation, Campaign(faults, values["seed"]))
        run = watched(simulation, max_time=self.recipe.max_time)
        return replace(run, failures=recovery.report())

    def _lay_out(self, settings: Settings) -> Layout | FactoryError:
        recipe = self.recipe
        if recipe.laid and all(
            getattr(settings, k) == recipe.fixed[k] for k in LayoutTable.LAID_FOR
        ):
            return recipe.laid
        try:
            layout = recipe.ground.lay_out(recipe.factory, recipe.product, settings)
            if layout.plain is not None:  # relays, and their net, depend on the settings
                proved(layout.factory.net)
            return layout
        except FactoryError as error:
            return error

    def _compile(self, settings: Settings, request: RunRequest) -> Compiled | FactoryError:
        """Compile the model for settings; the request has the timestep as a number."""
        try:
            return Compiled.of(_or_raise(self._layout(settings)), request)
        except FactoryError as error:
            return error


def failed(point: Point, reason: str, tries: int) -> Outcome:
    """The outcome of a run whose worker died."""
    return replace(_outcome(point, reason, {}, 0.0), worker="", tries=tries)


def _outcome(point: Point, reason: str, figures: Mapping[str, Any], took: float) -> Outcome:
    worker = f"{socket.gethostname()}:{os.getpid()}"
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return Outcome(point, reason, figures, took, worker, 1, now)


def _told(failures: Sequence[Diagnostic]) -> str:
    return "; ".join(f"{d.code} {d.message}" for d in failures[:3])


def _or_raise(result: T | FactoryError) -> T:
    """The result of a cached step; raises it where it is an error."""
    if isinstance(result, FactoryError):
        raise result
    return result
