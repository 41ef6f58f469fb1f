"""Disturbances: what they do to the physics, what must be survived, and what must not."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benches.fidelity import attraction, disturbances
from benches.fidelity.products import PAPER, layout
from factory.apps.deviations import KINDS, Campaign, Deviation, Sensors, deviate
from factory.apps.deviations.campaign import campaign_of
from factory.apps.deviations.campaign_file import read_campaign, written
from factory.apps.deviations.deviation import misfits
from factory.apps.deviations.effects import EFFECTS
from factory.apps.recovery import recover
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.errors import InputError
from factory.support.explanations import explain
from factory.support.settings import MOST
from factory.support.tables import table_of
from factory.theory.lang.failures import TESTS
from tests.command_line import Terminal
from tests.paths import PAPER as EXAMPLE
from tests.paths import ROOT
from tests.simulation_values import FINE, read_by, stepping


def simulated(*wanted, **options) -> Simulation:
    given = {"settings": FINE, **options}
    return deviate(Simulation(layout(PAPER), RunRequest(units=1, **given)), *wanted, seed=1)


def push(force, at: float = 0.0, seconds: float = 0.1, body: str = "r2/carriage") -> Deviation:
    return Deviation("push", body=body, force=force, at=at, seconds=seconds)


@pytest.mark.parametrize(
    "nothing",
    [
        Deviation("mass", factor=1.0),
        Deviation("gain", factor=1.0),
        Deviation("slow", robot="r3", factor=1.0),
        push((0, 0, 0), 0.0, 9.0),
        Deviation("noise", metres=0.0),
    ],
    ids=lambda value: value.kind,
)
def test_a_disturbance_of_no_size_changes_next_to_nothing(nothing) -> None:
    plain, disturbed = simulated().run(), simulated(nothing).run()
    assert [e.transition for e in disturbed.events] == [e.transition for e in plain.events]
    late = [a.t - b.t for a, b in zip(disturbed.events, plain.events, strict=True)]
    # A sensor is read once a timestep, and may tell the end of each operation a tick later: they
    # are one after another here. What is not about sensors delays them by a tick in all.
    assert np.abs(np.diff(late, prepend=0.0)).max() < 1.5 * FINE.tick
    assert np.abs(late).max() < (2.5 if (nothing.kind == "noise") else 1.5) * FINE.tick
    gap, usual = disturbed.physics.handoff_gap_max_mm, plain.physics.handoff_gap_max_mm
    assert gap < usual + 1e-3
    # Who hands over a tick later is nearer to rest.
    assert (nothing.kind == "noise") or gap == pytest.approx(usual, abs=1e-3)


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


def test_a_weak_drive_is_as_weak_when_it_brakes() -> None:
    """In every step it pushes with half of what a whole one would, until its robot rests."""
    weak = simulated(Deviation("gain", robot="r5", factor=0.5))
    world, axis, pushed = weak.physical, np.array([4]), list[float]()
    axes, drive = world.motion.axes, world.m.actuator("r5/drive").id
    kp, kv = np.array(simulated().physical.m.actuator_biasprm[drive, 1:3])

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
        assert steps == 1
        told, x, speed = read_by(weak, axis)[0], d.qpos[axes.qpos[4]], d.qvel[axes.dof[4]]
        mujoco.mj_step(m, d)
        if d.tree_asleep[axes.tree[4]] < 0:
            whole = -kp * (told[0] - x) - kv * (told[1] - speed) + told[2]
            assert d.actuator_force[drive] == pytest.approx(0.5 * whole, abs=1e-9)
            pushed.append(told[2])

    with stepping(step):
        for _ in range(150):
            weak.supervisor.step(MOST)
    assert min(pushed) < 0.0 < max(pushed)


def test_a_push_lasts_as_long_as_it_says() -> None:
    simulation = simulated(push((3.0, 4.0, 0.0), 0.1, 0.05))
    world = simulation.physical
    body, steps = world.m.body("r2/carriage").id, []
    for _ in range(100):
        world.advance(1)
        steps.append(bool(world.d.xfrc_applied[body].any()))
    assert sum(steps) == 25 and steps.index(True) == 50


def test_noise_reaches_the_drive_and_the_supervisor() -> None:
    simulation = simulated(Deviation("noise", metres=1e-4))
    world, seen, moved = simulation.physical, [], []
    reference, address = world.motion.robots.x[1], world.motion.axes.qpos[1]
    for _ in range(400):
        world.advance(1)
        seen.append(world.sense()[0][1] - reference)
        moved.append(world.d.qpos[address] - reference)
    assert np.std(seen) == pytest.approx(1e-4, rel=0.2)
    assert 1e-6 < np.std(moved) < 1e-4


def test_delay_shows_the_past() -> None:
    simulation = simulated(Deviation("delay", seconds=0.006))
    world = simulation.physical
    true = []
    world.move(np.array([1]), world.motion.robots.x[[1]], np.array([-0.1]), np.zeros(1))
    for _ in range(20):
        true.append(world.d.qpos[world.motion.axes.qpos[1]])
        world.advance(1)
        assert world.sense()[0][1] == true[max(0, len(true) - 1 - 3)]


def test_friction_holds() -> None:
    """Dry friction above what a drive can push stops it; the engine's default lets it creep."""
    run = simulated(Deviation("friction", robot="r5", newtons=30.0)).run(max_time=30)
    assert run.products == 0 and run.trouble is not None


def test_a_slow_robot_takes_its_time() -> None:
    plain = simulated().run()
    for kind in ("slow", "drag"):
        run = simulated(Deviation(kind, robot="r3", factor=0.1)).run()
        assert run.products == 1 and run.refines_net
        assert run.sim_time_s > 1.5 * plain.sim_time_s


@pytest.mark.parametrize(
    ("name", "robots"),
    [("lamp", [3]), pytest.param("truck", range(23), marks=pytest.mark.slow)],
)
def test_what_waits_at_a_gate_waits_for_the_robot(name: str, robots: list[int]) -> None:
    """Not for its reference, which a robot that is held back does not keep to: inputs would meet
    the hand that is to be there before them."""
    drag = next(kind for kind in disturbances.KINDS if kind.name == "a robot held back")
    for robot in robots:
        assert disturbances.trial(layout(name), drag.make, 10.0, robot, True).failure == ""


def test_distributed_runs_can_be_disturbed() -> None:
    run = simulated(
        Deviation("noise", metres=5e-5),
        Deviation("slow", robot="r2", factor=0.5),
        distributed=True,
    ).run()
    assert disturbances.judge(run) == ""


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (push((1, 0, 0), body="r9/carriage"), "'r9/carriage', which is none of the bodies"),
        (Deviation("mass", label="part9", factor=1.5), "'part9', which is none of the parts"),
        (Deviation("mass", label="sub1", factor=1.5), "'sub1', which is none of the parts"),
        (Deviation("slow", robot="r9", factor=0.5), "'r9', which is none of the robots"),
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
    [
        lambda: Deviation("mass", factor=0.0),
        lambda: Deviation("gain", factor=float("nan")),
        lambda: Deviation("gain"),
        lambda: Deviation("friction", newtons=-1.0),
        lambda: Deviation("noise", metres=-1e-3),
        lambda: Deviation("delay", seconds=float("inf")),
        lambda: push((1, 0)),
        lambda: push((1, 0, float("inf"))),
        lambda: push((1, 0, 0), seconds=0.0),
        lambda: Deviation("push", force=(1, 0, 0)),
        lambda: Deviation("slow", robot="r1", factor=-0.1),
        lambda: Deviation("drag", robot="r1", factor=0.0),
    ],
)
def test_values_that_make_no_sense(make) -> None:
    with pytest.raises(ValueError, match="need"):
        make()


# --- the catalogue, and files -------------------------------------------------------------------


def test_every_kind_has_an_effect_a_page_and_a_test_that_exists() -> None:
    page, text = (ROOT / "docs/guide/faults.md").read_text("utf-8"), explain("BadFault").text
    assert KINDS.keys() == EFFECTS.keys()
    for kind in KINDS.values():
        assert f"| `{kind.name}` |" in page and re.search(rf"\b{kind.name}\b", text)
        assert kind.test in ("", *TESTS)
        for parameter in kind.parameters:
            assert f"| `{parameter.name}` |" in page and parameter.name in text


NUMBERS = st.floats(0, 1e9)
POSITIVE = st.floats(0, 1e9, exclude_min=True)
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "three numbers": st.tuples(*[st.floats(-1e9, 1e9)] * 3),
    "true or false": st.booleans(),
    "a positive number": POSITIVE,
    "a number from 0 on": NUMBERS,
}
TIMES = {"unit": st.integers(1, 10**9), "at": NUMBERS, "rate": st.floats(0, 1)}


@st.composite
def deviations(draw: st.DrawFn) -> Deviation:
    """A deviation of any kind, with any of the keys that it takes."""
    kind = draw(st.sampled_from([*KINDS.values()]))
    values: dict[str, Any] = {name: draw(st.text(min_size=1)) for name in kind.concerns}
    values |= {name: draw(st.text()) for name in kind.narrowed}
    if kind.times and (draw(st.booleans()) or not kind.is_disturbance):
        time = draw(st.sampled_from(kind.times))
        values[time] = draw(TIMES[time])
    for parameter in kind.parameters:
        if parameter.default is None or draw(st.booleans()):
            values[parameter.name] = draw(VALUES[parameter.valid])
    return Deviation(kind.name, **values)


@given(st.lists(deviations(), max_size=4), st.integers(0, 10**9), NUMBERS, st.integers(0, 9))
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, faults: Any, seed: int, number: float, spares: int
) -> None:
    """As a file, and as the table of a log."""
    whole = Campaign(tuple(faults), seed, number, Sensors(noise=number), spares, swap=number)
    path = tmp_path_factory.getbasetemp() / "written.toml"
    path.write_text(written(whole), "utf-8")
    assert read_campaign(path, spares, number) == whole
    assert campaign_of(json.loads(json.dumps(table_of(whole)))) == whole


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


# --- the campaign: planted failures are seen ------------------------------------------------------


def kind(name: str) -> disturbances.Kind:
    return next(k for k in disturbances.KINDS if k.name == name)


def test_a_push_that_must_break_the_run_is_not_survived() -> None:
    pushes = kind("pushes on robots")
    (bad,) = disturbances.trials(layout(PAPER), pushes, 1e4, range(3))
    assert bad.failure
    assert not any(t.failure for t in disturbances.trials(layout(PAPER), pushes, 2.0, range(1)))


def test_a_drive_that_does_nothing_is_not_survived() -> None:
    (bad,) = disturbances.trials(layout(PAPER), kind("weaker drives"), 1e4, range(3))
    assert bad.failure == "stalled"


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


# --- domains of attraction ------------------------------------------------------------------------


def test_a_claim_that_is_too_wide_is_a_defect() -> None:
    """Planted fault: a mode that claims starts where carriages are inside each other."""
    plan = layout(PAPER)
    bench = attraction.Bench(plan, plan.factory.by_label["sub2"].index)
    bench.mode = bench.bundle.modes[0]
    inside = np.minimum(bench.mode.goals, bench.mode.upper) - np.array([0.06, 0.05])
    found = bench.reach(inside)
    assert found.result == "overlap" and any("carriage" in a + b for a, b in found.contacts)


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


def test_starts_are_in_the_domain_and_on_its_borders() -> None:
    plan, chance = layout("lamp"), np.random.default_rng(0)
    number = next(o.index for o in plan.factory.operations if o.template.name == "insert")
    bench = attraction.Bench(plan, number)
    ends = {end for spans in bench.claim.spans for pair in spans for end in pair[0]}
    for name in attraction.KINDS:
        for _ in range(50):
            x = attraction.draw(bench, chance, name)
            if x is None:
                continue
            assert bench.bundle.in_domain(x)[0] and bench.claim.holds(x)
            if name == "stop":
                assert ends & set(x.tolist())


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
