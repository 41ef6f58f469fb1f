"""Runs in both worlds: the figures that must be seen, and planted faults that must be caught."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import factory
from benches.speed.factories import laid_out as floor_of
from factory.engine.record.state import Event, State
from factory.engine.simulation.distributed import DistributedSupervisor
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import busy_times, mean_interval, steady_from
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timed import timed
from factory.engine.timing.timing import Timing
from factory.floor.layout.layout import Layout
from factory.pipeline import all_templates, read
from factory.support.settings import Settings
from factory.theory.nets.replay import replay
from tests.good_runs import assert_good, random_marking
from tests.layout_values import Drawn, random_layout
from tests.pag_texts import LONE, PAPER, PRODUCTS, laid_out
from tests.random_products import random_product
from tests.simulation_values import ready


@pytest.fixture(scope="module")
def paper() -> Layout:
    return laid_out(PAPER)


def test_forty_units_of_the_papers_example(paper: Layout) -> None:
    run = factory.run(paper, units=40)
    assert run.products == 40
    assert_good(run)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)


SHORT = {
    "outfeed": """
        root = s1; s1 = mate ( p0, p1 );
        p0 = atomic ( box = ( 0.01, 0.01, 0.1 ), pos = ( 0, 0, 0.05 ) );
        p1 = atomic ( sphere = 0.01, pos = ( 0.005, 0.0155, 0.01 ) );
    """,
    "r": """
        root = s2; s1 = mate ( p1, p0 ); s2 = mate ( p2, s1 );
        p0 = atomic ( box = ( 0.0869, 0.0306, 0.0242 ), pos = ( 0, 0, 0.0121 ) );
        p1 = atomic ( box = ( 0.1171, 0.0185, 0.0535 ), pos = ( 0, 0, 0.05095 ) );
        p2 = atomic ( box = ( 0.0161, 0.0349, 0.0566 ), pos = ( 0, 0, 0.106 ) );
    """,
}
"""Products with short cycles, by what sets the pace."""


@pytest.mark.parametrize(("pace", "jitter"), [("outfeed", 0.0), ("r", 0.0), ("r", 0.3)])
def test_a_short_cycle_is_predicted_to_a_tick(pace: str, jitter: float, tmp_path: Path) -> None:
    """They were off by up to 69 ms: a run goes by ticks, and the tray counts as home when near."""
    file = tmp_path / "short.pag"
    file.write_text(SHORT[pace])
    run = factory.run(file, units=12, jitter=jitter)
    assert run.succeeded and run.bottleneck.startswith(pace)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, abs=0.0101)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_cycle_of_robots_that_run_their_own_programs_is_predicted(
    paper: Layout, seed: int
) -> None:
    """They see what they wait for up to a control period late: they were 1.4 to 6.8 % slower."""
    run = factory.run(paper, units=12, seed=seed, distributed=True)
    assert run.succeeded and run.cycle_time_s > 1.01 * timed(Timing(paper)).pace
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.015)


@pytest.mark.parametrize(
    ("drawn", "jitter"), [((4, 1, "chain", "small"), 0.0), ((6, 8, "any", "mixed"), 0.3)]
)
def test_robots_with_their_own_programs_have_any_speed_at_once_in_the_ideal_world(
    drawn: Drawn, jitter: float
) -> None:
    """ẋ = F_p(x) there, too: governed by their accelerations they were 15 % slower."""
    request = RunRequest("ideal", 16, seed=drawn[1], jitter=jitter, distributed=True)
    run = Simulation(random_layout(*drawn), request).run()
    assert run.refines_net and run.cycle_time_s is not None
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.005)


def test_a_cycle_time_is_one_of_whole_periods() -> None:
    """Of units that leave in groups of six, 1 s apart, a group every 9 s."""
    left = [9.0 * (n // 6) + n % 6 for n in range(24)]
    assert mean_interval(left, 6) == 1.5
    assert mean_interval(left[:12], 6) == 1.5
    assert mean_interval(left[:11], 6) is None and mean_interval(left[:8], 6) is None
    assert (steady_from(1), steady_from(2), steady_from(6)) == (4, 4, 12)


@pytest.mark.parametrize("seed", range(6))
def test_a_run_can_start_from_any_legal_marking(paper: Layout, seed: int) -> None:
    """Theorem 5.2: dropoff runs again and again, whatever the marking; in MuJoCo in
    `test_monitor`."""
    start = random_marking(paper, seed)
    run = factory.run(paper, world="ideal", units=2, jitter=0.3, seed=seed, start=start)
    assert (run.products, run.refines_net) == (2, True)


def test_wip_bounds_what_is_inside(paper: Layout) -> None:
    run = factory.run(paper, units=5, wip=1)
    assert_good(run)
    inside, most = 0, 0
    for event in run.events:
        inside += (event.transition == "part1_s") - (event.transition == "dropoff_e")
        most = max(most, inside)
    assert most == 1
    free = factory.run(paper, units=5)
    assert free.cycle_time_s < run.cycle_time_s


@pytest.mark.parametrize("name", ["paper", "kary", "chain"])
@pytest.mark.parametrize("wip", [1, 2])
def test_the_cycle_time_under_wip_is_predicted(name: str, wip: int) -> None:
    run = factory.run(laid_out(PRODUCTS[name]), world="ideal", units=12, wip=wip)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)


def test_the_pool_is_what_the_net_says(paper: Layout) -> None:
    model = Simulation(paper, RunRequest(units=50)).model
    assert model is not None
    assert dict(model.copies) == {"part1": 4, "part2": 4, "part3": 3}
    assert dict(Simulation(paper, RunRequest(units=2)).model.copies) == {
        "part1": 2,
        "part2": 2,
        "part3": 2,
    }


def test_the_replay_catches_a_record_out_of_order(paper: Layout) -> None:
    events = [e.transition for e in factory.run(paper, world="ideal", units=2).events]
    assert replay(paper.factory.net, events).refines
    cut, after = events.index("sub1_e"), events.index("sub2_s")
    dropped = [*events[:cut], *events[cut + 1 :]]
    assert not replay(paper.factory.net, dropped).refines
    assert replay(paper.factory.net, dropped).index is not None
    early = [*events[:cut], "sub2_s", *events[cut:after], *events[after + 1 :]]
    assert replay(paper.factory.net, early).index == cut


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


@pytest.mark.parametrize("carrier", [True, False])
def test_a_program_that_reads_more_is_refused(paper: Layout, carrier: bool) -> None:
    """Planted fault: r3, or r4, waits until r1 shows something, too."""
    supervisor = linked(paper)
    process = supervisor.processes[2 if carrier else 3]
    steps = [replace(s, until=((0, "nopart"), *s.until)) for s in process.program.steps]
    process.program = replace(process.program, steps=tuple(steps))
    with pytest.raises(AssertionError, match="reads robot 0, which is not in the mode of"):
        for _ in range(500):
            supervisor.step()


def test_no_program_reads_the_record(paper: Layout) -> None:
    """Without one everything happens at the same time."""
    told, untold = linked(paper), linked(paper)
    untold.record = SimpleNamespace(start=lambda *_: None, end=lambda *_: None)  # type: ignore[assignment]
    for _ in range(1200):
        told.step()
        untold.step()
    assert len(told.world.dropoffs) == 2
    assert told.world.dropoffs == untold.world.dropoffs


def test_the_outfeed_may_be_the_bottleneck() -> None:
    layout = laid_out(LONE)
    slow = factory.run(layout, units=8, settings=factory.Settings(outfeed=0.1))
    assert slow.bottleneck == "outfeed"
    assert slow.cycle_time_s == pytest.approx(slow.predicted_cycle_time_s, rel=0.02)
    assert_good(slow)


def test_a_time_limit_names_robot_mode_and_line(paper: Layout) -> None:
    with pytest.raises(factory.RunError) as error:
        factory.run(paper, units=50, max_time=1.5)
    text = str(error.value)
    assert "Timeout" in text
    assert "r3 in weld(sub2)" in text
    assert "sub2 = weld ( sub1 )" in text


def test_a_carrier_goes_on_when_all_others_have_followed() -> None:
    """A robot in an operation that looks seldom finds that its carrier has not gone on."""
    layout = laid_out(PRODUCTS["kary"])
    simulation = Simulation(
        layout, RunRequest("ideal", units=3, seed=3, jitter=0.5, distributed=True)
    )
    supervisor, inside = simulation.supervisor, 0
    for process in supervisor.processes:
        process.period = 11 if process.program.robot in layout.factory.by_label["t"].robots else 3
    while simulation.world.delivered() < 3:
        supervisor.step()
        for process in supervisor.processes:
            operation, unit = process.step.operation, process.unit
            carrier = supervisor.processes[operation.carrier]
            if process.stage == "run" and process is not carrier:
                gear = [step.operation for step in carrier.program.steps]
                assert carrier.turns <= unit * len(gear) + gear.index(operation)
                inside += carrier.stage == "leave"
    assert inside, "some carrier has waited for others"


def test_a_contact_that_lasts_is_one(paper: Layout) -> None:
    """Robots driven into each other, without end stops, looked at step by step."""
    simulation = ready(paper, units=1, distributed=True)
    world, onsets, before, lasted = simulation.physical, 0, set(), 0
    world.m.jnt_limited[:] = False
    for _ in range(50):
        simulation.supervisor.step()
    axes = np.arange(world.motion.axes.tray)
    at, speed = world.motion.robots.x[axes], np.where(axes % 2, 0.3, -0.3)
    world.move(axes, at, speed, np.zeros(len(axes)))
    for _ in range(800):
        world.advance(1)
        world.inspection.tick()
        contact = world.d.contact
        now = {tuple(pair) for pair in contact.geom[contact.dist < 0].tolist()}
        onsets, lasted, before = onsets + len(now - before), lasted + len(now & before), now
    assert onsets and lasted > 10 * onsets
    assert len(world.inspection.unintended) == onsets


HEAVY = {
    "lowered": """root = w; w = mate ( base, block );
        base = atomic ( box = (0.6, 0.6, 0.05), pos = (0, 0, 0.025), mass = 20 );
        block = atomic ( box = (0.2, 0.2, 0.2), pos = (0.2, 0, 0.15), mass = 60 )""",
    "wall": """root = w; w = mate ( floor, wall );
        floor = atomic ( box = (2.25, 1.5, 0.075), pos = (0, 0, 0.0375), density = 500 );
        wall = atomic ( box = (0.075, 1.5, 1.5), pos = (-1.0875, 0, 0.825), density = 500 )""",
}


@pytest.mark.parametrize("force", [3.0, 6.0])
@pytest.mark.parametrize("text", HEAVY.values(), ids=HEAVY)
def test_heavy_parts_do_not_swing(text: str, force: float) -> None:
    """Forty times what a robot weighs: its motor's inertia keeps the weld stiff that holds them."""
    run = factory.run(floor_of(text), units=4, settings=Settings(force=force))
    assert run.products == 4 and run.cycle_time_s is not None
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)
    assert_good(run)


def test_a_stuck_robot_is_a_stall(paper: Layout) -> None:
    """Planted fault: robot r5's drive does nothing."""
    simulation = Simulation(paper, RunRequest(units=1))
    m = simulation.physical.m
    m.actuator_biasprm[4, 1:3] = 0.0
    m.actuator_gaintype[4] = 0
    m.actuator_gainprm[4] = 0.0
    run = simulation.run()
    assert run.trouble is not None
    assert run.trouble.code == "Stalled"
    assert "r5 in" in run.trouble.message
    assert run.trouble.position is not None


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


def test_robots_stop_where_their_operation_ends(paper: Layout) -> None:
    """They may hand over at up to 10 mm/s, which as a setpoint would drag them out of the goal."""
    settings = Settings(timestep=1e-4, substeps=5)
    simulation = Simulation(paper, RunRequest(units=2, settings=settings))
    run = simulation.run()
    assert_good(run)
    motion, m, d = (getattr(simulation.physical, name) for name in ("motion", "m", "d"))
    control = m.actuator_ctrladr[motion.drives._actuators]
    assert np.all(d.ctrl[control[: motion.axes.tray] + 1] == 0.0)
    assert np.all(motion.robots.v[: motion.axes.tray] == 0.0)


def test_a_shifted_weld_shows_in_the_gap(paper: Layout) -> None:
    """Planted fault: one nominal frame is 2 mm off."""
    simulation = Simulation(paper, RunRequest(units=1))
    m = simulation.physical.m
    m.eq_data[m.equality("grip/r3/part1").id, 3] += 0.002
    run = simulation.run()
    assert run.physics is not None
    assert run.physics.handoff_gap_max_mm > 1.0


def test_each_robot_has_its_own_speed(paper: Layout) -> None:
    limits = Simulation(paper, RunRequest(world="ideal", jitter=0.3, seed=1)).limits
    assert len(set(limits.speed)) == len(limits.speed)
    assert np.all((limits.speed >= 0.35) & (limits.speed <= 0.65))


def test_templates_of_the_user_run_without_a_change_of_code(tmp_path) -> None:
    (tmp_path / "rivet.op").write_text(
        """rivet = (R, j, ~, <a; b>, F) where R = < dot, tool >; j = 1; ~ = { S1 = A2 };
        <a; b> = < LAB1, nopart; LAB2, nopart >;
        F = navigation on W to ( S1 + 2r, A2 + 2r ) within eps for dwell;
        parameters = ( dwell = 0.8 );"""
    )
    (tmp_path / "p.pag").write_text(
        "root = c; c = rivet ( b, dwell = 0.3 ); b = mate ( x, y );"
        "x = atomic ( box = (0.1, 0.04, 0.02) ); y = atomic ( sphere = 0.02, pos = (0, 0, 0.05) )"
    )
    assert "rivet" in all_templates([tmp_path])
    pag = factory.load_pag(tmp_path / "p.pag", [tmp_path])
    plan = factory.compile(pag, [tmp_path])
    assert_good(factory.run(factory.lay_out(plan), units=2))


def test_the_tray_is_looked_for_until_it_has_come_home() -> None:
    """What has asked for it in vain does not ask again before something has changed; that it ought
    to be home is not enough, where something has held it."""
    simulation = ready("paper", units=1)
    world, dropoff = simulation.physical, simulation.layout.factory.dropoff
    outfeed = world.motion.outfeed
    while not world.delivered():
        simulation.supervisor.step()
    assert not world.prepared(dropoff, 1)
    assert outfeed.goal == 0.0 and outfeed.busy and not outfeed.rests()
    until = world.time + 3.0
    while world.time < until:
        if world.time < until - 1.0:
            world.d.joint("outfeed/slide").qpos = 0.01
            assert outfeed.busy
        simulation.supervisor.step()
    assert world.prepared(dropoff, 1) and not outfeed.busy


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


def test_what_is_under_way_is_what_is_being_joined() -> None:
    """In every tick: the operations under way, with their units."""
    simulation = ready("paper", start=random_marking(laid_out(PAPER), 3))
    world, supervisor = simulation.physical, simulation.supervisor
    while world.delivered() < simulation.before + 2:
        joining = world.inspection.joining
        assert set(joining) == set(supervisor.active.operations)
        fired = supervisor.fired
        for number, unit in joining.items():
            assert fired[simulation.layout.factory.operations[number].end] == unit
        supervisor.step()


def test_busy_times_are_those_of_operations_that_have_ended() -> None:
    """`sub1` was under way from the beginning, and `sub2` is at the end."""
    plan = laid_out(PAPER).factory
    sub1 = plan.by_label["sub1"]
    fired = ((2.0, "sub1_e"), (3.0, "sub2_s"), (3.5, "sub1_s"), (4.25, "sub1_e"))
    busy = busy_times(plan, [Event(*event) for event in fired])
    assert {robot for robot, spent in enumerate(busy) if spent == 2.75} == {*sub1.robots}
    assert sum(busy) == 2.75 * len(sub1.robots)


def test_a_pace_that_is_settling_is_not_the_cycle_time(tmp_path: Path) -> None:
    """Where robots before the bottleneck fill first, by the timed net too."""
    file = tmp_path / "product.pag"
    file.write_text(random_product(291300098))
    layout = read(file).layout
    run = Simulation(layout, RunRequest("ideal", 8)).run()
    assert run.cycle_time_s is None and "not yet steady" in str(run.cycle_time_missing)
    run = Simulation(layout, RunRequest("ideal", 32)).run()
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.005)
