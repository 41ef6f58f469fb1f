"""Trial of a factory: runs in both worlds, to measure the error of its predicted cycle time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from factory.pipeline import Project
from factory.plant.fused_bodies import fusing_pays
from factory.record.state import Observer
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.simulation.watched import watched
from factory.study.analysis.flow import steady_units
from factory.timing.timing import Timing

SEED, JITTER = 0, 0.3
"""Seed and jitter of the robots' speeds and gains."""

MOST = 24
"""Upper bound on the products of a trial."""

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
    at most MOST."""
    layout, settings = project.layout, project.settings
    units = min(MOST, steady_units(Timing(layout, settings, "mujoco", SEED, JITTER)))
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
