"""Filament draws stills where Vulkan works; elsewhere everything is as without it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest

from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.mjcf.robot_bodies import DIGITS, STROKES
from factory.engine.simulation.modelling import physical_model
from factory.film import filament, studio
from factory.film.picture import Picture
from factory.floor.geometry.sight import View
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.errors import InputError, MissingError
from tests.examples import with_hands


@pytest.fixture
def untried() -> Iterator[None]:
    filament.fault.cache_clear()
    yield
    filament.fault.cache_clear()


@pytest.mark.usefixtures("untried")
def test_without_vulkan_stills_are_classic_and_filament_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The trial ends as the renderer does without a driver."""
    reason = "libc++abi: terminating\nin createVkInstance:985\nreason: Unable to create an instance"
    ended = subprocess.CompletedProcess([], -6, "", reason)
    monkeypatch.setattr(filament, "loads", lambda library: True)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: ended)
    assert not filament.draws("auto", still=True)
    with pytest.raises(MissingError, match="NoVulkan") as caught:
        filament.draws("filament", still=True)
    (said,) = caught.value.diagnostics
    assert "Unable to create" in said.message
    assert filament.APT in said.hint and "--renderer classic" in said.hint


def test_a_second_thread_does_not_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filament, "fault", lambda: None)
    monkeypatch.setattr(filament, "_threads", {-1})
    assert not filament.draws("auto", still=True)
    with pytest.raises(InputError, match="another thread"):
        filament.draws("filament", still=True)


def test_an_unknown_renderer_is_refused() -> None:
    with pytest.raises(InputError, match="there is no renderer 'filamnt'"):
        Picture(renderer="filamnt")  # type: ignore[arg-type]


def test_the_environment_is_a_cube_map_of_the_studio() -> None:
    content = studio.environment()
    assert content.startswith(b"\xabKTX 11\xbb\r\n\x1a\n")
    texels = sum(6 * (studio.SIZE >> level) ** 2 for level in range(4))
    assert 4 * texels < len(content) < 4 * texels + 2000
    up, down, side = studio.light(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))
    assert up.min() > down.min() > side.min() > 0.4


BALL = "<mujoco><worldbody><geom size='1' rgba='1 0 0 1'/></worldbody></mujoco>"
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
VIEW = View(np.array([0.0, -6.0, 0.0]), AXES, 0.3, 0.3, 6.0, 1.0)


def test_filament_leaves_out_what_is_left_out_of_a_replica() -> None:
    """And shows it again: the renderer asks for the groups of geoms only once."""
    if filament.fault() is not None:
        pytest.skip("Vulkan does not work here")
    replica = Replica(mujoco.MjModel.from_xml_string(BALL))
    seen = list[bool]()
    with filament.Filament(replica, (64, 48)) as renderer:
        for group in (0, SHOWN, 0):
            replica.m.geom_group[0] = group
            replica.place(replica.d.qpos)
            red, green, _ = renderer.mean(VIEW, 2)[24, 32].astype(int)
            seen.append(bool(red > 2 * green))
    assert seen == [True, False, True]


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
