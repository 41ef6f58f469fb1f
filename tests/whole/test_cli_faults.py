"""The command line under ill treatment: no traceback for any input, no half of a file, and a status
that says whose fault it was."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from factory.film.reel import Reel
from tests.command_line import Terminal, spawn_each
from tests.core.test_progress import STOPPED, stopped
from tests.paths import PAPER, ROOT, files_in

SMALL = ["--size", "64x48", "--fps", "5"]
"""Films that are soon taken."""


def commands(folder: Path) -> list[list[object]]:
    """Every command that takes a PAG, with everything that it can write."""
    return [
        ["check", "--certificate", folder / "proof.json"],
        ["build", "--mjcf", folder / "model.xml", "-o", folder / "all"],
        ["run", "--log", folder / "run.log", "--video", folder / "run.mp4", *SMALL],
        ["render", "-o", folder / "film.mp4", *SMALL],
        ["programs"],
        ["export", "--format", "dot", "-o", folder / "net.dot"],
    ]


WARNS = """
import numpy
from factory import commands
commands.run_command = lambda words: int(numpy.float64(0) / numpy.float64(0) > 1)
commands.main([])
"""
"""A command in which a library warns."""


def test_warnings_of_libraries_are_for_programmers() -> None:
    said = [
        subprocess.run([sys.executable, *options, "-c", WARNS], capture_output=True, text=True)
        for options in ((), ("-W", "default"))
    ]
    assert [done.returncode for done in said] == [0, 0]
    assert said[0].stderr == "" and "RuntimeWarning" in said[1].stderr


def garbage() -> dict[str, bytes]:
    """Files that nobody would write."""
    draw = random.Random(7)
    mangled = bytearray(PAPER.read_bytes())
    for _ in range(20):
        mangled[draw.randrange(len(mangled))] = draw.choice(b'(){}=;,<>"\\\x00 /')
    return {
        "random.pag": draw.randbytes(4000),
        "zero.pag": bytes(500),
        "mangled.pag": bytes(mangled),
        "utf16.pag": PAPER.read_text().encode("utf-16"),
        "open.pag": b"root = s; s = mate(" + b"(" * 20_000,
        "nested.pag": b"root = s; s = " + b"mate(" * 20_000,
        "signs.pag": b"root = s; s = a" * 1000,
        "quotes.pag": b'root = s; s = atomic(mesh = "' + b"x" * 70_000,
        "unclosed.pnml": b"<pnml><net><place id='p'/>",
        "random.pnml": draw.randbytes(4000),
        "empty.pnml": b"",
        "bomb.pnml": b'<!DOCTYPE l [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><pnml>&b;</pnml>',
        "deep.pnml": b"<a>" * 5_000 + b"</a>" * 5_000,
        "other.pnml": b"<html><body/></html>",
    }


@pytest.mark.parametrize("name", garbage())
def test_garbage(run: Terminal, out: Path, name: str) -> None:
    file = out.parent / name
    file.write_bytes(garbage()[name])
    for command, *options in commands(out):
        done = run(command, file, *options, "--json")
        assert done.status == 2, done
        assert done.codes
    assert files_in(out) == {}


OUTPUTS = [
    ["build", "--mjcf"],
    ["build", "-o"],
    ["check", "--certificate"],
    ["run", "--log"],
    ["run", "--video"],
    ["export", "--format", "pnml", "-o"],
    ["render", "-o"],
]


@pytest.mark.parametrize("words", OUTPUTS, ids=" ".join)
def test_places_where_nothing_can_be_written(run: Terminal, out: Path, words: list[str]) -> None:
    command, *options = words
    end = ".mp4" if "--video" in words or command == "render" else ".xml"
    file = out.parent / f"file{end}"
    file.write_text("mine")
    places: list[object] = [file / f"below{end}"]
    if end != ".mp4":  # that is known only when the film is begun
        places.append(f"/proc/x{end}")
    if words != ["build", "-o"]:
        places += [out, out / "missing" / f"x{end}", ""]
    for place in places:
        assert run(command, PAPER, *options, place, "--json").status == 2, place
    assert files_in(out) == {}
    assert file.read_text() == "mine"


@pytest.mark.parametrize("words", OUTPUTS, ids=" ".join)
def test_the_input_is_never_overwritten(run: Terminal, out: Path, words: list[str]) -> None:
    file = out / "p.pag"
    file.write_bytes(PAPER.read_bytes())
    command, *options = words
    assert run(command, file, *options, out / ".." / "out" / "p.pag", "--json").status == 2
    assert files_in(out) == {"p.pag": PAPER.read_bytes()}


def test_a_folder_that_may_not_be_written(run: Terminal, out: Path) -> None:
    out.chmod(0o500)
    try:
        if os.access(out, os.W_OK):
            pytest.skip("this user may write everywhere (root)")
        for command, *options in commands(out):
            if options and command != "programs":
                assert run(command, PAPER, *options, "--json").status == 2
    finally:
        out.chmod(0o700)


def test_a_file_that_may_not_be_read(run: Terminal, out: Path) -> None:
    file = out / "secret.pag"
    file.write_bytes(PAPER.read_bytes())
    file.chmod(0)
    if os.access(file, os.R_OK):
        pytest.skip("this user may read everything (root)")
    assert run("check", file, "--json").codes == ["BadFile"]


def test_devices_are_written_in_place(run: Terminal, out: Path) -> None:
    assert run("export", PAPER, "--format", "dot", "-o", "/dev/null").status == 0
    assert run("export", PAPER, "--format", "dot", "-o", "/dev/full").status == 2
    assert Path("/dev/null").is_char_device()
    pipe = out / "pipe"
    os.mkfifo(pipe)
    words = [sys.executable, "-m", "factory", "export", PAPER, "--format", "dot", "-o", pipe]
    with subprocess.Popen(words, cwd=ROOT):
        assert pipe.read_text().startswith("digraph")


@pytest.mark.parametrize(("name", "words"), [("p.xml", ["-o", "."])])
def test_what_build_names_itself_is_not_the_input(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: list[str]
) -> None:
    monkeypatch.chdir(out)
    (out / name).write_bytes(PAPER.read_bytes())
    assert run("build", name, *words, "--json").codes == ["BadFile"]
    assert files_in(out) == {name: PAPER.read_bytes()}


def test_folders_that_could_not_all_be_made_are_none(run: Terminal, out: Path) -> None:
    assert run("build", PAPER, "-o", out / "one" / ("x" * 300), "--json").codes == ["BadFile"]
    assert not (out / "one").exists()


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_what_nobody_can_be_told(out: Path, unbuffered: str) -> None:
    """The status says it: no traceback, on a full disk."""
    broken = [sys.executable, "-m", "factory", "check", str(out / "nope.pag"), "--json"]
    variables = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with open("/dev/full", "w") as full:
        for said, told in (("stdout", "stderr"), ("stderr", "stdout")):
            streams: dict[str, Any] = {said: full, told: subprocess.PIPE}
            done = subprocess.run(broken, cwd=ROOT, env=variables, text=True, **streams)
            assert done.returncode == 2
            assert "Traceback" not in (getattr(done, told) or "")


def test_streams_that_are_closed_or_full() -> None:
    factory = f"{sys.executable} -m factory"
    for command, status in (
        (f"{factory} check {PAPER} > /dev/full", 2),
        (f"{factory} check {PAPER} >&-", 0),
        (f"{factory} check missing.pag --json 2>&- | {sys.executable} -m json.tool", 0),
        (f"{factory} templates | true", 0),
        (f"PYTHONIOENCODING=ascii {factory} programs {PAPER}", 0),
    ):
        done = subprocess.run(command, shell=True, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == status, command
        assert "Traceback" not in done.stderr
        assert "Exception" not in done.stderr


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
        ("av", "from factory.support.pictures.video import _av as called"),
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
