"""Disturbances: what they do to the physics, what must be survived, and what must not."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benches.fidelity import attraction, disturbances
from benches.fidelity.products import PAPER, layout
from factory.apps.deviations import KINDS, Campaign, Deviation, deviate
from factory.apps.deviations.campaign_file import read_campaign, written
from factory.apps.deviations.deviation import misfits
from factory.apps.recovery import recover
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from tests.command_line import Terminal
from tests.paths import PAPER as EXAMPLE
from tests.simulation_values import FINE


def simulated(*wanted, **options) -> Simulation:
    given = {"settings": FINE, **options}
    return deviate(Simulation(layout(PAPER), RunRequest(units=1, **given)), *wanted, seed=1)


def push(force, at: float = 0.0, seconds: float = 0.1, body: str = "r2/carriage") -> Deviation:
    return Deviation("push", body=body, force=force, at=at, seconds=seconds)


def test_what_they_write_into_the_model() -> None:
    plain = simulated().physical.m
    m = simulated(
        Deviation("mass", label="part1", factor=1.5),
        Deviation("gain", robot="r2", factor=0.7),
        Deviation("friction", robot="r3", newtons=1.5),
    ).physical.m
    one, two = (m.body(f"part/part{n}#1").id for n in (1, 2))
    assert m.body_mass[one] == 1.5 * plain.body_mass[one]
    assert (m.body_inertia[one] == 1.5 * plain.body_inertia[one]).all()
    assert m.body_mass[two] == plain.body_mass[two]
    drive = m.actuator("r2/drive").id
    assert (m.actuator_biasprm[drive, 1:3] == 0.7 * plain.actuator_biasprm[drive, 1:3]).all()
    assert (m.actuator_forcerange[drive] == 0.7 * plain.actuator_forcerange[drive]).all()
    assert m.dof_frictionloss[m.joint("r3/slide").dofadr[0]] == 1.5
    assert m.dof_frictionloss[m.joint("r2/slide").dofadr[0]] == pytest.approx(0.2)


def test_a_weak_drive_scales_its_whole_force() -> None:
    simulation = simulated(Deviation("gain", robot="r2", factor=0.5))
    world, axis = simulation.physical, np.array([1])
    world.motion.drives.load(axis, np.zeros(1), np.array([2.0]))
    world.motion.drives.stand(axis, world.motion.robots.x[axis] + 1e-4)
    world.advance(1)
    kp = -world.m.actuator_biasprm[world.m.actuator("r2/drive").id, 1]
    assert world.d.actuator_force[world.m.actuator("r2/drive").id] == pytest.approx(
        kp * 1e-4 + 0.5 * 2.0
    )


def test_delay_shows_the_past() -> None:
    simulation = simulated(Deviation("delay", seconds=0.006))
    world = simulation.physical
    true = []
    world.move(np.array([1]), world.motion.robots.x[[1]], np.array([-0.1]), np.zeros(1))
    for _ in range(20):
        true.append(world.d.qpos[world.motion.axes.qpos[1]])
        world.advance(1)
        assert world.sense()[0][1] == true[max(0, len(true) - 1 - 3)]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (push((1, 0, 0), body="r9/carriage"), "'r9/carriage', which is none of the bodies"),
        (Deviation("drop", label="part1", unit=1), "does not go on after failures"),
    ],
)
def test_what_is_not_there_cannot_be_disturbed(wrong, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        simulated(wrong)
    assert error.value.diagnostics[0].hint


def test_the_ideal_world_cannot_be_disturbed() -> None:
    with pytest.raises(InputError, match="ideal world"):
        simulated(Deviation("mass", factor=2.0), world="ideal")


@pytest.mark.parametrize(
    "make",
    [lambda: Deviation("delay", seconds=float("inf")), lambda: Deviation("push", force=(1, 0, 0))],
)
def test_values_that_make_no_sense(make) -> None:
    with pytest.raises(ValueError, match="need"):
        make()


def test_an_error_stands_at_its_key_in_its_own_table(tmp_path: Path) -> None:
    """Not at the first key of that name, nor at one in another place."""
    path = tmp_path / "faults.toml"
    path.write_text(
        "[[fault]]\nkind = 'mass'\nfactor = 2.0\n\n[sensors]\nnoise = 1e-4\n\n"
        "  [[ fault ]]\n  kind = 'slow'\n  robot = 'r1'\n  factor = 0.0\n"
        "[['fault']]\nkind = 'gain'\n[[fault]]\nkind = 'gain'\nfactor = 'x'\n"
    )
    with pytest.raises(InputError) as error:
        read_campaign(path)
    wrong = [(d.position.line, d.position.column, d.code) for d in error.value.diagnostics]
    assert wrong == [(11, 3, "BadFault"), (12, 4, "BadFault"), (16, 1, "BadValue")]
    path.write_text("\nfault = [{kind = 'mass', factor = 2.0}, {kind = 'gain'}]\n")
    with pytest.raises(InputError, match="needs a 'factor'") as error:
        read_campaign(path)
    assert error.value.diagnostics[0].position.line == 2


EVERY = (
    Deviation("push", body="r2/carriage", force=(2.0, 2.0, 0.0), at=0.5, seconds=0.1),
    Deviation("slow", robot="r3", factor=0.5, at=0.2),
    Deviation("slow", robot="r3", factor=1.0, at=1.5),
    Deviation("drag", robot="r1", factor=0.8),
    Deviation("mass", factor=1.2),
    Deviation("gain", factor=0.9),
    Deviation("friction", newtons=0.4),
    Deviation("noise", metres=2e-5),
    Deviation("delay", seconds=0.002),
    Deviation("drop", label="part2", unit=1),
    Deviation("blackout", at=1.0, seconds=0.3),
)


def test_a_run_with_every_disturbance_recovers_and_resumes(run: Terminal, tmp_path: Path) -> None:
    """From a file: a log that is cut off and gone on with has the same bytes."""
    assert {fault.kind for fault in EVERY} >= {k.name for k in KINDS.values() if k.is_disturbance}
    file, log, cut = (tmp_path / name for name in ("faults.toml", "run.log", "cut.log"))
    file.write_text(written(Campaign(EVERY, clear=1.0)))
    done = run("run", EXAMPLE, "--faults", file, "--log", log, "--json")
    assert done.status == 0 and done.json["failures"]["false_alarms"] == 0
    assert done.json["failures"]["struck"] == Counter(fault.kind for fault in EVERY)
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 3 // 5])
    assert run("run", cut, "--resume", "-q").status == 0
    assert cut.read_bytes() == log.read_bytes()


def test_a_blackout_hides_what_noise_measures() -> None:
    """Sensors that report nothing report no noise either."""
    made = Simulation(layout(PAPER), RunRequest(units=1, settings=FINE, recovers=True))
    recovery = recover(made)
    recovery.strike(Deviation("noise", metres=1e-4))
    made.physical.advance(1)
    assert not np.isnan(made.world.sense()[0]).any()
    recovery.strike(Deviation("blackout", at=0.0, seconds=1.0))
    assert np.isnan(made.world.sense()[0]).all()


def test_the_search_finds_the_last_point_that_holds() -> None:
    grid = disturbances.geometric(1, 64)
    for last in range(-1, len(grid)):
        asked: list[float] = []

        def survives(magnitude: float, last: int = last, asked: list[float] = asked) -> bool:
            asked.append(magnitude)
            return magnitude <= grid[last] if last >= 0 else False

        assert disturbances.largest(survives, grid) == last
        assert len(asked) == len(set(asked)) <= 11


@pytest.mark.slow
def test_the_quick_campaign_of_disturbances() -> None:
    results = disturbances.measure(quick=True)
    assert all(r["survived"] for r in results["products"][PAPER]["required"])
    assert "**all are.**" in disturbances.section(results)


def test_a_law_that_does_not_come_to_its_goal_is_a_defect(monkeypatch) -> None:
    """Planted fault: a field that stands still."""
    plan = layout(PAPER)
    bench = attraction.Bench(plan, plan.factory.by_label["sub1"].index)
    start = bench.mode.upper.copy()
    assert bench.reach(start).result == "reached"
    monkeypatch.setattr(type(bench.bundle), "field", lambda self, x, dt: np.zeros_like(x))
    bench.world.motion.stepping._courses.clear()  # planned with the good law
    assert bench.reach(start).result == "missed"
    said = attraction.summary(PAPER, "mate", "sub1", [bench.reach(start)])
    assert said["share_reached"] == 0 and said["defects_by_kind"] == {"inside": 1}


@pytest.mark.slow
def test_the_campaign_of_disturbances() -> None:
    results = disturbances.measure()
    for name, product in results["products"].items():
        for required in product["required"]:
            assert required["survived"], (name, required)
        for found in product["largest"]:
            assert found["survived"] is not None, (name, found)


@pytest.mark.slow
def test_every_claimed_start_reaches_its_goal() -> None:
    for mode in attraction.measure()["modes"]:
        assert mode["share_reached"] == 1.0, mode


@pytest.mark.parametrize(
    ("values", "keys"),
    [
        ({"label": "sub1", "unit": 1}, []),
        ({"label": "sub1"}, [""]),
        ({"label": "sub1", "unit": 1, "at": 2.0}, [""]),
        ({"label": "sub1", "unit": 0}, ["unit"]),
    ],
)
def test_a_failure_is_at_one_time(values: dict[str, object], keys: list[str]) -> None:
    assert [key for key, _ in misfits("drop", values)] == keys


def test_parameters_are_in_their_range() -> None:
    force, seconds = KINDS["push"].parameters
    assert force.admits((0.0, -1.0, 2.0)) and not force.admits((0.0, 1.0))
    assert seconds.admits(0.5) and not seconds.admits(0.0)


def test_a_bad_part_is_seen_unless_it_is_hidden() -> None:
    assert not Deviation("bad_part", label="part1", unit=1).hidden
