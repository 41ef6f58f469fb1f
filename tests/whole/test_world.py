"""Worlds: both satisfy one interface, and others take part in both by the same hooks."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

from factory.apps.live.interventions import Interventions
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from tests.simulation_values import FINE, layout_of, ready

Name = Literal["mujoco", "ideal"]
WORLDS: tuple[Name, ...] = ("ideal",)


def run_in(world: Name, units: int = 2, **given: Any) -> Simulation:
    """A run of the paper's example in a world, ready to go."""
    return Simulation(layout_of("paper"), RunRequest(world, units, settings=FINE, **given))


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


def test_interventions_are_into_bodies() -> None:
    with pytest.raises(InputError, match="the ideal world has none"):
        Interventions(run_in("ideal")).slow(0, 0.5)


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
