"""What only makes the MuJoCo world faster changes nothing: with it and without, and however many
ticks go to the engine in one call, a run is the same to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from factory.apps.live.interventions import Interventions
from factory.engine.simulation.mujoco.courses import AHEAD
from factory.engine.simulation.mujoco.fast import neighbours
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.settings import LOOK, MOST, Settings
from tests.command_line import Terminal
from tests.pag_texts import OVERLAP, compiled, laid_out
from tests.paths import PAPER
from tests.simulation_values import FINE, gone_wild, ready, state, states, stepping


@pytest.fixture(autouse=True)
def _neighbours_in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


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
    wide = product_geometry(compiled(BLOCKS.replace("(0.05, 0.05", "(0.12, 0.12")).pag)
    return with_parts(layout, {label: wide.solids[label] for label in ("w", "x")})


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
        *(
            pytest.param(make, fuse, marks=pytest.mark.slow)
            for make, fuse in ((on_the_wrong_side, False), (too_tight, False))
        ),
    ],
)
def test_parts_that_touch_do_so_without_it(make: Callable[[], Layout], fuse: bool) -> None:
    layout, found = make(), []
    for fast in (True, False):
        simulation = ready(layout, fuse=fuse, fast=fast)
        seen = states(simulation, simulation.supervisor.step, 200)
        found.append((seen, simulation.physical.inspection.unintended))
    assert found[0][1]
    assert found[0] == found[1]


def pushed(seed: int, fast: bool, ticks: int) -> tuple[list[bytes], list[tuple[str, str]]]:
    """States, and contacts, of a run without end stops in which one robot after the other is pushed
    into whatever is there, let go, and comes back."""
    simulation = ready("20", fast=fast)
    world, rng = simulation.physical, np.random.default_rng(seed)
    world.m.jnt_limited[:] = False
    hands, found = Interventions(simulation), []
    for number in range(15):
        while (left := round((0.8 + 0.3 * number - world.time) / FINE.tick)) > 0:
            simulation.supervisor.step(min(ticks, left))
        found.append(state(simulation))
        robot = int(rng.integers(len(simulation.layout.factory.robots)))
        hands.push(robot, float(rng.uniform(-3, 3)), 0.2)
    return found, world.inspection.unintended


@pytest.mark.parametrize("seed", [3, pytest.param(7, marks=pytest.mark.slow)])
def test_pushed_robots_meet_the_same_without_it(seed: int) -> None:
    """They come back while other modes begin, through what rests there."""
    fast, plain = pushed(seed, True, MOST), pushed(seed, False, 1)
    assert fast[1] and fast == plain


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


@pytest.mark.parametrize("step", [one_by_one, never_at_once])
def test_contacts_are_seen_that_are_seen_one_by_one(step: Callable[..., None]) -> None:
    expected = wild(1, True)
    with stepping(step):
        assert wild(1, True) == expected
    assert expected[1]


# --- how many ticks go to the engine --------------------------------------------------------------


@pytest.mark.parametrize("name", ["chest", "fence", "20"])
def test_a_call_lasts_until_something_asks_for_the_supervisor(name: str) -> None:
    """Something fires, a mode may have come to its goal, a stride is over, the tray is under way,
    a slider is up, or a part, hand or robot that is waited for may have come or gone."""
    simulation = ready(name)
    supervisor, world = simulation.supervisor, simulation.physical
    for_a_reason, tray = True, False
    while world.delivered() < 2:
        fired, sliders = len(supervisor.events), world.motion.sliders
        due = min(sliders.up, world.parts.feeders.clear_from)
        supervisor.step(MOST)
        assert for_a_reason or len(supervisor.events) > fired
        before, tray = tray, world.motion.outfeed.moves
        stride_is_over = not world.motion.robots.left
        for_a_reason = stride_is_over or supervisor.near or before or tray or due <= sliders.now
        held, at = supervisor.ordering.held, world.motion.robots.x
        may_be_past = [(past.at - at[past.axis]) * past.direction <= AHEAD for past in held]
        for_a_reason |= world.supplied or supervisor.enabled or any(may_be_past)


@pytest.mark.parametrize("asked", ["", "sensors", "before_step"])
def test_a_clock_that_runs_asks_for_nobody(asked: str) -> None:
    """A call lasts until the clock has run out; where sensors may err, or something may push them,
    robots are asked in every tick whether they are still there."""
    simulation = ready("paper", settings=Settings(), jitter=0.0)
    supervisor, hooks, ticks = simulation.supervisor, simulation.world.hooks, list[int]()
    hooks.sensors.extend([lambda x, v: (x, v)] * (asked == "sensors"))
    hooks.before_step.extend([lambda: None] * (asked == "before_step"))
    while simulation.world.delivered() < 2:
        begun, fired = simulation.world.time, len(supervisor.events)
        supervisor.step(MOST)
        clocks = supervisor.active.clocks
        if clocks is not None and clocks.any() and len(supervisor.events) == fired:
            ticks.append(round((simulation.world.time - begun) / supervisor.tick))
            assert not (asked and supervisor.active.clocked)
    assert len(ticks) > 5 and (np.mean(ticks) > 3) == (not asked), ticks


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
