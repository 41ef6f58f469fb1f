"""Long runs: nothing drifts and nothing is lost; drifts and losses that are planted are noticed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benches.fidelity import long_runs
from benches.fidelity.__main__ import REPORT
from benches.fidelity.products import PAPER, layout
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation


@pytest.fixture
def running() -> Simulation:
    """A run in the middle of its work."""
    simulation = Simulation(layout(PAPER), RunRequest(units=8))
    while len(simulation.world.dropoffs) < 3:
        simulation.supervisor.step()
    return simulation


def test_thirty_units_do_not_drift() -> None:
    results = long_runs.measure(quick=True)
    (run,) = results["runs"]
    assert long_runs.faults(run) == []
    assert set(run["figures"]) == set(long_runs.FLOORS)
    assert "Nothing drifts" in long_runs.section(results)


def test_every_copy_is_somewhere_at_every_tick() -> None:
    simulation, seen = Simulation(layout(PAPER), RunRequest(units=4)), set()
    wrong: list[str] = []

    def look(_: State) -> None:
        wrong.extend(long_runs.misplaced(simulation.world))
        whereabouts = long_runs.whereabouts(simulation.world).values()
        seen.update(h for holders in whereabouts for h in holders)

    simulation.run([look])
    assert wrong == []
    assert seen == set(long_runs.HOLDERS.values())


def test_a_copy_that_nothing_holds_is_noticed(running: Simulation) -> None:
    """Planted fault: a robot lets go."""
    world = running.physical
    assert long_runs.misplaced(world) == []
    grips = [w for w in np.flatnonzero(world.d.eq_active) if "grip/" in world.m.equality(w).name]
    world.d.eq_active[grips[0]] = False
    (said,) = long_runs.misplaced(world)
    assert said.endswith("nothing holds it")


def test_a_copy_that_two_hold_is_noticed(running: Simulation) -> None:
    """Planted fault: a weld that is not switched off."""
    world = running.physical
    grips = [w for w in np.flatnonzero(world.d.eq_active) if "grip/" in world.m.equality(w).name]
    body = int(world.m.eq_obj2id[grips[0]])
    (park,) = (
        w
        for w in range(world.m.neq)
        if world.m.equality(w).name.startswith("park/") and world.m.eq_obj2id[w] == body
    )
    world.d.eq_active[park] = True
    (said,) = long_runs.misplaced(world)
    assert "held and parked" in said


def test_a_copy_that_is_in_no_list_is_noticed(running: Simulation) -> None:
    """Planted fault: a parked copy is not among those to spare."""
    free = running.physical.parts.holdings.free
    label = next(label for label in free if free[label])
    free[label].pop()
    said = long_runs.misplaced(running.physical)
    assert [words for words in said if "neither to spare nor in a unit" in words]


def test_a_drift_is_noticed() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-3, 200)
    steady = long_runs.compare((0.05 + noise).tolist(), 5, 1e-3)
    drifting = long_runs.compare((0.05 + noise + 5e-5 * np.arange(200)).tolist(), 5, 1e-3)
    assert steady["same"] and not drifting["same"]


def test_memory_that_grows_is_noticed() -> None:
    found = {
        "figures": {},
        "made": 1,
        "units": 1,
        "trouble": None,
        "refines_net": True,
        "contacts": 0,
        "warnings": 0,
        "growth_kib_a_unit": long_runs.growth([1e5 + 20.0 * n for n in range(100)]),
        "lost": [],
    }
    assert long_runs.faults(found) == ["memory grows by 20.0 KiB a unit"]


def test_a_report_is_written_from_what_is_kept(tmp_path) -> None:
    report = replace(REPORT, path=tmp_path / "fidelity.md")
    report.measure("long_runs", True)
    report.write()
    text = report.path.read_text("utf-8")
    assert text.startswith("# Fidelity") and "## Long runs" in text and "mujoco" in text
    assert "## Disturbances" not in text


@pytest.mark.slow
def test_hundreds_of_units_do_not_drift() -> None:
    for run in long_runs.measure()["runs"]:
        assert long_runs.faults(run) == [], run
