"""Staging: what waits empty-handed goes ahead; the net is the same, the pace is the predicted one,
and nothing comes near what it should not."""

from __future__ import annotations

import random
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.analyze import Timing
from factory.apps.analyze.analysing import operation_slacks
from factory.apps.analyze.timed import flow, timed_net
from factory.apps.monitor import beside
from factory.engine.simulation import simulation as simulations
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import cycle_time
from factory.engine.timing.timed import timed
from factory.engine.timing.timing import Change
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.clearance import certify
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.durations import Pace, gear_times, operation_times
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import first_feasible, optimised
from factory.floor.modes import staging
from factory.floor.modes.modes import operation_modes
from factory.floor.modes.staging import stages
from factory.pipeline import read
from factory.support.settings import Settings
from factory.theory.control.mode import Mode
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from factory.theory.nets.earliest import earliest_firings
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.problem.pag import NOPART
from tests.examples import without_hands
from tests.layout_values import (
    STYLES,
    Drawn,
    drawn_layouts,
    random_layout,
)
from tests.pag_values import SHAPES
from tests.paths import PAPER, ROOT

STAGED, STILL = Settings(stage=1), Settings()
CHEST = ROOT / "examples" / "chest.pag"
ABOVE = """root = s6; s6 = insert ( s0, s5 ); s5 = weld ( s4 ); s4 = weld ( s3 ); s3 = weld ( s2 );
s2 = mate ( a, b ); s0 = insert ( base, wall );
base = atomic ( box = ( 0.2, 0.2, 0.02 ), pos = ( 0, 0, 0.01 ) );
wall = atomic ( box = ( 0.2, 0.02, 0.06 ), pos = ( 0, 0.09, 0.05 ) );
a = atomic ( box = ( 0.12, 0.05, 0.02 ), pos = ( 0, 0.025, 0.03 ) );
b = atomic ( box = ( 0.12, 0.05, 0.02 ), pos = ( 0, -0.025, 0.03 ) )"""
"""What is put beside the wall is held from above by a robot to which two others bring it."""

sizes, seeds = st.integers(2, 20), st.integers(0, 10_000)
shapes, styles = st.sampled_from(SHAPES), st.sampled_from(STYLES)
worlds: Any = st.sampled_from(["ideal", "mujoco"])


def laid_out(file: Path) -> Layout:
    return without_hands(file.stem)


@pytest.fixture(scope="module")
def paper() -> Layout:
    return laid_out(PAPER)


def test_what_goes_ahead_in_the_papers_example(paper: Layout) -> None:
    """r1 and r3 go back with nothing, and wait there for what they are to carry; r2, r5 and r6 wait
    for no robot at their feeders; r4 is a tool, and stays at its station."""
    modes = operation_modes(paper, STAGED.eps)
    operations = paper.factory.operations
    found = {(s.robot + 1, operations[s.operation].label) for s in stages(paper, modes)}
    assert found == {(1, "sub3"), (3, "sub1")}


@given(drawn_layouts)
@settings(max_examples=12)
def test_only_empty_hands_go_ahead_and_only_to_others(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    for stage in stages(layout, operation_modes(layout, STAGED.eps)):
        operation = layout.factory.operations[stage.operation]
        assert operation.robots[stage.slot] == stage.robot
        assert operation.before[stage.slot] == NOPART
        assert len(operation.robots) > 1
        assert stage.goal == layout.goals(operation.index)[stage.slot] != stage.start


def test_what_would_meet_another_on_its_way_does_not_go(
    paper: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    modes = operation_modes(paper, STAGED.eps)
    monkeypatch.setattr(Mode, "clear_from", lambda self, start: False)
    assert stages(paper, modes) == ()


# --- the pace -------------------------------------------------------------------------------------


@given(drawn_layouts, seeds, worlds, st.sampled_from([None, 1, 2]))
@settings(max_examples=40)
def test_the_slowest_gear_sets_the_pace(
    drawn: Drawn, seed: int, world: Any, wip: int | None
) -> None:
    """Though the ways make circuits of their own; and analysis and prediction are one."""
    layout = random_layout(*drawn)
    timing = Timing(layout, STAGED, world, seed, 0.3)
    net = timed_net(timing, wip=wip)
    assert net.pace == pytest.approx(max_cycle_ratio(net.net, net.seconds).seconds)
    assert net.pace <= timed_net(Timing(layout, STILL, world, seed, 0.3), wip=wip).pace + 1e-9
    assert timed(timing, wip=wip).cycle.seconds == pytest.approx(net.pace)
    shares = flow(timing, net, 6).shares
    for robot, share in zip(layout.factory.robots, shares, strict=True):
        waits = net.pace - net.named[robot.index].seconds
        assert share.waiting == pytest.approx(waits + len(robot.operations) * STAGED.tick)


@given(st.integers(2, 10), seeds, shapes)
@settings(max_examples=10)
def test_slack_is_what_an_operation_may_take_longer(size: int, seed: int, shape: str) -> None:
    timing = Timing(random_layout(size, seed, shape, "medium"), STAGED)
    net = timed_net(timing)
    for number, slack in enumerate(operation_slacks(timing, net)):
        for more, grows in ((0.99 * slack, False), (slack + 0.02, True)):
            seconds = list(net.seconds)
            seconds[number] += more
            pace = max_cycle_ratio(net.net, seconds).seconds
            assert (pace > net.pace + 1e-6) == grows


def test_a_carrier_that_is_waited_for_takes_as_long_as_all_of_its_operation() -> None:
    """The hand of the stool's slowest carrier has to be there first: what it takes comes then."""
    layout = laid_out(ROOT / "examples" / "stool.pag")
    simulation = Simulation(layout, RunRequest("ideal", units=7))
    settings, world = simulation.request.settings, simulation.request.world
    timing, longer = simulation.timing, set[tuple[int, int]]()
    for stage in timing.stages:
        way = timing.drive.way(abs(stage.start - stage.goal)).rests(stage.mode.eps) * timing.tick
        key = stage.robot, stage.operation
        longer |= {key} if timing.ways()[key] > way + 0.1 else set()
    run = simulation.run()
    assert run.bottleneck in {layout.factory.robots[robot].name for robot, _ in longer}
    assert run.predicted_cycle_time_s == pytest.approx(run.cycle_time_s, rel=0.01)
    net = timed_net(Timing(layout, settings, world))
    assert net.pace == pytest.approx(run.predicted_cycle_time_s)


def test_a_hand_above_rises_before_its_carrier_goes_home(tmp_path: Path) -> None:
    """What it lets go of is under it. So the carrier's next tour begins later, where others bring
    it something, too."""
    file = tmp_path / "above.pag"
    file.write_text(ABOVE)
    layout = read(file).layout
    assert rises_first(layout, 1) and not layout.magazine(1)
    run = Simulation(layout, RunRequest("mujoco", units=6)).run()
    assert run.bottleneck == "r2"
    assert run.predicted_cycle_time_s == pytest.approx(run.cycle_time_s, rel=0.01)


def test_tokens_may_be_ready_later() -> None:
    """A ring of two places, one token: it is ready after 3 s, and then comes round every 2 s."""
    places = (Place("p", (1,), (0,)), Place("q", (0,), (1,)))
    net = MarkedNet(PetriNet((Transition("a"), Transition("b")), places), (1, 0))
    assert earliest_firings(net, (1.0, 1.0), 3, {}, {0: 3.0})[:, 0].tolist() == [3.0, 5.0, 7.0]


@given(drawn_layouts)
@settings(max_examples=8)
def test_the_layout_is_made_for_that_pace(drawn: Drawn) -> None:
    """An operation ends at most so much before its robots rest by the estimate as they brake in
    the goal ball, and the tick in which its dwell begins; and less than two ticks after that."""
    layout = random_layout(*drawn)
    net = timed_net(Timing(layout, STAGED, "ideal"))
    still, staged = Pace.of(STILL), Pace.of(STAGED)
    timing = Timing(layout, STAGED)
    delays, ways = timing.delays, timing.ways()
    later, tick = np.array(delays) - operation_times(layout, staged), timing.tick
    assert -tick - sqrt(2 * staged.eps / staged.acceleration) < later.min()
    assert later.max() < 2 * tick
    cycle = max(gear_times(layout, staged))
    rounded = cycle_time(layout.factory, delays, ways).seconds - cycle
    assert abs(rounded) < tick * max(len(r.operations) for r in layout.factory.robots)
    assert net.pace < cycle <= max(gear_times(layout, still)) + 1e-9
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, staged)
    made = optimised(layout.factory, layout.product, Clearance(layout.clearance), staged)
    assert 0 < bound <= max(gear_times(made, staged)) + 1e-9
    assert certify(made).holds
    first = first_feasible(layout.factory, layout.product, Clearance(layout.clearance))
    assert max(gear_times(made, staged)) <= max(gear_times(first, staged)) + 1e-9


def test_the_bound_is_one_for_staged_robots(paper: Layout) -> None:
    """The paper's example comes near it, as it does without."""
    for chosen in (STILL, STAGED):
        pace = Pace.of(chosen)
        cycle = max(gear_times(paper, pace))
        bound = cycle_time_bound(paper.factory, paper.product, paper.clearance, pace)
        assert cycle - 0.02 < bound <= cycle


def test_ways_in_the_timed_net(paper: Layout) -> None:
    """As many robots are on a way as wait beside it, and no operation ends before they have come
    that set out at the beginning."""
    timing = Timing(paper, STAGED)
    net = timed_net(timing, Change(copies={2: 3}))
    assert {key[0]: net.net.tokens[place] for key, place in net.ways.items()} == {0: 1, 2: 3}
    assert set(net.ready) == set(net.ways.values())
    late = replace(net, ready=dict.fromkeys(net.ready, 50.0))
    for _, number in net.ways:
        end = timing.factory.operations[number].end
        assert net.firings(1)[0, end] < 50.0 <= late.firings(1)[0, end]


@given(seeds, shapes)
@settings(max_examples=15)
def test_changes_of_a_robot_change_its_ways(seed: int, shape: str) -> None:
    rng = random.Random(seed)
    timing = Timing(random_layout(8, seed, shape, "medium"), STAGED)
    robot = rng.choice([stage.robot for stage in timing.stages] or [0])
    before = timed_net(timing)
    for change in (Change(speed={robot: 2.0}), Change(way={robot: 0.5}), Change(copies={robot: 2})):
        net = timed_net(timing, change)
        assert net.pace == pytest.approx(max_cycle_ratio(net.net, net.seconds).seconds)
        # one that comes sooner may have to wait for others where it turns, and take longer
        pairs = zip(timing.changed(change), timing.delays, strict=True)
        longer = sum(max(0.0, now - was) for now, was in pairs)
        assert net.pace <= before.pace + longer + 1e-9


@pytest.mark.parametrize("distributed", [False, True])
@given(st.integers(2, 12), seeds, shapes, styles)
@settings(max_examples=4)
def test_it_runs_at_that_pace(
    distributed: bool, size: int, seed: int, shape: str, style: str
) -> None:
    layout, units = random_layout(size, seed, shape, style), 6 if distributed else 12
    record = Simulation(
        layout,
        RunRequest(
            "ideal", units=units, seed=seed, jitter=0.2, settings=STAGED, distributed=distributed
        ),
    ).run()
    assert record.trouble is None and record.refines_net
    if not distributed:
        assert record.cycle_time_s is not None
        ticks = 2 * STAGED.tick * max(len(r.operations) for r in layout.factory.robots)
        assert abs(record.cycle_time_s - record.predicted_cycle_time_s) < ticks
    else:
        still = Simulation(
            layout,
            RunRequest(
                "ideal", units=units, seed=seed, jitter=0.2, settings=STILL, distributed=True
            ),
        ).run()
        assert record.sim_time_s < still.sim_time_s + units * 0.1


@pytest.mark.parametrize(
    ("file", "units", "distributed"),
    [
        (PAPER, 8, False),
        (PAPER, 8, True),
        *(pytest.param(CHEST, 4, how, marks=pytest.mark.slow) for how in (False, True)),
    ],
)
def test_it_pays_in_mujoco(file: Path, units: int, distributed: bool) -> None:
    layout = laid_out(file)
    found = {}
    for chosen in (STILL, STAGED):
        made = Simulation(
            layout, RunRequest("mujoco", units=units, settings=chosen, distributed=distributed)
        )
        watcher = beside(made)
        record = found[chosen] = made.run([watcher.observe])
        assert watcher.report().refines_net and not watcher.report().violations
        assert record.refines_net and record.physics is not None
        assert record.physics.unintended_contacts == 0
        assert record.physics.handoff_gap_max_mm < 0.1
    cycles = [found[s].cycle_time_s or 0.0 for s in (STILL, STAGED)]
    assert cycles[1] < 0.96 * cycles[0]
    if not distributed:
        assert cycles[1] == pytest.approx(found[STAGED].predicted_cycle_time_s, rel=0.01)


# --- robots on their way --------------------------------------------------------------------------


def test_what_has_come_there_costs_nothing_more(paper: Layout) -> None:
    """r3 is at its station long before its parts are; nothing moves it there."""
    made = Simulation(paper, RunRequest("mujoco", units=1, settings=STAGED))
    numbers = [s.robot for s in stages(paper, made.modes)]
    count, seen = len(paper.factory.operations), []
    while made.world.delivered() < 1:
        made.supervisor.step()
        active = made.supervisor.active
        seen.append({numbers[n - count] for n in active.ahead})
        slots = sum(len(paper.factory.moves[o]) for o in active.operations) + len(active.ahead)
        assert len(active.axes) == slots == len(set(active.axes.tolist()))
    assert {0} in seen or {0, 2} in seen or {2} in seen
    assert set() in seen


@pytest.mark.parametrize("world", ["ideal", "mujoco"])
def test_a_robot_is_in_one_mode_at_a_time(world: Any) -> None:
    """It leaves its stage as its operation begins, or soon after it has come there. And setpoints
    are where the references are after each tick."""
    layout = laid_out(CHEST)
    made = Simulation(layout, RunRequest(world, units=3, settings=STAGED))
    goals = [stage.goal for stage in stages(layout, made.modes)]
    robots = [stage.robot for stage in stages(layout, made.modes)]
    count, there, overtaken = len(layout.factory.operations), dict.fromkeys(range(99), 0), 0
    while made.world.delivered() < 2:
        before = made.supervisor.active
        made.supervisor.step()
        active, x = made.supervisor.active, made.world.sense()[0]
        assert len(set(active.axes.tolist())) == len(active.axes)
        for number in active.ahead:
            n = number - count
            there[n] = there[n] + 1 if abs(x[robots[n]] - goals[n]) < STAGED.eps else 0
            assert there[n] < 10
        gone = set(before.ahead) - set(active.ahead)
        overtaken += sum(abs(x[robots[n - count]] - goals[n - count]) > 0.01 for n in gone)
        if world == "mujoco":
            motion, m = made.physical.motion, made.physical.m
            control = m.actuator_ctrladr[motion.drives._actuators[active.axes]]
            driven = made.physical.d.ctrl[control]
            assert (driven == motion.robots.x[active.axes]).all()
    assert overtaken > 2


def test_it_goes_on_without_a_stop_where_its_operation_begins() -> None:
    """A robot under way keeps its speed when the mode of its operation takes it over."""
    layout = laid_out(CHEST)
    made = Simulation(layout, RunRequest("mujoco", units=3, settings=STAGED))
    robots, taken = made.physical.motion.robots, []
    before: set[int] = set()
    while made.world.delivered() < 2:
        speeds = robots.v.copy()
        made.supervisor.step()
        active = made.supervisor.active
        started = set(active.operations) - before
        for number in started:
            for robot in layout.factory.operations[number].robots:
                if abs(speeds[robot]) > 0.1:
                    taken.append(abs(robots.v[robot] - speeds[robot]))
        before = set(active.operations)
    most = STAGED.acceleration * STAGED.tick
    assert taken and all(change < most + 1e-9 for change in taken)


def test_limits_may_change_on_the_way(paper: Layout) -> None:
    made = Simulation(paper, RunRequest("mujoco", units=3, settings=STAGED))
    while made.world.time < 1.0 or not made.supervisor.active.ahead:
        made.supervisor.step()
    slower = replace(made.limits, speed=made.limits.speed * 0.5)
    ahead = made.supervisor.active.ahead
    made.supervisor.limit(slower)
    assert made.supervisor.active.ahead == ahead
    assert made.run().refines_net


@pytest.mark.parametrize("marking", ["r1:sub3,r2:nopart,r3:nopart,r4:nopart,r5:nopart,r6:nopart"])
def test_from_a_marking_robots_at_home_have_no_way_to_go(paper: Layout, marking: str) -> None:
    net = paper.factory.net
    chosen = frozenset(net.threaded.net.place_index[name] for name in marking.split(","))
    made = Simulation(paper, RunRequest("mujoco", units=2, settings=STAGED, start=chosen))
    (way,) = (s for s in stages(paper, operation_modes(paper, STAGED.eps)) if s.robot == 2)
    at = float(made.world.sense()[0][2])
    assert way.is_past(at) and not way.is_past(at - 0.01) and not way.is_past(way.start)
    assert not made.supervisor.active.ahead
    assert made.run().refines_net


# --- planted faults -------------------------------------------------------------------------------


def loaded_too(layout: Layout, modes: Any) -> Any:
    """Stages of robots that bring something, too: what the certificate does not allow."""
    found = list(stages(layout, modes))
    known = {(s.robot, s.operation) for s in found}
    for operation, mode in zip(layout.factory.operations, modes, strict=True):
        for slot, robot in enumerate(operation.robots):
            if (robot, operation.index) not in known and len(operation.robots) > 1:
                own = slice(slot, slot + 1)
                alone = type(mode)(mode.goals[own], mode.lower[own], mode.upper[own], mode.eps)
                found.append(staging.HeadStart(robot, operation.index, slot, alone, 0.0, robot))
    return tuple(found)


def test_the_monitor_blames_what_goes_ahead_with_a_part(
    paper: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        simulations, "stages_of", lambda layout, modes, settings: loaded_too(layout, modes)
    )
    made = Simulation(paper, RunRequest("mujoco", units=3, settings=STAGED))
    watcher = beside(made)
    made.run([watcher.observe], max_time=20.0)
    assert {violation.code for violation in watcher.report().violations} & {"Order", "Early"}


def test_the_monitor_blames_what_goes_ahead_though_it_should_wait(
    paper: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The monitor goes by the settings of the run, not by what its supervisor does."""
    monkeypatch.setattr(
        simulations, "stages_of", lambda layout, modes, settings: stages(layout, modes)
    )
    made = Simulation(paper, RunRequest("mujoco", units=3, settings=STILL))
    watcher = beside(made)
    made.run([watcher.observe])
    assert any(violation.code == "Order" for violation in watcher.report().violations)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(40))
def test_random_factories_in_mujoco(number: int) -> None:
    """At jitter 0.3, every third of them distributed, half of them fused, under the monitor's
    eyes."""
    shape, style = SHAPES[number % len(SHAPES)], STYLES[number % len(STYLES)]
    layout = random_layout(4 + number % 9, number, shape, style)
    made = Simulation(
        layout,
        RunRequest(
            "mujoco",
            units=3,
            seed=number,
            jitter=0.3,
            settings=STAGED,
            distributed=number % 3 == 0,
            fuse=number % 2 == 0,
        ),
    )
    watcher = beside(made)
    record = made.run([watcher.observe])
    assert record.trouble is None and record.refines_net
    assert watcher.report().refines_net and not watcher.report().violations
    assert record.physics is not None and record.physics.unintended_contacts == 0
    assert record.physics.handoff_gap_max_mm < 0.1
