"""Worlds: both satisfy one interface, and others take part in both by the same hooks."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Literal, get_type_hints

import numpy as np
import pytest

from factory.apps.deviations import Deviation, deviate
from factory.apps.live.interventions import Interventions
from factory.engine.simulation.ideal import IdealWorld
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.simulation.world import Hooks, World
from factory.support.arrays import Array
from factory.support.errors import InputError
from factory.theory.plant.operation import Operation
from tests.simulation_values import FINE, layout_of, ready

Name = Literal["mujoco", "ideal"]
WORLDS: tuple[Name, ...] = ("mujoco", "ideal")


def run_in(world: Name, units: int = 2, **given: Any) -> Simulation:
    """A run of the paper's example in a world, ready to go."""
    return Simulation(layout_of("paper"), RunRequest(world, units, settings=FINE, **given))


def interface() -> dict[str, Any]:
    """What the protocol asks of a world, by name."""
    return {
        name: member
        for name, member in vars(World).items()
        if not name.startswith("_") and (callable(member) or isinstance(member, property))
    } | dict.fromkeys(get_type_hints(World))


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_has_all_that_the_protocol_asks_for(name: Name) -> None:
    """With the same parameters; mypy holds their types."""
    world = run_in(name).world
    asked = interface()
    assert {"step", "apply", "sense", "hooks", "supplied", "dropoffs", "figures"} <= set(asked)
    for member, wanted in asked.items():
        found = getattr(world, member)
        if wanted is not None and not isinstance(wanted, property):
            own = [*inspect.signature(found).parameters.values()]
            protocol = [*inspect.signature(wanted).parameters.values()][1:]
            assert [(p.name, p.default) for p in own] == [(p.name, p.default) for p in protocol]


def both(ideal: IdealWorld, physical: MujocoWorld) -> tuple[World, World]:
    """Checked by mypy: either is a World."""
    return ideal, physical


def test_both_worlds_are_worlds() -> None:
    ideal, physical = run_in("ideal").world, run_in("mujoco").world
    assert isinstance(ideal, IdealWorld) and isinstance(physical, MujocoWorld)
    assert both(ideal, physical) == (ideal, physical)
    assert ideal.figures() is None and physical.figures() is not None
    assert ideal.unstable() == physical.unstable() == ""


# --- hooks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("distributed", [False, True])
@pytest.mark.parametrize("name", WORLDS)
def test_a_closed_gate_keeps_an_operation_from_starting(name: Name, distributed: bool) -> None:
    """Until it opens; other operations start."""
    simulation = run_in(name, distributed=distributed)
    world = simulation.world
    asked: list[tuple[str, int]] = []

    def gate(operation: Operation, unit: int) -> bool:
        asked.append((operation.label, unit))
        return (operation.label, unit) != ("part1", 1) or world.time >= 9.0

    world.hooks.gates.append(gate)
    world.hooks.gates.append(lambda *_: True)
    simulation.run([lambda _: setattr(world, "supplied", True)], max_time=30.0)
    starts = [e.t for e in simulation.supervisor.events if e.transition == "part1_s"]
    others = [e.t for e in simulation.supervisor.events if e.transition == "part2_s"]
    assert starts[0] < 1.0 and starts[1] == pytest.approx(9.0, abs=0.05)
    assert others[1] < 8.0 and world.delivered() == 2
    assert ("part1", 1) in asked


@pytest.mark.parametrize("name", WORLDS)
def test_sensors_follow_each_other(name: Name) -> None:
    """Each gets what the one before makes of positions and speeds."""
    world = run_in(name).world
    x, v = (values.copy() for values in world.sense())
    world.hooks.sensors.append(lambda x, v: (x + 1.0, v + 2.0))
    world.hooks.sensors.append(lambda x, v: (x * 3.0, v))
    sensed = world.sense()
    assert np.allclose(sensed[0], 3.0 * (x + 1.0)) and np.allclose(sensed[1], v + 2.0)


@pytest.mark.parametrize("name", WORLDS)
def test_a_supervisor_goes_by_what_is_sensed(name: Name) -> None:
    """Robots that are said to be somewhere else never come to their goals."""
    simulation = run_in(name)

    def wrong(x: Array, v: Array) -> tuple[Array, Array]:
        return x + 0.01, v

    simulation.world.hooks.sensors.append(wrong)
    simulation.run(max_time=5.0)
    assert not any(e.transition.endswith("_e") for e in simulation.supervisor.events)


@pytest.mark.parametrize("fast", [True, False])
def test_hooks_act_before_every_timestep(fast: bool) -> None:
    """Of however many ticks a call is."""
    simulation = ready("paper", fast=fast)
    world, seen = simulation.physical, list[float]()
    world.hooks.before_step.append(lambda: seen.append(world.time))
    for ticks in (1, 10, 3):
        simulation.supervisor.step(ticks)
    world.advance(7)
    steps = round(world.time / world.m.opt.timestep)
    assert len(seen) == steps > 20
    assert seen == pytest.approx(world.m.opt.timestep * np.arange(steps))


def test_hooks_act_before_every_tick_of_the_ideal_world() -> None:
    simulation = run_in("ideal")
    seen = list[float]()
    simulation.world.hooks.before_step.append(lambda: seen.append(simulation.world.time))
    for _ in range(5):
        simulation.supervisor.step()
    assert seen == pytest.approx(FINE.tick * np.arange(5))


@pytest.mark.parametrize("name", WORLDS)
def test_a_hook_may_remove_itself(name: Name) -> None:
    """And the others act all the same, in that step too."""
    simulation = run_in(name)
    acts, calls = simulation.world.hooks.before_step, list[str]()

    def once() -> None:
        calls.append("once")
        acts.remove(once)

    acts += [once, lambda: calls.append("other")]
    for _ in range(3):
        simulation.supervisor.step()
    assert calls[:2] == ["once", "other"] and calls.count("once") == 1
    assert calls.count("other") == (15 if name == "mujoco" else 3)


def test_a_world_without_hooks_goes_on_in_strides() -> None:
    """A hook that has removed itself holds a run up no longer."""
    simulation = ready("paper")
    world, ticks = simulation.physical, list[float]()
    Interventions(simulation).push(0, 0.1, 0.05)
    while world.time < 1.0:
        before = world.time
        simulation.supervisor.step(10)
        ticks.append(world.time - before)
    assert world.hooks.before_step == []
    assert max(ticks) > 0.05


def test_hooks_are_each_worlds_own() -> None:
    one, other = Hooks(), Hooks()
    one.gates.append(lambda *_: False)
    assert other.gates == [] and other.sensed(np.ones(1), np.ones(1)) == (1.0, 1.0)


# --- interventions --------------------------------------------------------------------------------


def test_interventions_are_into_bodies() -> None:
    with pytest.raises(InputError, match="the ideal world has none"):
        Interventions(run_in("ideal")).slow(0, 0.5)


def test_a_blocked_feeder_gives_nothing_until_it_is_free() -> None:
    simulation = run_in("mujoco", 3)
    hands, world = Interventions(simulation), simulation.world
    hands.block("part2")
    assert hands.blocked == {"part2"}
    while world.time < 6.0:
        simulation.supervisor.step()
    fired = [e.transition for e in simulation.supervisor.events]
    assert "part2_s" not in fired and "part1_s" in fired
    hands.free("part2")
    simulation.supervisor.step()
    assert "part2_s" in [e.transition for e in simulation.supervisor.events]
    assert simulation.run().products == 3


def test_pushes_end_when_their_time_is_over() -> None:
    """Two robots, each as long as was asked for; each with a share of its own drive's force."""
    simulation = ready("paper")
    world, hands = simulation.physical, Interventions(simulation)
    bodies = [world.m.body(f"r{n}/carriage").id for n in (1, 2)]
    hands.push(0, 0.5, 0.02)
    hands.push(1, -0.25, 0.05)
    forces = [np.linalg.norm(world.d.xfrc_applied[b, :3]) for b in bodies]
    limits = world.m.actuator_forcerange[world.motion.axes.actuator[:2], 1]
    assert forces == pytest.approx([0.5 * limits[0], 0.25 * limits[1]])
    lasted = np.zeros(2)
    for _ in range(60):
        world.advance(1)
        lasted += world.d.xfrc_applied[bodies, :3].any(axis=1)
    assert lasted.tolist() == [10, 25]
    assert world.hooks.before_step == []


@pytest.mark.parametrize("factor", [0.5, 0.1])
def test_a_slowed_robot_knows_its_limit(factor: float) -> None:
    """And its lift's; the others go as fast as ever, and 1 gives it back."""
    simulation = ready("fence")
    hands, full = Interventions(simulation), simulation.limits.speed.copy()
    axes = simulation.physical.motion.axes.of_robot
    robot = next(r for r, mine in enumerate(axes) if mine[1:])
    mine = [*axes[robot]]
    hands.slow(robot, factor)
    speed = simulation.limits.speed
    assert speed[mine] == pytest.approx(factor * full[mine])
    assert (np.delete(speed, mine) == np.delete(full, mine)).all()
    while simulation.world.time < 2.0:
        simulation.supervisor.step()
        v = np.abs(simulation.physical.motion.robots.v[: len(full)])
        assert (v <= speed + 1e-12).all()
    hands.slow(robot, 1.0)
    assert dict(hands.slowed) == {} and (simulation.limits.speed == full).all()
    assert simulation.run().refines_net


def slower(make: Callable[[Simulation], object]) -> float:
    """How long a run takes that something is done to [s]."""
    simulation = run_in("mujoco", 1)
    make(simulation)
    return simulation.run().sim_time_s


def test_slowing_is_the_same_by_hand_and_as_a_disturbance() -> None:
    by_hand = slower(lambda simulation: Interventions(simulation).slow(2, 0.3))
    assert by_hand == slower(
        lambda simulation: deviate(simulation, Deviation("slow", robot="r3", factor=0.3))
    )
    assert by_hand > slower(lambda simulation: None)
