"""Pictures: exact sizes and counts, every part to be seen, the same from a run and from its log,
and nothing lost when the work is broken off. Without EGL only what needs none is tested."""

from __future__ import annotations

import colorsys
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import factory
from factory.apps.log import LogWriter, read_log
from factory.apps.runs.pictures import render_log
from factory.engine.mjcf.mesh_files import corner_normals, face_normals, mesh_file
from factory.engine.record.state import State
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import Film, Picture, Still, check_output, finale
from factory.film.action import Action, Snapshot
from factory.film.caption import Caption
from factory.film.finale import LASTS
from factory.film.painter import Painter, Renderer
from factory.film.picture import from_above
from factory.film.reel import HOLD
from factory.film.shot import Shot
from factory.film.vantage import overview
from factory.film.video import ENCODERS, VideoFile
from factory.floor.geometry.meshes import Mesh
from factory.floor.geometry.sight import Framing, View, fit, towards
from factory.support import gl
from factory.support.engine import mujoco
from factory.support.errors import InputError, MissingError
from tests.opengl import needs_gl
from tests.paths import ROOT

PAPER = ROOT / "examples" / "paper.pag"
SIZE, FPS = (160, 96), 10.0
HELD, TURNED = round(HOLD * FPS), round(LASTS * FPS)
SMALL, PRODUCT = Picture(SIZE), Picture((240, 136), "product", renderer="classic")


@pytest.fixture(scope="module")
def layout():
    return factory.lay_out(factory.compile(factory.load_pag(PAPER)))


@contextmanager
def drawn() -> Iterator[list[np.ndarray]]:
    """The pictures of films as they are drawn, before they are encoded."""
    found: list[np.ndarray] = []
    write = VideoFile.write
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VideoFile, "write", lambda film, p: (found.append(p), write(film, p)))
        yield found


@pytest.fixture(scope="module")
def taken(layout, tmp_path_factory: pytest.TempPathFactory):
    """A run filmed, logged, and with a still of its finished product; and the film's pictures."""
    folder = tmp_path_factory.mktemp("taken")
    simulation = Simulation(layout, RunRequest("mujoco", units=1))
    with (
        drawn() as pictures,
        LogWriter(folder / "run.log", simulation) as log,
        Film(simulation, folder / "run.mp4", SMALL, FPS) as film,
        Still(simulation, folder / "end.png", PRODUCT) as end,
    ):
        run = simulation.run([log.observe, film.observe, end.observe])
    return folder, run, film, pictures


def film_of(path: Path) -> np.ndarray:
    return iio.imread(path, plugin="pyav")


# --- films ------------------------------------------------------------------------------------


@needs_gl
def test_size_rate_and_frames_are_exact(taken) -> None:
    folder, run, film, _ = taken
    frames = film_of(folder / "run.mp4")
    wanted = int(run.sim_time_s * FPS + 1e-6) + 1 + HELD + TURNED
    assert film.frames == wanted and frames.shape == (wanted, SIZE[1], SIZE[0], 3)
    about = iio.immeta(folder / "run.mp4", plugin="pyav")
    assert about["fps"] == pytest.approx(FPS) and about["codec"] == "h264"
    assert about["video_format"] == "yuv420p"
    assert sorted(p.name for p in folder.iterdir() if p.name.startswith(".")) == []


@needs_gl
def test_a_film_ends_with_all_units_for_a_second(
    taken, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last unit may be out after the last even time: its moment is shown all the same."""
    pictures, said = taken[3], []
    draw = Caption.draw

    def drawn(caption: Caption, pixels: Any, product: str, made: int, *rest: Any) -> Any:
        said.append(made)
        return draw(caption, pixels, product, made, *rest)

    assert HELD == FPS
    held = pictures[-HELD - TURNED : -TURNED]
    assert all(np.array_equal(held[-1], one) for one in held)
    monkeypatch.setattr(Caption, "draw", drawn)
    render_log(read_log(taken[0] / "run.log"), Shot(tmp_path / "again.mp4", SMALL, FPS))
    assert said[0] == 0 and said[-1] == 1


@needs_gl
def test_then_it_shows_the_product_alone_and_from_more_than_one_side(taken) -> None:
    before, one, *_, other = taken[3][-TURNED - 1 :]

    def coloured(picture: np.ndarray) -> float:
        return float((np.ptp(picture.astype(int), axis=2) > 60).mean())

    def dark(picture: np.ndarray) -> float:
        """The share of machines, which have graphite glass, below the title."""
        return float((picture[SIZE[1] // 3 :].max(axis=2) < 60).mean())

    assert min(coloured(one), coloured(other)) > max(0.04, 2 * coloured(before))
    assert dark(before) > 0.02 and max(dark(one), dark(other)) < 0.002
    assert (np.abs(one.astype(int) - other).max(axis=2) > 40).mean() > 0.02


@needs_gl
def test_the_end_says_units_parts_and_contacts(
    taken, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of the run, in its film as in that of its log."""
    said = list[str]()
    monkeypatch.setattr(finale, "draw_title", lambda *words: said.append(words[2]))
    path = taken[0] / "run.log"
    render_log(read_log(path), Shot(tmp_path / "again.mp4", SMALL, FPS))
    assert set(said) == {"1 of 1 unit, 3 parts each, 0 unintended contacts"}
    said.clear()
    log = read_log(path)
    figures = {**(log.figures or {}), "unintended_contacts": 2}
    render_log(replace(log, figures=figures), Shot(tmp_path / "touched.mp4", SMALL, FPS))
    assert {words.rpartition(", ")[2] for words in said} == {"2 unintended contacts"}
    said.clear()
    render_log(replace(log, figures=None), Shot(tmp_path / "unknown.mp4", SMALL, FPS))
    assert set(said) == {"1 of 1 unit, 3 parts each"}


@needs_gl
def test_the_picture_is_not_blank_and_changes(taken) -> None:
    frames = film_of(taken[0] / "run.mp4").astype(int)
    assert all(frame.std() > 10 for frame in frames)
    factory_only = frames[: -HELD - TURNED, : int(0.8 * SIZE[1])]
    changed = [np.abs(a - b).max() for a, b in pairwise(factory_only)]
    assert np.mean(np.array(changed) > 30) > 0.6


@needs_gl
def test_filming_does_not_disturb_the_run(taken, layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("mujoco", units=1))
    with LogWriter(tmp_path / "plain.log", simulation) as log:
        again = simulation.run([log.observe])
    assert again.events == taken[1].events and again.physics == taken[1].physics
    plain, filmed = read_log(tmp_path / "plain.log"), read_log(taken[0] / "run.log")
    assert np.array_equal([*plain.qpos], [*filmed.qpos])
    assert np.array_equal([*plain.qvel], [*filmed.qvel])


@needs_gl
def test_the_same_pictures_are_encoded_the_same_every_time(taken, tmp_path: Path) -> None:
    """With drawing and encoding on one thread, one film in five once came out different."""
    log = read_log(taken[0] / "run.log")
    films = set()
    for _ in range(3):
        render_log(log, Shot(tmp_path / "again.mp4", SMALL, 5.0))
        films.add((tmp_path / "again.mp4").read_bytes())
    assert len(films) == 1


@needs_gl
def test_a_log_gives_the_same_pictures_as_its_run(taken, tmp_path: Path) -> None:
    folder = taken[0]
    log = read_log(folder / "run.log")
    with drawn() as pictures:
        count = render_log(log, Shot(tmp_path / "log.mp4", SMALL, FPS))
    one, other = np.array(taken[3]), np.array(pictures)
    assert one.shape == other.shape == (count, SIZE[1], SIZE[0], 3)
    assert np.abs(one.astype(int) - other).max() <= 2
    assert len(film_of(tmp_path / "log.mp4")) == count
    assert render_log(log, Shot(tmp_path / "log.png", PRODUCT)) == 1
    pictures = [iio.imread(p).astype(int) for p in (folder / "end.png", tmp_path / "log.png")]
    assert np.abs(pictures[0] - pictures[1]).max() <= 2
    assert render_log(log, Shot(tmp_path / "then.png", SMALL, at=1.0)) == 1
    assert iio.imread(tmp_path / "then.png").shape == (SIZE[1], SIZE[0], 3)


@needs_gl
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interruption_leaves_a_film_of_what_was(layout, tmp_path: Path, error) -> None:
    simulation = Simulation(layout, RunRequest("mujoco", units=1))

    def interrupt(state: State) -> None:
        if state.time >= 1.0:
            raise error

    path = tmp_path / "cut.mp4"
    with pytest.raises(error), Film(simulation, path, SMALL, FPS) as film:
        simulation.run([film.observe, interrupt])
    assert len(film_of(path)) == film.frames == 11 + HELD
    assert [p.name for p in tmp_path.iterdir()] == ["cut.mp4"]


def test_nothing_is_left_of_a_film_without_frames(tmp_path: Path) -> None:
    with VideoFile(tmp_path / "none.mp4", SIZE, FPS):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".mp4", ".mkv"])
@pytest.mark.parametrize("fps", [10, *(pytest.param(n, marks=pytest.mark.slow) for n in (4, 30))])
def test_a_killed_process_leaves_all_but_the_last_second(
    tmp_path: Path, fps: int, ending: str
) -> None:
    path = tmp_path / f"k{ending}"
    code = (
        "import sys, numpy as np; from pathlib import Path;"
        "from factory.film.video import VideoFile;"
        f"v = VideoFile(Path({str(path)!r}), (64, 48), {fps});"
        "noise = np.random.default_rng(0).integers(0, 255, (60, 48, 64, 3), np.uint8);"
        "[v.write(frame) for frame in noise];"
        "print('written', flush=True); sys.stdin.read()"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **pipes, cwd=ROOT) as child:
        assert child.stdout is not None and child.stdout.readline() == b"written\n"
        child.kill()
    assert [left.name for left in tmp_path.iterdir()] == [path.name]
    assert 60 - fps <= len(film_of(path)) <= 60


def test_a_frame_that_cannot_be_encoded_is_no_secret(tmp_path: Path) -> None:
    with pytest.raises(ValueError), VideoFile(tmp_path / "bad.mp4", SIZE, FPS) as video:
        video.write(np.zeros((4, 4), np.uint8))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".mp4", ".mkv"])
@pytest.mark.parametrize(("fps", "count"), [(30, 1), (25, 7), (29.97, 40)])
def test_every_frame_is_in_the_file_in_order(
    tmp_path: Path, ending: str, fps: float, count: int
) -> None:
    path = tmp_path / f"grey{ending}"
    with VideoFile(path, (130, 62), fps) as video:
        for k in range(count):
            video.write(np.full((62, 130, 3), 40 + 4 * k, np.uint8))
    frames = film_of(path)
    assert frames.shape == (count, 62, 130, 3)
    assert np.allclose(frames.mean(axis=(1, 2, 3)), 40 + 4 * np.arange(count), atol=3)


@pytest.mark.parametrize("ending", [".mp4", ".mkv"])
def test_films_need_no_encoder_under_the_gpl(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    """Where FFmpeg has no libx264 they are VP9: all frames, in order; and no encoder is named."""
    import av

    whole = av.codec.Codec

    def without(name: str, mode: str = "r") -> Any:
        if name in hidden:
            raise av.codec.codec.UnknownCodecError(name)
        return whole(name, mode)

    hidden, path = {"libx264"}, tmp_path / f"grey{ending}"
    monkeypatch.setattr(av.codec, "Codec", without)
    with VideoFile(path, (64, 48), 25) as video:
        for k in range(30):
            video.write(np.full((48, 64, 3), 40 + 4 * k, np.uint8))
    with av.open(str(path)) as film:
        assert film.streams.video[0].codec_context.name == "vp9"
    frames = film_of(path)
    assert np.allclose(frames.mean(axis=(1, 2, 3)), 40 + 4 * np.arange(30), atol=3)
    hidden = {*ENCODERS}
    with pytest.raises(MissingError, match="need an encoder of FFmpeg: libx264, libvpx-vp9"):
        VideoFile(tmp_path / "none.mp4", (64, 48), 25)


def test_a_film_is_encoded_by_one_thread(tmp_path: Path) -> None:
    """As the encoder notes down in it: so the same pictures give the same film whatever number of
    cores a machine has."""
    path = tmp_path / "grey.mp4"
    with VideoFile(path, (1280, 720), FPS) as video:
        video.write(np.full((720, 1280, 3), 40, np.uint8))
    told = path.read_bytes()
    assert b" threads=1 " in told and b" lookahead_threads=1 " in told


# --- what is to be seen -----------------------------------------------------------------------


def missing_parts(layout, picture: np.ndarray) -> list[str]:
    """The parts whose hue has next to no pixel in the middle of the picture."""
    tall, wide = picture.shape[0] // 5, picture.shape[1] // 4
    picture = picture[tall:-tall, wide:-wide]
    red, green, blue = (picture[..., k].astype(float) for k in range(3))
    found = []
    for label, solid in layout.product.solids.items():
        hue = colorsys.rgb_to_hsv(*solid.rgba[:3])[0]
        pure = np.array(colorsys.hsv_to_rgb(hue, 1.0, 1.0)) - 1 / 3
        colour = np.stack([red, green, blue], axis=-1)
        tint = colour - colour.mean(axis=-1, keepdims=True)
        strength = np.linalg.norm(tint, axis=-1)
        pure = pure - pure.mean()
        like = (tint @ pure) > 0.97 * strength * np.linalg.norm(pure)
        if int((like & (strength > 40)).sum()) < 150:
            found.append(label)
    return found


@needs_gl
def test_every_part_is_in_the_picture_of_the_product(taken, layout) -> None:
    assert missing_parts(layout, iio.imread(taken[0] / "end.png")) == []


@needs_gl
def test_an_invisible_part_would_be_noticed(taken, layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("mujoco", units=1))
    m = simulation.world.m
    for g in range(m.ngeom):
        if m.geom(g).name.startswith("part/part2#"):
            m.geom_rgba[g, 3] = 0.0
    plain = replace(PRODUCT, caption=False)
    with Still(simulation, tmp_path / "end.png", plain) as end:
        simulation.run([end.observe])
    assert missing_parts(layout, iio.imread(tmp_path / "end.png")) == ["part2"]


@needs_gl
@pytest.mark.parametrize("size", [(320, 120), (192, 192), (120, 320)])
@pytest.mark.parametrize("camera", ["overview", "top"])
def test_the_factory_fills_pictures_of_any_shape(layout, tmp_path: Path, size, camera) -> None:
    simulation = Simulation(layout, RunRequest("mujoco", units=1))
    m, d = simulation.physical.m, simulation.world.d
    for joint in (m.joint(n) for n in range(m.njnt)):
        if joint.name.endswith("/slider"):  # rods are in the frame where they are highest
            d.qpos[joint.qposadr] = joint.range[1]
    Still(simulation, tmp_path / "a.png", Picture(size, camera, caption=False)).close()
    picture = iio.imread(tmp_path / "a.png").astype(int)
    floor = np.median(picture.reshape(-1, 3), axis=0)
    rows, columns = np.nonzero(np.abs(picture - floor).sum(axis=-1) > 90)
    framing = Framing(size[0] / size[1])  # its margins are fractions of the height
    tall = np.ptp(rows) / size[1] / (1 - framing.below - framing.above)
    wide = np.ptp(columns) / size[1] / (framing.aspect - 2 * framing.beside)
    assert max(tall, wide) > 0.91


@given(
    arrays.arrays(np.float64, (12, 3), elements=st.floats(-5, 5)),
    st.floats(0.3, 3),
    st.floats(-180, 180),
    st.floats(5, 90),
)
def test_a_fitted_view_has_all_points_in_the_frame_and_one_at_its_edge(
    points, aspect, azimuth, elevation
) -> None:
    points = points + np.eye(12, 3)
    framing = Framing(aspect, below=0.1)
    view = fit(points, towards(azimuth, elevation), framing)
    right, up, ahead = view.axes @ (points - view.position).T
    assert (ahead > 0).all()
    x, y = right / ahead / view.tall, up / ahead / view.tall
    side = aspect - 2 * framing.beside
    edges = [
        side - x.max(),
        x.min() + side,
        1 - 2 * framing.above - y.max(),
        y.min() + 1 - 2 * framing.below,
    ]
    assert min(edges) > -1e-6
    assert max(abs(edges[0]), abs(edges[1])) < 1e-6 or max(abs(edges[2]), abs(edges[3])) < 1e-6


def over(points: np.ndarray, framing: Framing) -> View:
    """The overview of points with nothing in front of them."""
    nothing = np.empty((0, 8, 3))
    return overview(Action(points[None], nothing, nothing, nothing), framing)


@pytest.mark.parametrize("look", [over, from_above])
def test_a_long_factory_is_not_looked_at_from_further_than_a_short_side_asks(look) -> None:
    long = np.array([(x, y, z) for x in (-3, 3) for y in (-0.5, 0.5) for z in (0, 0.2)], float)
    upright = look(long, Framing(9 / 16))
    turned = look(long[:, [1, 0, 2]], Framing(9 / 16))
    assert upright.distance < 1.5 * turned.distance


@needs_gl
def test_no_more_facets_are_drawn_than_are_seen(layout, tmp_path: Path) -> None:
    """Faces are whole, cylinders have two rings, the sky behind the floor is left out; a picture
    with all of that shows the same."""
    simulation = Simulation(layout, RunRequest("mujoco", units=1))
    subject = MonitorSubject.of_run(simulation)
    seen = simulation.state().observation
    shown = Snapshot.of(seen.qpos, seen.welds)
    look = Framing(16 / 9)
    with Painter(simulation.world.m, (320, 180), "overview", subject, look) as painter:
        few, quality = painter.paint(shown), painter.replica.m.vis.quality
        assert (quality.numquads, quality.numstacks) == (1, 2)
        assert not painter.renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX]
        painter.renderer.close()
        quality.numquads, quality.numstacks = 4, 16
        painter.renderer = Renderer(painter.replica, (320, 180))
        many = painter.paint(shown)
    change = np.abs(few.astype(int) - many).max(axis=-1)
    assert change.mean() < 0.1 and (change > 12).mean() < 1e-3 and few.std() > 10


def test_a_sky_is_drawn_where_the_floor_may_end() -> None:
    floor = np.array([(x, y, 0) for x in (-1, 1) for y in (-1, 1)], float)
    assert not fit(floor, towards(-62, 40), Framing(16 / 9)).has_sky
    assert fit(floor, towards(-62, 15), Framing(16 / 9)).has_sky


# --- meshes -----------------------------------------------------------------------------------


def test_an_open_mesh_is_seen_from_both_sides() -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    sheet = Mesh("m", corners, np.array([(0, 1, 2), (0, 1, 3)]))
    name, content = mesh_file(sheet)
    assert name == "m.obj" and content.count(b"\nf ") == 4
    whole = Mesh("m", corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]))
    assert mesh_file(whole)[0] == "m.stl"


def test_normals_are_sharp_at_edges_and_smooth_on_round_surfaces() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((1, 1, 1))
    cube = Mesh("m", box.vertices, box.faces)
    assert np.allclose(corner_normals(cube), face_normals(cube)[:, None])
    ball = trimesh.creation.icosphere(3)
    flipped = ball.faces.copy()
    flipped[::2] = flipped[::2, ::-1]
    normals = corner_normals(Mesh("m", ball.vertices, flipped))
    outward = ball.vertices[flipped] / np.linalg.norm(
        ball.vertices[flipped], axis=-1, keepdims=True
    )
    assert np.abs(np.abs((normals * outward).sum(axis=-1)) - 1).max() < 0.01


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "size", "fps", "words"),
    [
        ("a.gif", (64, 64), 30, "valid endings: .mp4, .mkv"),
        ("a", (64, 64), 30, "no ending"),
        ("a.mp4", (65, 64), 30, "66x64"),
        ("a.mp4", (64, 0), 30, "out of range"),
        ("a.mp4", (64, 99999), 30, "out of range"),
        ("a.mp4", (64, 64), 0, "frames per second"),
        ("a.mp4", (64, 64), float("nan"), "frames per second"),
    ],
)
def test_impossible_films_are_refused(path, size, fps, words) -> None:
    with pytest.raises(InputError, match="BadValue") as caught:
        check_output(path, size, fps)
    assert words in str(caught.value)


def test_a_still_may_have_an_odd_size() -> None:
    assert check_output("a.png", (65, 33), still=True) and check_output(
        "a.png", (65, 33), still=None
    )
    assert not check_output("A.MP4", (64, 32), still=None)
    with pytest.raises(InputError, match=r"valid endings: \.png$"):
        check_output("a.mp4", (64, 32), still=True)


def test_the_ideal_world_has_no_picture(layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("ideal", units=1))
    with pytest.raises(InputError, match="ideal world"):
        Film(simulation, tmp_path / "a.mp4")
    with LogWriter(tmp_path / "log", simulation) as log:
        simulation.run([log.observe])
    with pytest.raises(InputError, match="ideal world"):
        render_log(read_log(tmp_path / "log"), Shot(tmp_path / "a.mp4"))
    assert not (tmp_path / "a.mp4").exists()


# --- where GL is missing ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("variable", "value", "hint"),
    [
        ("MUJOCO_GL", "bogus", "set MUJOCO_GL=egl"),
        ("MUJOCO_GL", "disabled", "set MUJOCO_GL=egl"),
        ("__EGL_VENDOR_LIBRARY_DIRS", "/nowhere", gl.APT),
        ("PYOPENGL_PLATFORM", "glx", gl.APT),
    ],
)
def test_missing_gl_is_explained_with_what_mends_it(monkeypatch, variable, value, hint) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv(variable, value)
    with pytest.raises(MissingError, match="NoGL") as caught:
        gl.probe()
    found = caught.value.diagnostics[0]
    assert hint in found.hint and "\n" not in found.message and len(found.message) < 250
    assert caught.value.exit_status == 3
    monkeypatch.setattr(subprocess, "run", None)
    with pytest.raises(MissingError):
        gl.probe()
