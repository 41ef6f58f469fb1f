"""Filament draws stills where Vulkan works; elsewhere everything is as without it. What is drawn:
rounded boxes, and nothing without a GL. The drawn model moves as the run's does, and nothing drawn
lies outside what is solid."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.mjcf.robot_bodies import DIGITS, STROKES
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import dress, filament, painter, studio
from factory.film.drawn import drawn
from factory.film.lettering import GLYPHS, height, lettering
from factory.film.outfits import OUT
from factory.film.picture import Picture
from factory.film.skins import rounded
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError, MissingError
from factory.support.pictures.sight import View
from factory.support.pictures.smoothing import smooth
from tests.examples import with_hands
from tests.slow import slow_but


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


DRESSED = ("paper", "lamp", "truck")

WALLS = {*dress.MAGAZINE, *dress.SHED}
"""The solids that a housing is drawn in the stead of."""

STANDS_OUT = {"outfeed/sides/skin": dress.BESIDE}
"""What is drawn further outside of what is solid than windows and words are [m]."""


@cache
def models(name: str) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model of a run of an example, and its drawn model."""
    simulation = Simulation(with_hands(name), RunRequest(units=1))
    m, made = simulation.physical.m, simulation.model
    return m, drawn(m, made.xml, made.files, "overview")


@pytest.mark.parametrize("name", slow_but(["paper"], DRESSED))
def test_bodies_are_where_those_of_the_run_are(name: str) -> None:
    m, seen = models(name)
    assert (m.nq, m.nbody, m.neq) == (seen.nq, seen.nbody, seen.neq)
    assert [m.body(b).name for b in range(m.nbody)] == [seen.body(b).name for b in range(m.nbody)]
    one, other = Replica(m), Replica(seen)
    rng = np.random.default_rng(1)
    for _ in range(5):
        qpos = m.qpos0 + rng.normal(0.0, 0.1, m.nq)
        one.place(qpos)
        other.place(qpos)
        assert np.array_equal(one.d.xpos, other.d.xpos)


def outside(m: mujoco.MjModel, seen: mujoco.MjModel) -> Iterator[tuple[str, float]]:
    """How far each geom that only the drawn model has stands out of the solids of its body, or of
    that on which it is carried [m]."""
    d, worn = Replica(m).d, Replica(seen).d
    solid = {m.geom(g).name: g for g in range(m.ngeom) if m.geom_group[g] < SHOWN}
    for g in range(seen.ngeom):
        name = seen.geom(g).name
        if name in solid or seen.geom_group[g] >= SHOWN or seen.geom_dataid[g] < 0:
            continue
        mesh = seen.mesh(int(seen.geom_dataid[g]))
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        points = np.asarray(seen.mesh_vert[first : first + count], float)
        points = points @ worn.geom_xmat[g].reshape(3, 3).T + worn.geom_xpos[g]
        body = int(seen.geom_bodyid[g])
        near = [k for k in solid.values() if m.geom_bodyid[k] == body]
        if "/housing/" in name:  # its walls, and what they enclose
            walls = [k for k in near if m.geom(k).name.rpartition("/")[2] in WALLS]
            at = (points - d.xpos[body]) @ d.xmat[body].reshape(3, 3)
            low = (m.geom_pos[walls] - m.geom_size[walls]).min(axis=0)
            high = (m.geom_pos[walls] + m.geom_size[walls]).max(axis=0)
            yield name, float(np.linalg.norm(at - at.clip(low, high), axis=1).max())
            continue
        yield name, float(np.min([away(m, d, k, points) for k in near], axis=0).max())


def away(m: mujoco.MjModel, d: mujoco.MjData, geom: int, points: np.ndarray) -> np.ndarray:
    """The distance of points (n, 3) from a box or a cylinder, 0 within it [m]."""
    at = (points - d.geom_xpos[geom]) @ d.geom_xmat[geom].reshape(3, 3)
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radius, half = m.geom_size[geom, :2]
        at = np.stack([np.hypot(at[:, 0], at[:, 1]) - radius, np.abs(at[:, 2]) - half], axis=1)
        return np.linalg.norm(np.maximum(at, 0.0), axis=1)
    return np.linalg.norm(np.maximum(np.abs(at) - m.geom_size[geom], 0.0), axis=1)


@pytest.mark.parametrize("name", slow_but(["paper"], DRESSED))
def test_nothing_drawn_lies_outside_what_is_solid(name: str) -> None:
    for geom, far in outside(*models(name)):
        assert far <= STANDS_OUT.get(geom, OUT) + 1e-5, geom


@given(text=st.text(st.sampled_from([*GLYPHS, *"abc ÄÉß"]), min_size=1, max_size=9))
def test_letters_fill_their_height_and_width(text: str) -> None:
    made = lettering(text, 1.0)
    if made is None:
        assert not text.strip(" ß")
        return
    low, high = made.skin.at.min(axis=0), made.skin.at.max(axis=0)
    assert (np.abs([low[1], high[1]]) <= 0.5 + 0.2).all()
    assert np.abs([low[0], high[0]]).max() <= made.wide / 2 + 0.2
    assert made.wide * height(text, 0.3, 1.0) <= 0.3 + 1e-9
    a, b, c = (made.skin.at[made.skin.face[:, k], :2] for k in range(3))
    (one, two), (three, four) = (b - a).T, (c - a).T
    assert (one * four - two * three >= -1e-9).all()  # all seen from above


def test_accents_are_left_out() -> None:
    one, other = lettering("ÄB", 1.0), lettering("AB", 1.0)
    assert one is not None and other is not None
    assert np.array_equal(one.skin.at, other.skin.at)


def test_a_stair_becomes_an_edge() -> None:
    """The mean error of a half plane that was drawn with one sample a pixel falls."""
    slope = -0.4
    y, x = np.mgrid[:60, :80] + 0.5
    fine = np.mean([(y + v - 30) > slope * (x + u - 40) for u in OFFSETS for v in OFFSETS], axis=0)[
        ..., None
    ]
    true = 90 + 140 * np.repeat(fine, 3, axis=2)
    drawn_once = np.where((y - 30) > slope * (x - 40), 230, 90).astype(np.uint8)
    picture = np.repeat(drawn_once[..., None], 3, axis=2)
    inner = np.s_[12:-12, 12:-12]
    before, after = (np.abs(p[inner] - true[inner]).sum() for p in (picture, smooth(picture)))
    assert after < 0.7 * before


OFFSETS = np.linspace(-0.45, 0.45, 10)


def test_what_is_flat_stays_as_it_is() -> None:
    picture = np.full((30, 40, 3), 200, np.uint8)
    picture[:, 20:] -= 5
    assert np.array_equal(smooth(picture), picture)


@pytest.mark.parametrize("bevel", [0.001, 0.5])
def test_a_rounded_box_is_as_large_as_the_box(bevel: float) -> None:
    half = np.array([0.3, 0.2, 0.01])
    skin = rounded(*half.tolist(), bevel)
    corners = np.abs(skin.at)
    assert corners.max(axis=0) == pytest.approx(half)
    assert (corners > 0.5 * half - 1e-12).all()


def test_without_a_gl_nothing_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def probe() -> None:
        raise MissingError(Diagnostic("Missing", "no GL", None, "install one"))

    monkeypatch.setattr(painter.gl, "probe", probe)
    with pytest.raises(MissingError):
        painter.Painter(*[None] * 5)  # type: ignore[arg-type]


"""The solids that a housing is drawn in the stead of."""


def test_walls_are_not_drawn_where_a_housing_is() -> None:
    _, seen = models("paper")
    walls = [n for n in range(seen.ngeom) if seen.geom(n).name.rpartition("/")[2] in WALLS]
    assert walls and (seen.geom_group[walls] == SHOWN).all()
