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

import factory
from factory.apps.log import LogWriter, read_log
from factory.apps.runs.pictures import render_log
from factory.engine.mjcf.mesh_files import mesh_file
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import Film, Picture, Still, check_output
from factory.film.finale import LASTS
from factory.film.picture import from_above
from factory.film.reel import HOLD
from factory.film.shot import Shot
from factory.floor.geometry.meshes import Mesh
from factory.support import gl
from factory.support.errors import InputError, MissingError
from factory.support.pictures.sight import Framing
from factory.support.pictures.video import ENCODERS, VideoFile
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
def test_the_picture_is_not_blank_and_changes(taken) -> None:
    frames = film_of(taken[0] / "run.mp4").astype(int)
    assert all(frame.std() > 10 for frame in frames)
    factory_only = frames[: -HELD - TURNED, : int(0.8 * SIZE[1])]
    changed = [np.abs(a - b).max() for a, b in pairwise(factory_only)]
    assert np.mean(np.array(changed) > 30) > 0.6


@pytest.mark.parametrize("ending", [".mp4", ".mkv"])
@pytest.mark.parametrize("fps", [10, *(pytest.param(n, marks=pytest.mark.slow) for n in (4, 30))])
def test_a_killed_process_leaves_all_but_the_last_second(
    tmp_path: Path, fps: int, ending: str
) -> None:
    path = tmp_path / f"k{ending}"
    code = (
        "import sys, numpy as np; from pathlib import Path;"
        "from factory.support.pictures.video import VideoFile;"
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


def test_films_need_no_encoder_under_the_gpl(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where FFmpeg has no libx264 they are VP9: all frames, in order; and no encoder is named."""
    import av

    whole = av.codec.Codec

    def without(name: str, mode: str = "r") -> Any:
        if name in hidden:
            raise av.codec.codec.UnknownCodecError(name)
        return whole(name, mode)

    hidden, path = {"libx264"}, tmp_path / "grey.mkv"
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


def test_a_long_factory_is_not_looked_at_from_further_than_a_short_side_asks() -> None:
    look = from_above
    long = np.array([(x, y, z) for x in (-3, 3) for y in (-0.5, 0.5) for z in (0, 0.2)], float)
    upright = look(long, Framing(9 / 16))
    turned = look(long[:, [1, 0, 2]], Framing(9 / 16))
    assert upright.distance < 1.5 * turned.distance


def test_an_open_mesh_is_seen_from_both_sides() -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    sheet = Mesh("m", corners, np.array([(0, 1, 2), (0, 1, 3)]))
    name, content = mesh_file(sheet)
    assert name == "m.obj" and content.count(b"\nf ") == 4
    whole = Mesh("m", corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]))
    assert mesh_file(whole)[0] == "m.stl"


@pytest.mark.parametrize(
    ("path", "size", "fps", "words"), [("a.mp4", (64, 64), float("nan"), "frames per second")]
)
def test_impossible_films_are_refused(path, size, fps, words) -> None:
    with pytest.raises(InputError, match="BadValue") as caught:
        check_output(path, size, fps)
    assert words in str(caught.value)


def test_the_ideal_world_has_no_picture(layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("ideal", units=1))
    with pytest.raises(InputError, match="ideal world"):
        Film(simulation, tmp_path / "a.mp4")
    with LogWriter(tmp_path / "log", simulation) as log:
        simulation.run([log.observe])
    with pytest.raises(InputError, match="ideal world"):
        render_log(read_log(tmp_path / "log"), Shot(tmp_path / "a.mp4"))
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.parametrize(
    ("variable", "value", "hint"),
    [
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
