"""A factory tried: run in both worlds, to see how far its cycle time is from what is predicted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from factory.pipeline import Project
from factory.plant.fused_bodies import fusing_pays
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Observer, Simulation
from factory.simulation.watched import watched
from factory.study.analysis.flow import steady_units
from factory.timing.timing import Timing

SEED, JITTER = 0, 0.3
"""What the speeds and gains of robots are drawn with."""

MOST = 24
"""The most products of a trial."""

CLOSE = 0.02
"""A prediction that is off by no more holds."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Runs of so many `units` in both worlds: the cycle time `predicted` for the speeds that were
    drawn, `measured` in MuJoCo, and `ideal` in the other [s]; the `failures` of their verdicts."""

    units: int
    predicted: float
    measured: float | None
    ideal: float | None
    failures: tuple[str, ...] = ()

    @property
    def error(self) -> float | None:
        """The relative error of the prediction; None where the run came to no end."""
        return self.predicted / self.measured - 1 if self.measured else None

    @property
    def holds(self) -> bool:
        """Whether both runs succeeded, and the prediction is CLOSE."""
        return not self.failures and self.error is not None and abs(self.error) <= CLOSE

    def as_json(self) -> dict[str, Any]:
        """It as `pareto --json` lists it."""
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
    """The trial of a project's factory: as many units as it takes until they come at the pace of
    its net, MOST at most."""
    layout, settings = project.layout, project.settings
    units = min(MOST, steady_units(Timing(layout, settings, "mujoco", SEED, JITTER)))
    fuse = fusing_pays(layout.factory, layout.product)
    asked = RunRequest("mujoco", units, SEED, JITTER, settings, fuse=fuse, shown=False)
    asked = replace(asked, catalogue=project.catalogue)
    run = watched(Simulation(layout, asked), (), None, glances)
    thought = Simulation(layout, replace(asked, world="ideal", fuse=False)).run((), None, glances)
    failures = [
        f"{one.world}: {failure.code}: {failure.message}"
        for one in (run, thought)
        for failure in one.verdict.failures
    ]
    predicted = run.predicted_cycle_time_s or 0.0
    return Trial(units, predicted, run.cycle_time_s, thought.cycle_time_s, tuple(failures))
