"""What a model shows in any viewer: all of the factory, faces that do not flicker, and the numbers
of its robots."""

from __future__ import annotations

from itertools import combinations

import mujoco
import numpy as np
import pytest

from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.replica import SHOWN
from factory.engine.mjcf.robot_bodies import DIGITS, STROKES
from factory.engine.simulation.modelling import physical_model
from factory.floor.layout.layout import Layout
from tests.examples import with_hands

EXAMPLES = ["paper", "lamp", pytest.param("gearbox", marks=pytest.mark.slow)]


@pytest.fixture(scope="module")
def made(request: pytest.FixtureRequest) -> tuple[Layout, Model, mujoco.MjModel, mujoco.MjData]:
    layout = with_hands(request.param)
    model = physical_model(layout)
    m = load(model)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    return layout, model, m, d


@pytest.mark.parametrize("made", EXAMPLES, indirect=True)
def test_no_faces_are_drawn_in_one_place(made: tuple) -> None:
    """Two boxes whose faces are in one plane and look the same way flicker, as a tower did on
    its mast, and where two that are faded overlap."""
    _, _, m, d = made
    box = m.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    turn = np.abs(d.geom_xmat.reshape(-1, 3, 3))
    straight = np.isclose(np.sort(turn.reshape(-1, 9))[:, -3:], 1, atol=1e-6).all(axis=1)
    drawn = np.flatnonzero(box & straight & (m.geom_group < SHOWN) & (d.geom_xpos[:, 2] > 0))
    half = np.einsum("gij,gj->gi", turn, m.geom_size)
    low, high = d.geom_xpos - half, d.geom_xpos + half
    found = []
    for one, other in combinations(drawn.tolist(), 2):
        shared = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
        for axis in range(3):
            if (np.delete(shared, axis) < 1e-5).any():
                continue
            ends = (low[one, axis], low[other, axis]), (high[one, axis], high[other, axis])
            if any(abs(a - b) < 2e-5 for a, b in ends):
                found.append((m.geom(one).name, m.geom(other).name))
    hidden = {pair for pair in found if pair[0].endswith("/mast") and pair[1].endswith("/arm")}
    assert set(found) - hidden == set()  # that face is below the mast's cap


def test_digits_differ() -> None:
    assert len(set(DIGITS)) == 10
    assert {stroke for digit in DIGITS for stroke in digit} == set(STROKES)
