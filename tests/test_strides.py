"""Several ticks go to the engine at once where nobody need look in between: it makes no
difference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from factory.control.navigation import Bundle
from factory.simulation.disturbance import Gain, disturb
from factory.simulation.mujoco import gaps, outfeed
from factory.simulation.mujoco.world import MujocoWorld
from factory.simulation.request import RunRequest
from factory.simulation.run import Event, PhysicsFigures
from factory.simulation.simulation import Simulation
from factory.support.settings import LOOK, MOST, Settings
from tests.bench.replaying import stepping
from tests.command_line import PAPER, Terminal
from tests.test_fuse import layout_of
from tests.test_setpoints import one_by_one
from tests.test_vicinity import ready

UNITS = 2


@dataclass
class Course:
    """Where everything is, by timestep, after each call of a supervisor; what fired and when; the
    figures."""

    states: dict[int, bytes] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    dropoffs: list[float] = field(default_factory=list)
    figures: PhysicsFigures = field(default_factory=PhysicsFigures)

    def agrees(self, other: Course) -> bool:
        """Whether they are the same wherever both have been looked at."""
        both = self.states.keys() & other.states.keys()
        return (
            all(self.states[step] == other.states[step] for step in both)
            and (self.events, self.dropoffs) == (other.events, other.dropoffs)
            and self.figures == other.figures
        )


def followed(name: str, ticks: int, **given: Any) -> Course:
    """A run that is asked for so many ticks at a time."""
    simulation, course = ready(name, True, **given), Course()
    world, d = simulation.world, simulation.world.d
    while world.delivered() < UNITS and world.time < 30.0:
        simulation.supervisor.step(ticks)
        step = round(world.time / simulation.request.settings.timestep)
        course.states[step] = d.qpos.tobytes() + d.qvel.tobytes()
    course.events = [*simulation.supervisor.events]
    course.dropoffs, course.figures = [*world.dropoffs], world.inspection.figures()
    return course


CASES: list[tuple[str, dict[str, Any]]] = [
    ("paper", {}),
    ("chest", {}),
    ("gearbox", {"fuse": True}),
    ("20", {"fuse": True}),
    ("lamp", {"settings": Settings(stage=1)}),
    ("paper", {"settings": Settings(timestep=0.001, substeps=12)}),
    ("shelf", {"settings": Settings(timestep=0.004)}),
    ("paper", {"settings": Settings(timestep=0.005, substeps=11)}),
]


@pytest.mark.parametrize(("name", "given"), CASES)
def test_ticks_at_once_are_the_same_as_one_by_one(name: str, given: dict[str, Any]) -> None:
    """To the last bit, the figures included."""
    singly, at_once = followed(name, 1, **given), followed(name, MOST, **given)
    assert len(singly.dropoffs) == UNITS and at_once.agrees(singly)
    stride = given.get("settings", Settings()).stride
    assert len(at_once.states) < (0.7 if stride > 1 else 1.01) * len(singly.states)


@pytest.mark.parametrize("name", ["chest", "gearbox", "20"])
def test_nobody_comes_back_for_nothing(name: str) -> None:
    """A call of the engine lasts until something fires, a mode may have come to its goal or a
    stride is over; the tray's way apart."""
    simulation = ready(name, True)
    supervisor, world = simulation.supervisor, simulation.world
    for_a_reason, tray = True, False
    while world.delivered() < UNITS:
        fired = len(supervisor.events)
        supervisor.step(MOST)
        assert for_a_reason or len(supervisor.events) > fired
        before, tray = tray, not world.outfeed.idle or world.stock.on_tray is not None
        for_a_reason = world.ticks == 0 or supervisor.near or before or tray


@pytest.mark.parametrize("name", ["paper", "gearbox", "20"])
def test_who_goes_back_over_several_ticks_comes_to_the_same_state(name: str) -> None:
    singly = followed(name, 1)
    with stepping(one_by_one):
        assert followed(name, MOST).agrees(singly)


def test_who_looks_away_while_the_tray_comes_sees_it_late(monkeypatch: pytest.MonkeyPatch) -> None:
    singly = followed("chest", 1)
    monkeypatch.setattr(outfeed, "CLOSE", 0.0)
    assert not followed("chest", MOST).agrees(singly)


def test_who_looks_away_while_a_goal_is_near_sees_it_late(monkeypatch: pytest.MonkeyPatch) -> None:
    singly, course = followed("paper", 1), MujocoWorld._course

    def careless(self: MujocoWorld, bundle: Any, *given: Any) -> Any:
        near = object.__getattribute__(bundle, "near_goal")
        here = type(bundle).near_goal
        try:
            type(bundle).near_goal = lambda *_: False
            found = course(self, bundle, *given)
        finally:
            type(bundle).near_goal = here
        object.__setattr__(found, "near", near(found.told.after[:, 0], 5e-4))
        return found

    monkeypatch.setattr(MujocoWorld, "_course", careless)
    assert not followed("paper", MOST).agrees(singly)


@pytest.mark.parametrize("timestep", [1e-5, 1e-3, 2e-3, 4e-3, 2e-2])
@pytest.mark.parametrize("substeps", [1, 5, 100])
def test_a_stride_is_no_longer_than_a_look(timestep: float, substeps: int) -> None:
    settings = Settings(timestep=timestep, substeps=substeps)
    assert 1 <= settings.stride <= MOST
    assert settings.stride == 1 or settings.stride * settings.tick <= LOOK + 1e-12
    assert settings.samples == settings.stride * substeps + 2


def test_what_is_late_at_max_time_is_not_run() -> None:
    """Nobody looks, but no more is simulated than was asked for."""
    run = Simulation(layout_of("paper"), RunRequest(units=5)).run(max_time=1.23)
    assert run.sim_time_s == pytest.approx(1.23) and run.trouble is not None


def test_a_glance_does_not_hold_a_run_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who needs to be called now and then is; who observes sees every tick; the run is the same."""
    glanced, seen = list[float](), list[float]()
    first, second = (Simulation(layout_of("chest"), RunRequest(units=1)) for _ in range(2))
    one = first.run(glances=[lambda world, _: glanced.append(world.time)])
    other = second.run([lambda world, _: seen.append(world.time)], glances=[lambda *_: None])
    assert glanced[-1] == seen[-1] and set(glanced) <= set(seen)
    assert len(seen) == round(seen[-1] / 0.01) and len(glanced) < 0.5 * len(seen)
    assert (one.events, one.physics) == (other.events, other.physics)


def test_what_acts_in_every_tick_is_let_to() -> None:
    """A weak drive pushes with its share of the force of each tick, whether somebody looks or
    not."""
    found = []
    for observers in ([], [lambda *_: None]):
        simulation = disturb(Simulation(layout_of("paper"), RunRequest(units=2)), Gain(0.5))
        run = simulation.run(observers)
        found.append((run.events, run.physics, simulation.world.d.qpos.tobytes()))
    assert found[0] == found[1]


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_a_run_in_the_shell_is_not_held_up(
    run: Terminal, more: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls, step = list[int](), MujocoWorld.step

    def counted(self: MujocoWorld, bundle: Any, axes: Any, ticks: int = 1) -> bool:
        calls.append(ticks)
        return step(self, bundle, axes, ticks)

    monkeypatch.setattr(MujocoWorld, "step", counted)
    run("run", PAPER, *more)
    assert max(calls) == MOST


def test_gaps_are_the_same_whenever_they_are_worked_out(monkeypatch: pytest.MonkeyPatch) -> None:
    late = followed("20", MOST).figures.handoff_gap_max_mm
    monkeypatch.setattr(gaps, "MANY", 1)
    assert followed("20", MOST).figures.handoff_gap_max_mm == late > 0.0


def test_forgotten_gaps_are_forgotten() -> None:
    world = ready("paper", True).world
    noted = world.inspection.gaps
    weld, body = world.stock.grip[0, "part1"], int(world.stock.body["part1"][0])
    noted.note([weld], [body])
    assert noted.largest() > 0.0
    noted.note([weld], [body])
    noted.forget()
    assert noted.largest() == 0.0


def test_references_are_where_the_drives_are_told_to_be() -> None:
    """Written down late, but not too late for who asks."""
    simulation = ready("chest", True)
    world, supervisor = simulation.world, simulation.supervisor
    for _ in range(200):
        supervisor.step(MOST)
        axes = supervisor.active.axes
        told = world.d.ctrl[world.control[axes]]
        assert np.array_equal(world.reference[axes], told)
        assert np.array_equal(world.speed[axes], world.d.ctrl[world.control[axes] + 1])


@pytest.mark.parametrize(("name", "given"), [*CASES, ("paper", {"settings": Settings(eps=5e-3)})])
def test_nobody_comes_to_a_goal_before_the_reference_rests(
    name: str, given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who asks as soon as references are close to it hears of no end any earlier."""
    asked, near_goal = followed(name, MOST, **given), Bundle.near_goal
    monkeypatch.setattr(
        Bundle, "near_goal", lambda self, x, within, slow=None: near_goal(self, x, within)
    )
    assert followed(name, MOST, **given).events == asked.events
