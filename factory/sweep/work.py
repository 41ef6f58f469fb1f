"""One run of a sweep: from a point of its grid to a row of its database."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import lru_cache
from time import perf_counter
from typing import Any, Literal, TypeVar

from factory.errors import FactoryError
from factory.layout.plan import Layout
from factory.mjcf.timestep import timed
from factory.nets.verify import proved
from factory.robots import load_catalogue
from factory.settings import Settings
from factory.simulation import Compiled, Simulation, compiled
from factory.sweep.grid import Point
from factory.sweep.recipe import Recipe, settings_at
from factory.trace import Run
from factory.wholes import fusing_pays

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
"""What a row keeps of a run, under the names of `run --json`, with its type in the database."""

KEPT = 8
"""A worker keeps so many layouts and models: the grid brings points of one together."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """A point that is done. `reason` says why its run failed, "" if it did not; `row_time_s`: all
    the time that it took its worker [s], of which `wall_time_s` of the figures is the run loop."""

    point: Point
    reason: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    row_time_s: float = 0.0
    worker: str = ""
    tries: int = 1
    finished: str = ""


class Runner:
    """Runs points of a sweep in one process. Layouts, and models as the engine has loaded them, are
    kept from run to run: they are the same for all seeds."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.catalogue = load_catalogue()
        self._layout = lru_cache(KEPT)(self._lay_out)
        self._compiled = lru_cache(KEPT)(self._compile)

    def __reduce__(self) -> tuple[type[Runner], tuple[Recipe]]:
        return Runner, (self.recipe,)

    def __call__(self, point: Point) -> Outcome:
        """Run a point. Whatever goes wrong is the reason of its outcome."""
        begin = perf_counter()
        figures: dict[str, Any] = {}
        try:
            run = self.run(point)
            reason, document = _reason(run), run.as_json()
            figures = {name: document[name] for name in FIGURES}
        except FactoryError as error:
            reason = "; ".join(f"{d.code} {d.message}" for d in error.diagnostics[:3])
        except Exception as error:
            reason = f"Internal {type(error).__name__}: {error}"
        return _outcome(point, reason, figures, perf_counter() - begin)

    def run(self, point: Point) -> Run:
        """The run at a point. Raises FactoryError."""
        values: dict[str, Any] = self.recipe.at(point)
        settings = Settings(**settings_at(values))
        units, wip = values["units"], values["wip"]
        layout = _or_raise(self._layout(settings))
        made = timed(settings, layout, values["world"], values["jitter"])
        shared = _or_raise(self._compiled(settings, made, values["world"], units, wip))
        simulation = Simulation(
            layout,
            values["world"],
            units,
            values["seed"],
            values["jitter"],
            settings,
            self.catalogue,
            wip=wip,
            compiled=shared,
        )
        return simulation.run(max_time=self.recipe.max_time)

    def _lay_out(self, settings: Settings) -> Layout | FactoryError:
        recipe = self.recipe
        try:
            layout = recipe.ground.lay_out(recipe.factory, recipe.product, settings)
            if layout.plain is not None:  # relays, and their net, depend on the settings
                proved(layout.factory.net)
            return layout
        except FactoryError as error:
            return error

    def _compile(
        self,
        settings: Settings,
        made: Settings,
        world: Literal["mujoco", "ideal"],
        units: int,
        wip: int | None,
    ) -> Compiled | FactoryError:
        """For settings, as they are `made` with a timestep of numbers."""
        try:
            layout, fuse = _or_raise(self._layout(settings)), self.recipe.fuse
            if fuse is None:
                fuse = fusing_pays(layout.factory, layout.product)
            return compiled(layout, world, units, made, self.catalogue, wip, fuse)
        except FactoryError as error:
            return error


def failed(point: Point, reason: str, tries: int) -> Outcome:
    """The outcome of a run that nobody lived to tell of."""
    return replace(_outcome(point, reason, {}, 0.0), worker="", tries=tries)


def _outcome(point: Point, reason: str, figures: Mapping[str, Any], took: float) -> Outcome:
    worker = f"{socket.gethostname()}:{os.getpid()}"
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return Outcome(point, reason, figures, took, worker, 1, now)


def _reason(run: Run) -> str:
    """Why a run counts as failed, "" if it does not."""
    if run.trouble is not None:
        return f"{run.trouble.code} {run.trouble.message}"
    return "" if run.refines_net else "NotRefined the record does not refine the net"


def _or_raise(found: T | FactoryError) -> T:
    """What was found, or kept as an error."""
    if isinstance(found, FactoryError):
        raise found
    return found
