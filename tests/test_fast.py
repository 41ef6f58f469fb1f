"""What only makes the MuJoCo world faster changes nothing: with it and without, and however many
ticks go to the engine in one call, a run is the same to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from factory.layout.layout import Layout
from factory.record.figures import PhysicsFigures
from factory.record.state import Event
from factory.simulation.disturbance import Gain, Mass, Noise, Push, disturb
from factory.simulation.disturbance.interventions import Interventions
from factory.simulation.mujoco import outfeed
from factory.simulation.mujoco.courses import AHEAD, Follower
from factory.simulation.mujoco.fast import neighbours, strides
from factory.simulation.mujoco.world import MujocoWorld
from factory.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.settings import LOOK, MOST, Settings
from tests.command_line import PAPER, Terminal
from tests.good_runs import random_marking
from tests.layout_values import random_layout
from tests.pag_texts import OVERLAP, laid_out
from tests.pag_values import SHAPES
from tests.simulation_values import FINE, gone_wild, ready, state, states, stepping

LONG = 60.0
"""No run of these tests lasts that long [s]."""


@pytest.fixture(autouse=True)
def _neighbours_in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


@dataclass
class Trace:
    """Where everything is, by timestep, after each call of the supervisor; what fired and when; the
    figures."""

    states: dict[int, bytes] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    dropoffs: list[float] = field(default_factory=list)
    figures: PhysicsFigures = field(default_factory=PhysicsFigures)

    def agrees(self, other: Trace) -> bool:
        """Whether they are the same wherever both have been looked at, and at their ends."""
        both = self.states.keys() & other.states.keys()
        return (
            max(both) == max(self.states) == max(other.states)
            and all(self.states[step] == other.states[step] for step in both)
            and (self.events, self.dropoffs) == (other.events, other.dropoffs)
            and self.figures == other.figures
        )


def traced(simulation: Simulation, ticks: int, until: float = LONG) -> Trace:
    """A run that is asked for so many ticks at a time."""
    world, trace = simulation.physical, Trace()
    goal = simulation.before + simulation.request.units
    tick = world.model.settings.tick
    while world.delivered() < goal and (left := round((until - world.time) / tick)) > 0:
        simulation.supervisor.step(min(ticks, left))
        step = round(world.time / world.m.opt.timestep)
        trace.states[step] = world.d.qpos.tobytes() + world.d.qvel.tobytes()
    trace.events = [*simulation.supervisor.events]
    trace.dropoffs, trace.figures = [*world.dropoffs], world.figures()
    return trace


@cache
def kept(name: str, ticks: int, **given: Any) -> Trace:
    """The trace of a run that several tests look at."""
    return traced(ready(name, **given), ticks)


CASES: list[Any] = [
    ("paper", {}),
    ("truck", {"fuse": True}),
    pytest.param("gearbox", {"fuse": True}, marks=pytest.mark.slow),
    pytest.param("chest", {}, marks=pytest.mark.slow),
    ("chest", {"settings": replace(FINE, stage=1)}),
    ("lamp", {"settings": Settings(timestep=0.01, substeps=1, stage=1)}),
    ("20", {"wip": 1}),
    ("20", {"fuse": True, "jitter": 0.0}),
    ("shelf", {"settings": Settings(timestep=0.004, substeps=5)}),
    ("paper", {"settings": Settings(timestep=0.001, substeps=12)}),
    ("paper", {"settings": Settings(timestep=0.005, substeps=11)}),
    ("fence", {}),
]


@pytest.mark.parametrize(("name", "given"), CASES)
def test_a_run_is_the_same_without_what_makes_it_faster(name: str, given: dict[str, Any]) -> None:
    """Events, gaps, residuals, forces, and the state wherever both are looked at."""
    plain = traced(ready(name, fast=False, **given), 1)
    fast = kept(name, MOST, **given)
    assert len(plain.dropoffs) == 2 and fast.agrees(plain)
    assert plain.figures.handoff_gap_max_mm > 0.0 < plain.figures.weld_residual_max_mm
    long = given.get("settings", FINE).stride > 1
    assert len(fast.states) < (0.7 if long else 1.01) * len(plain.states)


@pytest.mark.parametrize(("name", "given"), [CASES[0], CASES[4], CASES[11]])
def test_one_tick_a_call_or_many_is_the_same(name: str, given: dict[str, Any]) -> None:
    singly, many = (kept(name, ticks, **given) for ticks in (1, MOST))
    assert many.agrees(singly)


@pytest.mark.parametrize("name", ["paper", "fence", pytest.param("20", marks=pytest.mark.slow)])
def test_a_distributed_run_is_the_same_without_it(name: str) -> None:
    fast, plain = (traced(ready(name, distributed=True, fast=f), 1) for f in (True, False))
    assert len(fast.dropoffs) == 2 and fast.agrees(plain)


@pytest.mark.parametrize(("name", "seed"), [("paper", 0), ("paper", 3), ("lamp", 1), ("fence", 2)])
def test_a_run_from_a_marking_is_the_same_without_it(name: str, seed: int) -> None:
    start = random_marking(ready(name).layout, seed)
    fast = traced(ready(name, start=start), MOST)
    assert len(fast.dropoffs) == 2
    assert fast.agrees(traced(ready(name, start=start, fast=False), 1))


@pytest.mark.parametrize("number", range(6))
def test_random_products_are_made_the_same_without_it(number: int) -> None:
    style = ("small", "medium", "large", "far", "mixed", "plain")[number]
    layout = random_layout(5 + number, number, SHAPES[number % len(SHAPES)], style)
    given = {"fuse": number % 2 == 1, "units": 1}
    fast = traced(ready(layout, **given), MOST)
    assert len(fast.dropoffs) == 1
    assert fast.agrees(traced(ready(layout, fast=False, **given), 1))


def test_observers_make_no_difference() -> None:
    """One that observes sees every tick; one that glances, the ends of calls."""
    glanced, seen = list[float](), list[float]()
    first, second = ready("chest", units=1), ready("chest", units=1)
    one = first.run(glances=[lambda state: glanced.append(state.time)])
    other = second.run([lambda state: seen.append(state.time)], glances=[lambda *_: None])
    assert glanced[-1] == seen[-1] and set(glanced) <= set(seen)
    assert len(seen) == round(seen[-1] / 0.01) and len(glanced) < 0.5 * len(seen)
    assert (one.events, one.physics) == (other.events, other.physics)
    assert (first.physical.d.qpos == second.physical.d.qpos).all()


# --- contacts, pushes and disturbances ------------------------------------------------------------


def wild(seed: int, fast: bool) -> tuple[list[bytes], list[tuple[str, str]]]:
    """States, and the contacts, of a run whose robots go through each other."""
    simulation = ready("20", fast=fast, distributed=True)
    found = states(simulation, gone_wild(simulation, seed), 150)
    return found, simulation.physical.inspection.unintended


@pytest.mark.parametrize("seed", range(3))
def test_collisions_are_the_same_without_it(seed: int) -> None:
    fast, plain = (wild(seed, f) for f in (True, False))
    assert fast[1] and fast == plain


@pytest.mark.parametrize("seed", [3, 4])
def test_sudden_collisions_are_the_same_without_it(seed: int) -> None:
    """At four hundred metres a second squared, if the settings ask for that."""
    found = []
    for fast in (True, False):
        quick = replace(FINE, acceleration=400.0, speed=10.0)
        simulation = ready("20", fast=fast, distributed=True, settings=quick)
        rng, world = np.random.default_rng(seed), simulation.physical
        for _ in range(60):
            simulation.supervisor.step()
        axes = rng.choice(world.motion.axes.tray, 6, replace=False)
        force = rng.choice([-1, 1], 6) * 360.0
        world.move(axes, world.motion.robots.x[axes], np.zeros(6), force)
        seen = states(simulation, lambda world=world: world.advance(5), 30)  # type: ignore[misc]
        found.append((seen, world.inspection.unintended))
    assert found[0] == found[1]


BLOCKS = OVERLAP.replace("mate(u, v)", "mate(u, v, w, x)") + (
    "; w = atomic(box = (0.05, 0.05, 0.06), pos = (0, -0.1, 0));"
    "x = atomic(box = (0.05, 0.05, 0.06), pos = (0.1, -0.1, 0))"
)


def too_tight() -> Layout:
    """Two parts are wider than the floor was laid out for."""
    layout = laid_out(BLOCKS)
    wide = laid_out(BLOCKS.replace("box = (0.05, 0.05", "box = (0.12, 0.12"))
    return with_parts(layout, {label: wide.product.solids[label] for label in ("w", "x")})


def on_the_wrong_side() -> Layout:
    """Two parts have changed places."""
    layout = laid_out(BLOCKS)
    solids = layout.product.solids
    return with_parts(layout, {"a": solids["c"], "c": solids["a"]})


def with_parts(layout: Layout, solids: dict[str, Any]) -> Layout:
    """A layout whose product has other parts than it was made for."""
    product = replace(layout.product, solids={**layout.product.solids, **solids})
    return replace(layout, product=product)


@pytest.mark.parametrize(
    ("make", "fuse"),
    [
        (too_tight, True),
        (on_the_wrong_side, False),
        pytest.param(too_tight, False, marks=pytest.mark.slow),
        pytest.param(on_the_wrong_side, True, marks=pytest.mark.slow),
    ],
)
def test_parts_that_touch_do_so_without_it(make: Callable[[], Layout], fuse: bool) -> None:
    layout = make()
    # later on the engine gives parts up that are pressed into each other
    fast, plain = (traced(ready(layout, fuse=fuse, fast=f), MOST, 2.0) for f in (True, False))
    assert fast.figures.unintended_contacts > 0
    assert fast.agrees(plain)


def pushed(seed: int, fast: bool, ticks: int) -> tuple[list[bytes], list[tuple[str, str]]]:
    """States, and contacts, of a run without end stops in which one robot after the other is pushed
    into whatever is there, let go, and comes back."""
    simulation = ready("20", fast=fast)
    world, rng = simulation.physical, np.random.default_rng(seed)
    world.m.jnt_limited[:] = False
    hands, found = Interventions(simulation), []
    for number in range(15):
        traced(simulation, ticks, 0.8 + 0.3 * number)
        found.append(state(simulation))
        robot = int(rng.integers(len(simulation.layout.factory.robots)))
        hands.push(robot, float(rng.uniform(-3, 3)), 0.2)
    return found, world.inspection.unintended


@pytest.mark.parametrize("seed", [3, pytest.param(7, marks=pytest.mark.slow)])
def test_pushed_robots_meet_the_same_without_it(seed: int) -> None:
    """They come back while other modes begin, through what rests there."""
    fast, plain = pushed(seed, True, MOST), pushed(seed, False, 1)
    assert fast[1] and fast == plain


DISTURBANCES: list[tuple[Any, ...]] = [
    (Gain(0.5),),
    (Noise(1e-4, 0.0, 1),),
    (Push("r1/carriage", (3.0, 3.0, 0.0), 0.5, 0.2),),
    (Mass(6.0),),
]


@pytest.mark.parametrize("wanted", DISTURBANCES, ids=lambda given: type(given[0]).__name__)
def test_disturbed_runs_are_the_same_without_it(wanted: tuple[Any, ...]) -> None:
    """What acts before every timestep does so within calls of many."""
    found = []
    for fast, ticks in ((True, MOST), (False, 1)):
        simulation = disturb(ready("20", fast=fast), *wanted)
        found.append(traced(simulation, ticks, 4.0))
    assert found[0].events and found[0].agrees(found[1])


# --- going back -----------------------------------------------------------------------------------


def one_by_one(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
    """A call of several steps is taken for one in which contacts came and went."""
    mujoco.mj_step(m, d, steps)
    if steps > 1:
        d.maxuse_con = 1


def never_at_once(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
    """A call of several steps does nothing, and is said to have had contacts."""
    if steps > 1:
        d.maxuse_con = 1
    else:
        mujoco.mj_step(m, d)


GONE_BACK = [CASES[0], CASES[11], CASES[4], CASES[7], CASES[9], ("paper", {"distributed": True})]


@pytest.mark.parametrize(("name", "given"), GONE_BACK)
def test_what_goes_back_comes_to_the_same_state(name: str, given: dict[str, Any]) -> None:
    """All steps are taken at once, and then one by one from where those began."""
    expected = traced(ready(name, **given), MOST, 4.0)
    with stepping(one_by_one):
        assert traced(ready(name, **given), MOST, 4.0).agrees(expected)


@pytest.mark.parametrize("step", [one_by_one, never_at_once])
def test_contacts_are_seen_that_are_seen_one_by_one(step: Callable[..., None]) -> None:
    expected = wild(1, True)
    with stepping(step):
        assert wild(1, True) == expected
    assert expected[1]


class Forgetful:
    """The engine, but what goes back forgets something."""

    def __init__(self, forget: Callable[[mujoco.MjData], None]) -> None:
        self._forget = forget

    def mj_copyData(self, to: Any, m: Any, since: Any) -> None:
        goes_back = to.time > since.time
        mujoco.mj_copyData(to, m, since)
        if goes_back:
            self._forget(to)

    def __getattr__(self, name: str) -> Any:
        return getattr(mujoco, name)


def _warmstart(d: mujoco.MjData) -> None:
    d.qacc_warmstart[:] = 0.0


def _time(d: mujoco.MjData) -> None:
    d.time += 0.002


def _setpoints(d: mujoco.MjData) -> None:
    d.history[len(d.history) // 2 :] *= 1.001


@pytest.mark.parametrize("forget", [_warmstart, _time, _setpoints])
def test_what_forgets_something_does_not(
    forget: Callable[[mujoco.MjData], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted faults."""
    expected = traced(ready("paper"), MOST, 2.0)
    monkeypatch.setattr(strides, "mujoco", Forgetful(forget))
    with stepping(one_by_one):
        assert not traced(ready("paper"), MOST, 2.0).agrees(expected)


# --- how many ticks go to the engine --------------------------------------------------------------


@pytest.mark.parametrize("name", ["chest", "fence", "20"])
def test_a_call_lasts_until_something_asks_for_the_supervisor(name: str) -> None:
    """Something fires, a mode may have come to its goal, a stride is over, the tray is under way,
    or a part or hand that is waited for may have come or gone."""
    simulation = ready(name)
    supervisor, world = simulation.supervisor, simulation.physical
    for_a_reason, tray = True, False
    while world.delivered() < 2:
        fired = len(supervisor.events)
        supervisor.step(MOST)
        assert for_a_reason or len(supervisor.events) > fired
        before, tray = tray, world.motion.outfeed.moves
        stride_is_over = not world.motion.robots.left
        for_a_reason = stride_is_over or supervisor.near or before or tray
        held, at = supervisor.ordering.held, world.motion.robots.x
        may_be_past = [(past.at - at[past.axis]) * past.direction <= AHEAD for past in held]
        for_a_reason |= world.supplied or supervisor.enabled or any(may_be_past)


def test_a_pass_that_comes_unseen_is_seen_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: courses go on where what is waited for may have come past."""
    singly = kept("chest", 1)
    monkeypatch.setattr(Follower, "until", lambda self, past: self.left)
    assert not traced(ready("chest"), MOST).agrees(singly)


def test_a_tray_that_comes_unseen_is_seen_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: the tray's courses do not end where it may have come to its goal."""
    singly = kept("chest", 1)
    monkeypatch.setattr(outfeed, "CLOSE", 0.0)
    assert not traced(ready("chest"), MOST).agrees(singly)


def test_a_goal_that_comes_unseen_is_seen_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: courses go on where a mode may have come to its goal."""
    singly = kept("paper", 1)
    monkeypatch.setattr(Follower, "near", property(lambda self: not self.left))
    from factory.control.navigation import Bundle

    monkeypatch.setattr(Bundle, "near_goal", lambda *_: False)
    assert not traced(ready("paper"), MOST).agrees(singly)


@pytest.mark.parametrize("timestep", [1e-5, 1e-3, 2e-3, 4e-3, 2e-2])
@pytest.mark.parametrize("substeps", [1, 5, 100])
def test_a_stride_is_no_longer_than_a_look(timestep: float, substeps: int) -> None:
    settings = Settings(timestep=timestep, substeps=substeps)
    assert 1 <= settings.stride <= MOST
    assert settings.stride == 1 or settings.stride * settings.tick <= LOOK + 1e-12
    assert settings.samples == settings.stride * substeps + 2


def test_no_more_is_simulated_than_was_asked_for() -> None:
    run = ready("paper", units=5).run(max_time=1.23)
    assert run.sim_time_s == pytest.approx(1.23) and run.trouble is not None


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_the_run_of_a_shell_takes_many_ticks_a_call(
    run: Terminal, more: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls, step = list[int](), MujocoWorld.step

    def counted(self: MujocoWorld, bundle: Any, axes: Any, ticks: int, until: Any) -> bool:
        calls.append(ticks)
        return step(self, bundle, axes, ticks, until)

    monkeypatch.setattr(MujocoWorld, "step", counted)
    run("run", PAPER, *more)
    assert max(calls) == MOST
