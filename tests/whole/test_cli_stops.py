"""The command line when a run comes to no good end, when it is stopped, and on machines that lack
something."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from factory.film.reel import Reel
from tests.command_line import Terminal, spawn_each
from tests.core.test_progress import STOPPED, stopped
from tests.paths import PAPER, ROOT, files_in


@pytest.mark.parametrize(
    ("geometry", "status"),
    [
        ("sphere = 0.02, mass = 1e11", {0, 1}),
        ("sphere = 1, pos = (1e300, 0, 0)", {2}),
        ("sphere = 1, density = 1e300", {2}),
        ("sphere = 1e-150, density = 1e-300", {2}),
    ],
)
def test_absurd_products_come_to_an_end(
    run: Terminal, out: Path, geometry: str, status: set[int]
) -> None:
    file = out / "p.pag"
    file.write_text(f"root = s; s = mate(a, b); a = atomic({geometry}); b = atomic()")
    done = run("run", file, "--max-time", 10, "--json")
    assert done.status in status
    if done.status == 2:
        assert done.codes == ["BadValue"]
        assert done.json["errors"][0]["col"] in (44, 47, 56, 60)
    assert "RuntimeWarning" not in done.err


def test_a_film_that_is_stopped_in_its_first_frame_leaves_no_file(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Reel, "until", stopped)
    monkeypatch.setattr("factory.support.gl.probe", lambda: None)
    film = out / "film.mp4"
    assert run("render", PAPER, "-o", film, "--size", "64x48").status == 130
    assert list(out.iterdir()) == []


WITHOUT_GL = {
    "bogus": {"MUJOCO_GL": "bogus"},
    "a screen": {"MUJOCO_GL": "glfw", "DISPLAY": "", "WAYLAND_DISPLAY": ""},
    "osmesa": {"MUJOCO_GL": "osmesa"},
    "EGL drivers": {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere", "LIBGL_DRIVERS_PATH": "/nowhere"},
}

FILMS = (["run", PAPER, "--video"], ["render", PAPER, "-o"])


@pytest.mark.parametrize("lacking", WITHOUT_GL)
def test_only_pictures_need_gl(out: Path, lacking: str) -> None:
    commands = [
        *(["check", PAPER, "-q"], ["build", PAPER, "--mjcf", out / "m.xml", "-q"]),
        *(["programs", PAPER, "-q"], ["export", PAPER, "--format", "pnml", "-q"]),
        ["run", PAPER, "-q"],
    ]
    for done in spawn_each(*commands, **WITHOUT_GL[lacking]):
        assert done.status == 0, done


def test_films_without_gl_say_what_to_install(out: Path) -> None:
    commands = [[*words, out / "f.mp4", "--json"] for words in FILMS]
    for done in spawn_each(*commands, MUJOCO_GL="bogus"):
        assert done.status == 3
        assert "MUJOCO_GL=egl" in done.json["errors"][0]["hint"]
    assert files_in(out) == {}


@pytest.fixture
def bare(tmp_path: Path) -> str:
    """A PYTHONPATH on which importing mujoco fails."""
    (tmp_path / "bare" / "mujoco").mkdir(parents=True)
    text = 'raise ModuleNotFoundError("No module named \'mujoco\'", name="mujoco")'
    (tmp_path / "bare" / "mujoco" / "__init__.py").write_text(text)
    return f"{tmp_path / 'bare'}:{ROOT}"


def test_without_the_engine(bare: str, out: Path) -> None:
    without = (
        *(["check", PAPER, "-q"], ["programs", PAPER, "-q"]),
        *(["export", PAPER, "--format", "dot", "-q"], ["run", PAPER, "--world", "ideal", "-q"]),
    )
    needing = (["run", PAPER, "--log", out / "l"], ["build", PAPER, "-o", out / "all"], ["doctor"])
    commands = *without, *([*words, "--json"] for words in needing)
    *answers, doctor = spawn_each(*commands, PYTHONPATH=bare)
    assert [done.status for done in answers] == [0, 0, 0, 0, 3, 3]
    for done in answers[4:]:
        assert "mujoco" in done.json["errors"][0]["message"]
        assert done.json["errors"][0]["hint"] == "pip install mujoco"
    done = doctor
    assert done.status == 3
    assert {c["name"] for c in done.json["checks"] if not c["ok"]} == {"engine", "rendering"}
    assert list(out.iterdir()) == []


def test_the_engine_warns_on_stderr(out: Path) -> None:
    """Not on stdout, where a document may be, and not in a file in the current folder."""
    code = (
        "from factory.support.engine import mujoco\n"
        "m = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body><freejoint/>"
        '<geom size=".1"/></body></worldbody></mujoco>\')\n'
        "d = mujoco.MjData(m); d.qvel[0] = float('nan'); mujoco.mj_step(m, d)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=out,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("engine: ")
    assert files_in(out) == {}


@pytest.mark.parametrize(
    ("package", "call"),
    [
        ("av", "from factory.film.video import _av as called"),
        ("mujoco.egl", "from factory.support.gl import context\ncalled = lambda: context(8, 8)"),
    ],
)
def test_a_signal_while_a_package_of_pictures_is_imported_is_heard(
    tmp_path: Path, package: str, call: str
) -> None:
    """In a program that uses the library, though the package takes whatever is raised for a library
    that is missing."""
    code = f"""
import signal, sys, types
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
class Deaf(MetaPathFinder, Loader):
    def find_spec(self, name, path=None, target=None):
        return ModuleSpec(name, self) if name == {package!r} else None
    def create_module(self, spec):
        return None
    def exec_module(self, module):
        module.GLContext = lambda *size: types.SimpleNamespace(make_current=lambda: None)
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException:
            pass
{call}
sys.meta_path.insert(0, Deaf())
try:
    called()
except KeyboardInterrupt:
    print("heard")
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MUJOCO_GL": "egl"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, cwd=tmp_path
    )
    assert done.stdout == "heard\n", done.stderr


COMMAND = (
    f"{STOPPED}from factory import commands\n"
    "commands.cli.main = lambda *_, **__: __import__('stops') and 5\ncommands.main(['run'])"
)


def test_a_signal_while_something_is_imported(tmp_path: Path) -> None:
    done = stopped(tmp_path, COMMAND, "missing")
    assert done.returncode == 130, done.stderr
