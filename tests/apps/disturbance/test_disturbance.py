"""Disturbances: what they do to the physics, what must be survived, and what must not."""

from __future__ import annotations

import numpy as np
import pytest

from benches.fidelity import attraction, disturbances
from benches.fidelity.products import PAPER, layout
from factory.apps.disturbance import (
    Delay,
    Dragged,
    Friction,
    Gain,
    Mass,
    Noise,
    Push,
    Slowed,
    disturb,
)
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.errors import InputError
from factory.support.settings import MOST
from tests.simulation_values import FINE, read_by, stepping


def simulated(*wanted, **options) -> Simulation:
    given = {"settings": FINE, **options}
    return disturb(Simulation(layout(PAPER), RunRequest(units=1, **given)), *wanted)


@pytest.mark.parametrize(
    "nothing",
    [Mass(1.0), Gain(1.0), Slowed("r3", 1.0), Push("r1/carriage", (0, 0, 0), 0.0, 9.0), Noise(0.0)],
    ids=lambda value: type(value).__name__,
)
def test_a_disturbance_of_no_size_changes_next_to_nothing(nothing) -> None:
    plain, disturbed = simulated().run(), simulated(nothing).run()
    assert [e.transition for e in disturbed.events] == [e.transition for e in plain.events]
    late = [a.t - b.t for a, b in zip(disturbed.events, plain.events, strict=True)]
    # A sensor is read once a timestep, and may tell the end of each operation a tick later: they
    # are one after another here. What is not about sensors delays them by a tick in all.
    assert np.abs(np.diff(late, prepend=0.0)).max() < 1.5 * FINE.tick
    assert np.abs(late).max() < (2.5 if isinstance(nothing, Noise) else 1.5) * FINE.tick
    gap, usual = disturbed.physics.handoff_gap_max_mm, plain.physics.handoff_gap_max_mm
    assert gap < usual + 1e-3
    # Who hands over a tick later is nearer to rest.
    assert isinstance(nothing, Noise) or gap == pytest.approx(usual, abs=1e-3)


def test_what_they_write_into_the_model() -> None:
    plain = simulated().physical.m
    m = simulated(Mass(1.5, ("part1",)), Gain(0.7, ("r2",)), Friction(1.5, ("r3",))).physical.m
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
    simulation = simulated(Gain(0.5, ("r2",)))
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
    weak = simulated(Gain(0.5, ("r5",)))
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
    simulation = simulated(Push("r2/carriage", (3.0, 4.0, 0.0), 0.1, 0.05))
    world = simulation.physical
    body, steps = world.m.body("r2/carriage").id, []
    for _ in range(100):
        world.advance(1)
        steps.append(bool(world.d.xfrc_applied[body].any()))
    assert sum(steps) == 25 and steps.index(True) == 50


def test_noise_reaches_the_drive_and_the_supervisor() -> None:
    simulation = simulated(Noise(1e-4, 0.0, 1))
    world, seen, moved = simulation.physical, [], []
    reference, address = world.motion.robots.x[1], world.motion.axes.qpos[1]
    for _ in range(400):
        world.advance(1)
        seen.append(world.sense()[0][1] - reference)
        moved.append(world.d.qpos[address] - reference)
    assert np.std(seen) == pytest.approx(1e-4, rel=0.2)
    assert 1e-6 < np.std(moved) < 1e-4


def test_delay_shows_the_past() -> None:
    simulation = simulated(Delay(0.006))
    world = simulation.physical
    true = []
    world.move(np.array([1]), world.motion.robots.x[[1]], np.array([-0.1]), np.zeros(1))
    for _ in range(20):
        true.append(world.d.qpos[world.motion.axes.qpos[1]])
        world.advance(1)
        assert world.sense()[0][1] == true[max(0, len(true) - 1 - 3)]


def test_friction_holds() -> None:
    """Dry friction above what a drive can push stops it; the engine's default lets it creep."""
    run = simulated(Friction(30.0, ("r5",))).run(max_time=30)
    assert run.products == 0 and run.trouble is not None


def test_a_slow_robot_takes_its_time() -> None:
    plain = simulated().run()
    for slow in (Slowed("r3", 0.1), Dragged("r3", 0.1)):
        run = simulated(slow).run()
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
    run = simulated(Noise(5e-5), Slowed("r2", 0.5), distributed=True).run()
    assert disturbances.judge(run) == ""


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (Push("r9/carriage", (1, 0, 0), 0, 1), "no body 'r9/carriage'"),
        (Mass(1.5, ("part9",)), "no part 'part9'"),
        (Slowed("r9", 0.5), "no robot 'r9'"),
    ],
)
def test_what_is_not_there_cannot_be_disturbed(wrong, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        simulated(wrong)
    assert error.value.diagnostics[0].hint


def test_the_ideal_world_cannot_be_disturbed() -> None:
    with pytest.raises(InputError, match="ideal world"):
        simulated(Mass(2.0), world="ideal")


@pytest.mark.parametrize(
    "make",
    [
        lambda: Mass(0.0),
        lambda: Gain(float("nan")),
        lambda: Friction(-1.0),
        lambda: Noise(-1e-3),
        lambda: Delay(float("inf")),
        lambda: Push("r1/carriage", (1, 0), 0, 1),  # type: ignore[arg-type]
        lambda: Push("r1/carriage", (1, 0, 0), 0, 0.0),
        lambda: Slowed("r1", -0.1),
        lambda: Dragged("r1", 0.0),
    ],
)
def test_values_that_make_no_sense(make) -> None:
    with pytest.raises(ValueError, match="needed"):
        make()


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
