"""The timestep that the factory chooses: the longest that its drives allow, and no longer."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from functools import cache
from math import inf
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import factory
from factory.apps.fidelity.record import QUANTITIES
from factory.engine.mjcf import driving, timestep
from factory.engine.mjcf.driving import ALLOWED, STEPS
from factory.engine.mjcf.timestep import USUAL, timed
from factory.engine.record.state import State
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.pipeline import read
from factory.support.errors import InputError
from factory.support.resources import mjcf_folder
from factory.support.settings import AUTO, TICK, Settings
from factory.theory.problem.pag import PAG, Parameter
from factory.theory.problem.robot_bodies import FRICTION
from tests.command_line import Terminal
from tests.layout_values import STYLES, shaped
from tests.pag_values import SHAPES, random_pag
from tests.paths import PAPER
from tests.simulation_values import layout_of

layout = cache(layout_of)

SMALLEST_OF_LAMP = 0.064745656
"""Diagonal of the holder, the smallest part of examples/lamp.pag [m]."""

LIMITS = ("tracking_error_max_mm", "handoff_gap_max_mm", "weld_residual_max_mm")
"""The figures that a timestep is chosen by."""


def weighed(seed: int) -> PAG:
    """A random product with shapes, whose parts weigh from 1 g to 100 kg."""
    rng = random.Random(seed)
    pag = random_pag(rng.randint(2, 9), seed, rng.choice(SHAPES))
    pag = shaped(pag, seed, rng.choice(STYLES), base=rng.random() < 0.5)
    scale, nodes = 10 ** rng.uniform(-3, 2), []
    for node in pag.nodes:
        changed = replace(node, operation="weld") if node.operation == "clamp" else node
        if not node.inputs:
            mass = min(100.0, max(1e-3, scale * 10 ** rng.uniform(-1, 1)))
            kept = tuple(p for p in node.parameters if p.name != "mass")
            changed = replace(node, parameters=(*kept, Parameter("mass", mass)))
        nodes.append(changed)
    return replace(pag, nodes=tuple(nodes))


def asked(seed: int) -> tuple[Settings, float]:
    """Random settings, the timestep left to the factory, and a jitter."""
    rng = random.Random(f"settings {seed}")

    def between(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    settings = Settings(
        speed=between(0.05, 2),
        acceleration=between(0.5, 10),
        clearance=between(0.005, 0.05),
        outfeed=between(0.3, 2),
        force=rng.choice((1.5, 3.0, 6.0)),
        stage=rng.randint(0, 1),
    )
    return settings, rng.choice((0.0, 0.3, 0.3, 0.6, 0.9))


@cache
def laid(seed: int) -> Layout:
    made = factory.compile(weighed(seed))
    return Ground().lay_out(made, product_geometry(made.pag), asked(seed)[0])


def predicted_error(settings: Settings, layout: Layout, jitter: float) -> float:
    """The largest error of an axis against its reference that a run may show [m]; a gap between two
    robots, and the residual of a weld, may be twice that."""
    return max(axis.error(settings) for axis in timestep._axes(settings, layout, jitter))


def measured(
    simulation: Simulation, max_time: float | None = None, touching: bool = False
) -> dict[str, float]:
    """The figures that a timestep is chosen by, of a run that goes well, but for things that touch
    where they may."""
    world, worst = simulation.physical, [0.0]
    qpos = world.motion.axes.qpos
    control = world.m.actuator_ctrladr[world.motion.drives._actuators]

    def observe(_: State) -> None:
        error = np.abs(world.d.qpos[qpos] - world.d.ctrl[control])
        worst[0] = max(worst[0], float(error.max()))

    run = simulation.run([observe], max_time)
    assert run.trouble is None, str(run.trouble)
    assert run.physics is not None
    assert run.refines_net
    assert touching or run.physics.unintended_contacts == 0, run.physics.contacts
    gap, residual = run.physics.handoff_gap_max_mm, run.physics.weld_residual_max_mm
    return dict(zip(LIMITS, (1e3 * worst[0], gap, residual), strict=True))


# --- what is chosen -------------------------------------------------------------------------------


def test_it_is_half_of_what_a_good_factory_keeps() -> None:
    assert {QUANTITIES[key].limit for key in LIMITS} == {2e3 * ALLOWED}


def test_friction_is_that_of_the_robot_types_and_the_tray() -> None:
    files = [ElementTree.parse(path) for path in sorted(mjcf_folder().rglob("*.xml"))]
    joints = (j for file in files for j in file.iter("joint") if j.get("type") != "hinge")
    found = {j.get("frictionloss") for j in joints}
    tray = re.findall(r'frictionloss="([^"]*)"', physical_model(layout("paper"), 1).xml)
    assert {float(text) for text in (*filter(None, found), *tray)} == {FRICTION}


@pytest.mark.parametrize(
    ("settings", "jitter", "found"),
    [
        (Settings(), 0.0, 0.01),
        (Settings(), 0.3, 0.01),
        (Settings(), 0.9, 0.002),  # friction alone holds the weakest drives off
        (Settings(acceleration=10.0), 0.0, 0.005),
        (Settings(clearance=0.01), 0.0, 0.005),  # the tray goes 10 mm in 10 ms
        (Settings(clearance=0.0005), 0.0, 0.0005),
        (Settings(clearance=0.0001), 0.0, 0.0005),
        (Settings(speed=1.5), 0.5, 0.005),  # the fastest robot goes 22.5 mm in 10 ms
        (Settings(eps=2e-5), 0.0, 0.005),
        (Settings(substeps=3), 0.0, 0.0025),
        (Settings(substeps=5), 0.0, 0.002),
        (Settings(substeps=50), 0.0, TICK / 50),
        (Settings(timestep=0.004), 0.0, 0.004),
    ],
)
def test_what_is_chosen_for_the_papers_example(
    settings: Settings, jitter: float, found: float
) -> None:
    floor = replace(layout("paper"), clearance=settings.clearance)
    made = timed(settings, floor, jitter=jitter)
    assert made.timestep == pytest.approx(found)
    assert timed(made, floor, jitter=jitter) == made


@pytest.mark.parametrize(
    ("timestep", "steps"),
    [(0.0001, 100), (0.002, 5), (0.003, 3), (0.004, 2), (0.01, 1), (0.02, 1), (1e-5, 100)],
)
def test_a_tick_has_the_timesteps_that_ten_milliseconds_have_room_for(
    timestep: float, steps: int
) -> None:
    settings = timed(Settings(timestep=timestep), layout("paper"))
    assert (settings.timestep, settings.substeps) == (timestep, steps)
    given = timed(Settings(timestep=timestep, substeps=7), layout("paper"))
    assert (given.timestep, given.substeps) == (timestep, 7)


@given(
    speed=st.floats(0.01, 5),
    acceleration=st.floats(0.1, 50),
    clearance=st.floats(1e-3, 0.1),
    eps=st.floats(1e-5, 1e-2),
    jitter=st.floats(0, 0.9),
    least=st.none() | st.integers(1, 100),
    world=st.sampled_from(("mujoco", "ideal")),
)
def test_it_is_the_longest_that_is_good(
    speed: float,
    acceleration: float,
    clearance: float,
    eps: float,
    jitter: float,
    least: int | None,
    world: Any,
) -> None:
    """A tick is what it was before anything was chosen; what moves fastest goes less than the
    clearance in a timestep; the error is small; a longer timestep would break one of these."""
    settings = Settings(speed, acceleration, eps, clearance=clearance, substeps=least)
    floor = replace(layout("lamp"), clearance=clearance)
    made = timed(settings, floor, world, jitter)
    assert made.tick == pytest.approx(settings.tick) == pytest.approx(TICK)
    assert made.steps >= (least or 1)
    if world == "ideal":
        assert made.steps == next((n for n in STEPS if n >= max(least or 1, USUAL)), least)
        return

    def good(one: Settings) -> bool:
        fastest = max(speed * (1 + jitter), settings.outfeed)
        still = timestep._impact(one, SMALLEST_OF_LAMP) < timestep.TURNED
        axes = tuple(timestep._axes(settings, floor, jitter))
        return fastest * one.step < clearance and still and timestep._good(one, axes)

    longer = [
        replace(made, timestep=TICK / n, substeps=n)
        for n in STEPS
        if (least or 1) <= n < made.steps
    ]
    if good(made):
        assert predicted_error(made, floor, jitter) < ALLOWED
        assert not any(map(good, longer))
    else:
        assert made.steps >= USUAL
        assert not any(map(good, longer))


# --- what was predicted is so ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        ("paper", 0),
        ("gearbox", 0),
        *(
            pytest.param(name, seed, marks=pytest.mark.slow)
            for name in ("truck", "chest")
            for seed in (0, 1)
        ),
    ],
)
def test_products_keep_half_their_limits(name: str, seed: int) -> None:
    simulation = Simulation(layout(name), RunRequest(units=2, seed=seed, jitter=0.3))
    found = measured(simulation)
    made = layout(name).factory
    lifts = len(made.axes) > len(made.robots)
    assert simulation.request.settings.timestep == (TICK / 2 if lifts else TICK)
    error = 1e3 * predicted_error(simulation.request.settings, layout(name), 0.3)
    assert max(found.values()) < error < 1e3 * ALLOWED


SEEDS = range(12, 18)
ALL = [SEEDS, pytest.param(range(24), marks=pytest.mark.slow)]


def outcomes(seeds: range = SEEDS, touching: bool = False) -> list[tuple[float, float, float]]:
    """Of random products and settings: the timestep, the error predicted for a drive and the
    largest measured, half of that of two drives that meet [mm], of those that have a good timestep;
    things may touch if told so."""
    found = []
    for seed in seeds:
        settings, jitter = asked(seed)
        try:
            floor = laid(seed)
        except factory.errors.FactoryError:
            continue
        made = timed(settings, floor, jitter=jitter)
        error = predicted_error(made, floor, jitter)
        if error < ALLOWED:
            simulation = Simulation(
                floor, RunRequest(units=2, seed=seed, jitter=jitter, settings=settings)
            )
            assert simulation.request.settings == made
            tracking, *of_two = measured(simulation, touching=touching).values()
            found.append((made.step, 1e3 * error, max(tracking, max(of_two) / 2)))
    return found


@pytest.mark.parametrize("seeds", ALL, ids=len)
def test_random_products_with_random_settings_keep_their_limits(seeds: range) -> None:
    """All half of them; and hardly one is farther off than it was predicted to be."""
    found = outcomes(seeds)
    assert len(found) >= len(seeds) / 2
    assert {step for step, *_ in found} >= {0.01, 0.005}
    assert max(most for *_, most in found) < 1e3 * ALLOWED
    assert sum(most > error for _, error, most in found) <= len(found) / 10


def test_a_prediction_that_promises_too_much_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driving, "SURE", 0.2)
    monkeypatch.setattr(driving, "OVERLOAD", -1.0)  # nor do end stops ask for a shorter one
    monkeypatch.setattr(timestep, "DEEPEST", inf)  # nor what hangs from feeders
    monkeypatch.setattr(timestep, "IMPACT", 0.0)  # nor parts that meet
    found = outcomes(touching=True)  # a shutter that overshoots so far meets the belt
    assert sum(most > error for _, error, most in found) > len(found) / 3
    assert max(most for *_, most in found) > 1e3 * ALLOWED


TINY = """root = s3;
s1 = mate ( p1, p0 );  s1t = press ( s1, dwell = 0.016 );  s3 = mate ( p2, s1t );
p0 = atomic ( box = ( 0.0008, 0.0048, 0.0016 ), pos = ( 0, 0, 0.0008 ) );
p1 = atomic ( box = ( 0.0024, 0.0080, 0.0016 ), pos = ( 0.00072, -0.0064, 0.0008 ) );
p2 = atomic ( box = ( 0.0048, 0.0016, 0.0024 ), pos = ( 0.00192, -0.00424, 0.00284 ) );
"""


def test_parts_of_millimetres_that_meet_are_not_turned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the mate, beside their middles; with the timestep of large parts the run fails by that."""
    file = tmp_path / "tiny.pag"
    file.write_text(TINY)
    run = Simulation(read(file).layout, RunRequest(units=2)).run()
    assert run.verdict.succeeded and run.physics.handoff_angle_max_deg < 0.01
    monkeypatch.setattr(timestep, "IMPACT", 0.0)
    run = Simulation(read(file).layout, RunRequest(units=2)).run()
    assert not run.verdict.succeeded and run.physics.handoff_angle_max_deg > 0.1


# --- from outside ---------------------------------------------------------------------------------


def test_run_says_which_it_took(run: Terminal) -> None:
    done = run("run", PAPER, "--json").json
    assert (done["timestep_s"], done["timestep_chosen"]) == (0.01, True)
    done = run("run", PAPER, "--timestep", 0.002, "--json").json
    assert (done["timestep_s"], done["timestep_chosen"]) == (0.002, False)
    done = run("run", PAPER, "--world", "ideal", "--json").json
    assert (done["timestep_s"], done["timestep_chosen"]) == (None, None)
    assert "timestep 10 ms, chosen" in run("run", PAPER).out
    assert "timestep 4 ms, as requested" in run("run", PAPER, "--timestep", "0.004").out


def test_an_option_comes_before_the_environment_and_that_before_the_file(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pag = tmp_path / "paper.pag"
    pag.write_text(PAPER.read_text())
    (tmp_path / "factory.toml").write_text("timestep = 0.004\n")
    assert run("run", pag, "--json").json["timestep_s"] == 0.004
    monkeypatch.setenv("FACTORY_TIMESTEP", "auto")
    assert run("run", pag, "--json").json["timestep_s"] == 0.01
    assert run("run", pag, "--timestep", "0.005", "--json").json["timestep_s"] == 0.005
    monkeypatch.setenv("FACTORY_TIMESTEP", "0.002")
    assert run("run", pag, "--timestep", "auto", "--json").json["timestep_s"] == 0.01
    monkeypatch.delenv("FACTORY_TIMESTEP")
    (tmp_path / "factory.toml").write_text('timestep = "auto"\n')
    assert run("run", pag, "--json").json["timestep_chosen"]


def test_what_is_no_timestep_is_told(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "'soon' is not a valid float" in run("run", PAPER, "--timestep", "soon").err
    monkeypatch.setenv("FACTORY_TIMESTEP", "soon")
    told = run("run", PAPER)
    assert told.status == 2
    assert "FACTORY_TIMESTEP: timestep must be a number" in told.err
    assert 'for example timestep = 0.002, or "auto"' in told.err
    with pytest.raises(InputError, match="speed"):
        Settings().with_options({"speed": 1e9, "timestep": AUTO})
    with pytest.raises(ValueError, match="auto"):
        _ = Settings().step


@pytest.mark.parametrize("seed", range(3))
def test_robots_that_run_their_programs_by_themselves_do_so_with_it(seed: int) -> None:
    """Their control periods stay 6 to 20 ms, in whole timesteps."""
    simulation = Simulation(
        layout("paper"), RunRequest(units=4, seed=seed, jitter=0.3, distributed=True)
    )
    periods = [process.period for process in simulation.supervisor.processes]
    assert simulation.request.settings.timestep == TICK
    assert {*periods} <= {1, 2}
    assert max(measured(simulation).values()) < 1e3 * ALLOWED
