"""The layout against the engine: bodies are where the certificate says, and nothing touches."""

from __future__ import annotations

import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.certificate import NAMES
from factory.floor.layout.layout import Layout
from tests.layout_values import STYLES, random_layout
from tests.pag_values import SHAPES

mujoco = pytest.importorskip("mujoco")


def laid_out(seed: int) -> Layout:
    """A layout of another shape and style for each seed."""
    shape, style = SHAPES[seed % len(SHAPES)], STYLES[seed % len(STYLES)]
    return random_layout(7 + seed, seed, shape, style, True)


@pytest.mark.parametrize("number", range(8))
def test_nothing_touches(number: int) -> None:
    """Two or three units, every robot with a speed and a gain of its own."""
    layout = laid_out(number)
    run = Simulation(
        layout, RunRequest("mujoco", units=2 + number % 2, seed=number, jitter=0.3)
    ).run()
    assert run.trouble is None, str(run.trouble)
    assert run.refines_net
    assert run.physics is not None
    assert run.physics.unintended_contacts == 0, run.physics.contacts


def test_layers_are_those_of_the_bodies() -> None:
    certificate = laid_out(0).certificate
    assert certificate is not None
    assert tuple(name for name, _, _ in certificate.layers) == NAMES
