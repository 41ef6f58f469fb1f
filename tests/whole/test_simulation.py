"""Runs in both worlds: the figures that must be seen, and planted faults that must be caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import factory
from factory.engine.record.state import State
from factory.engine.simulation.distributed import DistributedSupervisor
from factory.engine.simulation.mujoco.fast import neighbours
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from tests.good_runs import random_marking
from tests.layout_values import Drawn, random_layout
from tests.pag_texts import PAPER, laid_out
from tests.simulation_values import layout_of, ready
from tests.slow import slow_but


@pytest.fixture(scope="module")
def paper() -> Layout:
    return laid_out(PAPER)


@pytest.mark.parametrize(("drawn", "jitter"), [((4, 1, "chain", "small"), 0.0)])
def test_robots_with_their_own_programs_have_any_speed_at_once_in_the_ideal_world(
    drawn: Drawn, jitter: float
) -> None:
    """ẋ = F_p(x) there, too: governed by their accelerations they were 15 % slower."""
    request = RunRequest("ideal", 16, seed=drawn[1], jitter=jitter, distributed=True)
    run = Simulation(random_layout(*drawn), request).run()
    assert run.refines_net and run.cycle_time_s is not None
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.005)


@pytest.mark.parametrize("seed", slow_but([0, 1], range(6)))
def test_a_run_can_start_from_any_legal_marking(paper: Layout, seed: int) -> None:
    """Theorem 5.2: dropoff runs again and again, whatever the marking; in MuJoCo in
    `test_monitor`."""
    start = random_marking(paper, seed)
    run = factory.run(paper, world="ideal", units=2, jitter=0.3, seed=seed, start=start)
    assert (run.products, run.refines_net) == (2, True)


def test_robots_that_touch_are_seen_in_the_ideal_world(paper: Layout) -> None:
    """Planted fault: r5 and r6 stand at their meeting point."""
    simulation = Simulation(paper, RunRequest(world="ideal", units=1))
    while paper.factory.by_label["sub1"].index not in simulation.supervisor.active.operations:
        simulation.supervisor.step()
    simulation.world.x[[4, 5]] = 0.0
    with pytest.raises(AssertionError, match="two robots touch"):
        simulation.supervisor.step()


def linked(paper: Layout) -> DistributedSupervisor:
    """The paper's robots before they begin, each with its own program."""
    simulation = Simulation(paper, RunRequest("ideal", units=2, distributed=True))
    assert isinstance(simulation.supervisor, DistributedSupervisor)
    return simulation.supervisor


def test_a_robot_reads_only_its_own_mode(paper: Layout) -> None:
    """Of the operation that it is at now it reads all robots, of any other none."""
    label = paper.factory.by_label
    link = linked(paper).processes[2].link
    assert len(link.state()[0]) == 3
    assert link.waits(4, "part1") is link.waits(5, "part2") is link.has_left(5) is False
    for ask in (lambda: link.has_left(3), lambda: link.waits(0, "nopart")):
        with pytest.raises(AssertionError, match=r"robot 2 reads robot \d, which is not in the"):
            ask()
    link.at(label["sub2"], 0)
    assert not link.has_left(3)
    with pytest.raises(AssertionError, match="robot 2 reads robot 4, which is not in the mode of"):
        link.has_left(4)
    with pytest.raises(AssertionError, match="robot 2 is not in the mode of part1"):
        link.at(label["part1"], 0)


def test_a_program_that_reads_more_is_refused(paper: Layout) -> None:
    """Planted fault: r3 waits until r1 shows something, too."""
    supervisor = linked(paper)
    process = supervisor.processes[2]
    steps = [replace(s, until=((0, "nopart"), *s.until)) for s in process.program.steps]
    process.program = replace(process.program, steps=tuple(steps))
    with pytest.raises(AssertionError, match="reads robot 0, which is not in the mode of"):
        for _ in range(500):
            supervisor.step()


def test_a_time_limit_names_robot_mode_and_line(paper: Layout) -> None:
    with pytest.raises(factory.RunError) as error:
        factory.run(paper, units=50, max_time=1.5)
    text = str(error.value)
    assert "Timeout" in text
    assert "r3 in weld(sub2)" in text
    assert "sub2 = weld ( sub1 )" in text


def test_an_unstable_engine_ends_the_run(paper: Layout) -> None:
    """Planted fault: a speed that is no number. The engine begins anew then, at time 0, which is
    nothing to be seen."""
    simulation = Simulation(paper, RunRequest(units=1))
    seen = []

    def plant(state: State) -> None:
        world = simulation.physical
        seen.append(state.time)
        if world.time > 1.0:
            world.d.qvel[world.motion.axes.dof[2]] = float("nan")

    run = simulation.run([plant])
    assert run.trouble is not None
    assert run.trouble.code == "Unstable"
    assert "r3 in" in run.trouble.message and "after 1.00 s" in run.trouble.message
    assert run.sim_time_s == seen[-1] == pytest.approx(1.0)
    assert all(0.0 <= share <= 1.0 for share in run.utilisation)
    assert seen == sorted(seen)


def test_only_what_is_joined_may_touch() -> None:
    """Inputs of one unit in the hands of the robots of one operation, while it goes on."""
    simulation = ready("paper")
    inspection, operations = simulation.physical.inspection, simulation.layout.factory.operations
    m, masks = simulation.physical.m, simulation.physical.parts.masks
    join = next(o for o in operations if len(o.inputs) == 2)
    other = next(r for r in range(len(simulation.layout.factory.robots)) if r not in join.robots)
    one, two = (int(body) for body in [*masks.solid][:2])
    geoms = int(m.body_geomadr[one]), int(m.body_geomadr[two])
    inspection.joining = {join.index: 7}
    for units, robots, expected in (
        ((7, 7), join.robots[:2], join.label),
        ((7, 7), (join.robots[0], other), None),
        ((7, 7), (other, join.robots[0]), None),
        ((8, 8), join.robots[:2], None),
        ((7, 8), join.robots[:2], None),
    ):
        masks.unit[[one, two]] = units
        masks.code[[one, two]] = np.array(robots) + 1
        assert inspection._joined(*geoms) == expected
    masks.unit[[one, two]] = 7
    masks.code[[one, two]] = np.array(join.robots[:2]) + 1
    assert inspection._joined(*geoms) == join.label
    inspection.joining = {}
    assert inspection._joined(*geoms) is None


def test_an_event_that_is_not_enabled_cannot_fire() -> None:
    """Planted fault: the supervisor is made to end an operation that has not begun."""
    simulation = Simulation(layout_of("paper"), RunRequest("ideal", units=1))
    sub3 = simulation.layout.factory.by_label["sub3"].index
    with pytest.raises(AssertionError, match="not all are enabled that fire: sub3_e"):
        simulation.supervisor._fire([], [sub3])


def test_no_more_is_simulated_than_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)  # in small factories, too
    run = ready("paper", units=5).run(max_time=1.23)
    assert run.sim_time_s == pytest.approx(1.23) and run.trouble is not None
