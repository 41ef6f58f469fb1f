"""Drives in the engine's discrete time: stable with any timestep and load, and on their
reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.mjcf import model
from factory.mjcf.model import CARRIAGE_MASS, HOIST_STIFFNESS, STIFFNESS, drive_for
from factory.mjcf.robots import Drive
from factory.simulation.mujoco.drives import Setpoints
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.support.settings import RANGES, Settings
from tests.test_fuse import layout_of
from tests.test_vicinity import layout

MOST = 1.9
"""Jitter draws no greater factor on a drive's gains."""


def growth(drive: Drive, mass: float, timestep: float, factor: float = 1.0) -> float:
    """By how much an offset and a speed of a mass [kg] may grow in a timestep, in the long run:
    v' = v - h (kp x + kv v) / m, x' = x + h v'."""
    push = factor * timestep * drive.kp / mass
    brake = 1 - factor * timestep * drive.kv / mass
    step = np.array([[1 - timestep * push, timestep * brake], [-push, brake]])
    return float(np.abs(np.linalg.eigvals(step)).max())


@given(
    own=st.floats(0.1, 10),
    load=st.floats(0, 1000),
    timestep=st.floats(*RANGES["timestep"]),
    stiffness=st.sampled_from((STIFFNESS, HOIST_STIFFNESS)),
    factor=st.floats(0.1, MOST),
    share=st.floats(0, 1),
)
def test_drives_are_stable(
    own: float, load: float, timestep: float, stiffness: float, factor: float, share: float
) -> None:
    """With any timestep, whatever they carry, and with all gains that jitter draws."""
    drive = drive_for(own, load, 2.0, replace(Settings(), timestep=timestep), stiffness)
    assert growth(drive, own + drive.inertia + share * load, timestep, factor) < 1


def test_a_drive_that_knew_no_timestep_would_not_be() -> None:
    loose = drive_for(CARRIAGE_MASS, 0.1, 2.0, Settings(timestep=1e-4))
    assert growth(loose, CARRIAGE_MASS, 1e-4) < 1 < growth(loose, CARRIAGE_MASS, 0.02)


def test_with_short_timesteps_drives_are_as_stiff_as_ever() -> None:
    short, usual = (
        drive_for(CARRIAGE_MASS, 0.5, 2.0, Settings(timestep=timestep))
        for timestep in (1e-4, 0.002)
    )
    assert (short.kp, short.kv) == (usual.kp, usual.kv)


@pytest.mark.parametrize("name", ["paper", "20", "gearbox"])
@pytest.mark.parametrize("timestep", [0.008, 0.02])
def test_long_timesteps_do(name: str, timestep: float) -> None:
    """Gaps stay below 0.3 mm and welds hold, with robots and drives that differ."""
    settings = Settings(timestep=timestep, substeps=1)
    run = Simulation(layout(name), RunRequest(units=2, seed=3, jitter=0.5, settings=settings)).run()
    figures: Any = run.physics
    assert run.trouble is None
    assert run.refines_net
    assert max(figures.handoff_gap_max_mm, figures.weld_residual_max_mm) < 0.3
    assert figures.unintended_contacts == 0


def test_drives_that_are_too_stiff_for_the_timestep_are_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(model, "PUSHED", 1e9)
    monkeypatch.setattr(model, "DAMPED", 1e9)
    settings = Settings(timestep=0.02, substeps=1)
    run = Simulation(layout_of("paper"), RunRequest(units=2, settings=settings)).run()
    assert run.trouble is not None


def largest_error() -> float:
    """How far any robot of the paper's example is from its reference [m] at the end of any tick of
    8 m/s^2, while that moves, with the 2 ms of which h a / w is told."""
    settings = Settings(acceleration=8.0, speed=2.0, timestep=0.002)
    simulation = Simulation(layout_of("paper"), RunRequest(units=2, settings=settings))
    world, largest = simulation.world, 0.0
    while not world.delivered():
        simulation.supervisor.step()
        axes = world.speed != 0.0
        error = np.abs(world.sense()[0] - world.reference)[axes]
        largest = max(largest, float(error.max(initial=0.0)))
    return largest


def test_robots_are_where_their_references_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """To a third of what it would be if drives were told the speeds of now: half a timestep's
    acceleration, against their stiffness, is h a / w = 0.23 mm."""
    good, told = largest_error(), Setpoints.__init__

    def hasty(self: Setpoints, *given: Any) -> None:
        told(self, *given)
        self._half = 0.0

    monkeypatch.setattr(Setpoints, "__init__", hasty)
    assert largest_error() == pytest.approx(0.23e-3, rel=0.2)
    assert good < 0.1e-3
