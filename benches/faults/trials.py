"""Trials: a product is made while faults strike, and what came of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from benches.fidelity.products import EXAMPLES
from factory.apps.deviations import Campaign, Deviation, Sensors
from factory.apps.recovery import recover
from factory.apps.sweep.pool import cores, over_processes
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.simulation import Simulation
from factory.pipeline import Project, read

JITTER = 0.3
"""Robots differ by this share, in every trial."""


@dataclass(frozen=True)
class Trial:
    """A run of a `product` of the examples, of at most `max_time` [s], and what it is `about`."""

    product: str
    faults: tuple[Deviation, ...]
    units: int = 3
    seed: int = 0
    about: str = ""
    spares: int = 0
    swap: float = 10.0
    clear: float = 10.0
    noise: float = Sensors().noise
    max_time: float = 300.0
    world: WorldName = "mujoco"


@cache
def project(product: str) -> Project:
    """The project of an example."""
    return read(EXAMPLES / f"{product}.pag")


def tried(trial: Trial) -> dict[str, Any]:
    """What came of a trial."""
    made = project(trial.product)
    request = RunRequest(trial.world, trial.units, trial.seed, JITTER, made.settings, recovers=True)
    simulation = Simulation(made.layout, request)
    campaign = Campaign(
        trial.faults,
        trial.seed,
        trial.clear,
        Sensors(noise=trial.noise),
        trial.spares,
        trial.swap,
    )
    recovery = recover(simulation, campaign)
    run = simulation.run(max_time=trial.max_time)
    failures, physics = recovery.report(), run.physics
    return {
        "product": trial.product,
        "world": trial.world,
        "about": trial.about,
        "seed": trial.seed,
        "asked": trial.units,
        "made": run.products,
        "trouble": run.trouble and str(run.trouble),
        "replays": run.refines_net,
        "error_mm": physics and physics.product_error_max_mm,
        "contacts": physics.unintended_contacts if physics else 0,
        "fault_contacts": failures.contacts,
        "struck": sum(failures.struck.values()),
        "found": len(failures.found),
        "missed": failures.missed,
        "false_alarms": failures.false_alarms,
        "undone": failures.undone,
        "spares": failures.spares,
        "operations": run.fired // 2,
        "ended_s": max((one.t for one in failures.found), default=0.0),
        "sim_s": run.sim_time_s,
        "wall_s": run.wall_time_s,
        "predicted_s": run.predicted_cycle_time_s,
        "dropoffs": run.dropoffs,
    }


Kept = Mapping[str, Any] | None
"""The results of a section that is gone on with."""


def tried_so_far(trials: Sequence[Trial], kept: Kept) -> Iterator[list[dict[str, Any]]]:
    """What came of all so far, again after each; those that are `kept` are not tried again."""
    rows = [*(kept or {}).get("rows", ())]
    known = {(row["product"], row["world"], row["about"], row["seed"]) for row in rows}
    left = [t for t in trials if (t.product, t.world, t.about, t.seed) not in known]
    for row in all_tried(left):
        rows.append(row)
        yield rows


def all_tried(trials: Sequence[Trial]) -> Iterator[dict[str, Any]]:
    """What came of all, as it comes, from all cores."""
    for worked in over_processes(tried, trials, cores()):
        print(".", end="", flush=True)
        assert worked.result is not None
        yield worked.result
    print()


def is_good(row: dict[str, Any]) -> bool:
    """Whether nothing is wrong with a run but what the world did to it."""
    error = row["error_mm"] is None or row["error_mm"] < 0.1
    counts = row["contacts"] + row["missed"] + row["false_alarms"]
    return row["made"] == row["asked"] and error and not counts and row["replays"]
