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

from tests.command_line import Terminal
from tests.pag_texts import MATE
from tests.paths import PAPER, ROOT, files_in

BROKEN = sorted((ROOT / "tests" / "broken").glob("*.pag"))
TEMPLATES = sorted((ROOT / "tests" / "broken").glob("*.op"))
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


# --- what libraries say ---------------------------------------------------------------------------

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


# --- broken files ---------------------------------------------------------------------------------


@pytest.mark.parametrize("file", BROKEN, ids=lambda p: p.stem)
def test_broken_files_write_nothing(run: Terminal, out: Path, file: Path) -> None:
    """By every command: the same errors, the same status, and nothing is written. A mesh that
    cannot be read is none of the concern of `programs` and `export`."""
    needed = [c for c in commands(out) if c[0] in ("build", "run", "render")]
    shape = run("check", file).status == 0
    for command, *options in needed if shape else commands(out):
        done = run(command, file, *options, "--json")
        assert done.status == 2
        errors = done.json["errors"]
        assert errors
        assert all(e["file"] and e["line"] >= 1 and e["col"] >= 1 for e in errors), command
        assert files_in(out) == {}


@pytest.mark.parametrize("file", TEMPLATES, ids=lambda p: p.stem)
def test_broken_templates_write_nothing(run: Terminal, out: Path, file: Path) -> None:
    folder = out.parent / "templates"
    folder.mkdir()
    (folder / file.name).write_bytes(file.read_bytes())
    for command, *options in [*commands(out), ["templates"]]:
        source = [] if command == "templates" else [PAPER]
        done = run(command, *source, *options, "--templates", folder, "--json")
        assert done.status == 2
        assert done.codes
    assert files_in(out) == {}


OWN = MATE.replace("mate =", "op =")


@pytest.fixture
def own(out: Path) -> Path:
    """A folder with a product of an operation of its own, and that operation."""
    (out / "op.op").write_text(OWN)
    (out / "p.pag").write_text("root = c; c = op(a, b); a = atomic(); b = atomic();")
    return out


def test_operations_of_ones_own_are_compiled(run: Terminal, own: Path) -> None:
    (own / "x").mkdir()
    for command, *options in commands(own / "x"):
        assert run(command, own / "p.pag", "--templates", own, *options).status == 0


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


def test_a_log_is_no_pag(run: Terminal, out: Path) -> None:
    """Who gives one is told which commands take it."""
    log = out.parent / "run.log"
    assert run("run", PAPER, "--world", "ideal", "--log", log, "-q").status == 0
    takers = {"render", "export"}
    others = [c for c in commands(out) if c[0] not in takers]
    for command, *options in [*others, ["analyze"], ["fidelity"], ["view"]]:
        done = run(command, log, *options, "--json")
        assert (done.status, done.codes) == (2, ["Usage"])
        (error,) = done.json["errors"]
        assert "is a log of a run" in error["message"]
        assert all(f"`{name}`" in error["hint"] for name in {"monitor", "report", *takers})
    assert files_in(out) == {}


def test_what_is_no_file(run: Terminal, out: Path) -> None:
    for file in (out, out / "missing.pag", "", "/dev/null", "x" * 300, "a\udcff.pag", PAPER / "x"):
        for command, *options in commands(out):
            assert run(command, file, *options, "--json").status == 2
    assert files_in(out) == {}


# --- options --------------------------------------------------------------------------------------

ODD = ["-1", "0", "nan", "inf", "-inf", "1e300", "1e-300", "", "abc", "9" * 400, "0x10", "--", "٣"]

OF_MOTION = ["--speed", "--acceleration", "--force", "--timestep", "--substeps", "--clearance"]


@pytest.mark.parametrize("option", [*OF_MOTION, "--floor", "--units", "--wip"])
def test_odd_numbers_for_build(run: Terminal, out: Path, option: str) -> None:
    for value in ODD:
        done = run("build", PAPER, option, value, "--mjcf", out / "m.xml", "--json")
        assert done.status in (0, 2), value
        for name in ("m.xml", "m.mjb", "m.mjb.seal") if done.status == 0 else ():
            (out / name).unlink()
        assert files_in(out) == {}


@pytest.mark.parametrize(
    "option",
    [
        "--units",
        "--seed",
        "--jitter",
        "--wip",
        "--from",
        "--max-time",
        "--world",
        "--size",
        "--fps",
    ],
)
def test_odd_numbers_for_run(run: Terminal, out: Path, option: str) -> None:
    limit = [] if option == "--max-time" else ["--max-time", "9"]
    for value in ODD:
        words = [option, value, "--world", "ideal"] if option != "--world" else [option, value]
        done = run("run", PAPER, *words, *limit, "--log", out / "run.log", "--json")
        assert done.status in (0, 1, 2), value
        if done.status == 2:
            assert files_in(out) == {}
        (out / "run.log").unlink(missing_ok=True)


# --- outputs --------------------------------------------------------------------------------------

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


def test_a_link_leads_to_the_file(run: Terminal, out: Path) -> None:
    (out / "real").mkdir()
    (out / "link.dot").symlink_to(out / "real" / "net.dot")
    assert run("export", PAPER, "--format", "dot", "-o", out / "link.dot").status == 0
    assert (out / "link.dot").is_symlink()
    assert (out / "real" / "net.dot").read_text().startswith("digraph")


def test_links_to_themselves(run: Terminal, out: Path) -> None:
    one, other = out / "one", out / "other"
    one.symlink_to(other)
    other.symlink_to(one)
    for command, *options in commands(out):
        assert run(command, one, *options, "--json").codes == ["BadFile"]
    for command, *options in OUTPUTS:
        assert run(command, PAPER, *options, one, "--json").status == 2
    assert one.is_symlink() and other.is_symlink()


@pytest.mark.parametrize(
    "name", ["p.xml", "p.mjb", "p.mjb.seal", "p.svg", "p.dot", "p.proof.json", "p_meshes"]
)
def test_what_build_names_itself_is_no_link(run: Terminal, out: Path, name: str) -> None:
    """It would be written elsewhere."""
    (out / "part.obj").write_bytes((ROOT / "tests/broken/bricks/3001.obj").read_bytes())
    (out / "p.pag").write_text('root = p; p = atomic(mesh = "part.obj")')
    (out / "elsewhere").mkdir()
    (out / "x").mkdir()
    link = out / "x" / name
    link.symlink_to(out / "elsewhere" / ("" if name == "p_meshes" else "victim"))
    before = files_in(out)
    assert run("build", out / "p.pag", "-o", out / "x", "--json").codes == ["BadFile"]
    assert files_in(out) == before
    link.unlink()
    assert run("build", out / "p.pag", "-o", out / "x", "--json").status == 0


@pytest.mark.parametrize(
    ("name", "words"), [("p.xml", ["-o", "."]), ("p.mjb", ["--mjcf", "p.xml"])]
)
def test_what_build_names_itself_is_not_the_input(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: list[str]
) -> None:
    monkeypatch.chdir(out)
    (out / name).write_bytes(PAPER.read_bytes())
    assert run("build", name, *words, "--json").codes == ["BadFile"]
    assert files_in(out) == {name: PAPER.read_bytes()}


def test_meshes_are_not_written_over(run: Terminal, out: Path) -> None:
    brick = (ROOT / "tests/broken/bricks/3001.obj").read_bytes()
    (out / "p_meshes").mkdir()
    (out / "p.pag").write_text('root = p; p = atomic(mesh = "part.obj")')
    (out / "part.obj").write_bytes(brick)
    assert run("build", out / "p.pag", "-o", out / "x").status == 0
    (made,) = (out / "x" / "p_meshes").iterdir()
    (out / "p.pag").write_text(f'root = p; p = atomic(mesh = "p_meshes/{made.name}")')
    (out / "p_meshes" / made.name).write_bytes(made.read_bytes())
    before = files_in(out)
    assert run("build", out / "p.pag", "-o", out, "--json").codes == ["BadFile"]
    assert files_in(out) == before


@pytest.mark.parametrize("name", ["x" * 210, "é" * 122])
def test_long_names_are_built(run: Terminal, out: Path, name: str) -> None:
    """Those that begin alike are different files."""
    file = out / f"{name}.pag"
    file.write_bytes(PAPER.read_bytes())
    done = run("build", file, "-o", out / "x", "--json")
    if done.status == 0:
        written = files_in(out / "x")
        assert b"<mujoco" in written[f"{name}.xml"] and b"<svg" in written[f"{name}.svg"]
    else:  # a name of ours is longer than a name may be
        assert done.codes == ["BadFile"]
        assert files_in(out) == {file.name: PAPER.read_bytes()}


def test_folders_that_could_not_all_be_made_are_none(run: Terminal, out: Path) -> None:
    assert run("build", PAPER, "-o", out / "one" / ("x" * 300), "--json").codes == ["BadFile"]
    assert not (out / "one").exists()


def test_who_may_read_a_file_stays(run: Terminal, out: Path) -> None:
    file = out / "net.dot"
    file.touch(0o600)
    assert run("export", PAPER, "--format", "dot", "-o", file).status == 0
    assert file.stat().st_mode & 0o777 == 0o600


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


def test_a_build_is_written_whole_or_not_at_all(run: Terminal, out: Path) -> None:
    """The mesh folder's name is taken by a file."""
    (out / "part.obj").write_bytes((ROOT / "tests/broken/bricks/3001.obj").read_bytes())
    (out / "p.pag").write_text('root = p; p = atomic(mesh = "part.obj")')
    (out / "p_meshes").write_text("mine")
    before = files_in(out)
    assert run("build", out / "p.pag", "--mjcf", out / "p.xml", "--json").codes == ["BadFile"]
    assert run("build", out / "p.pag", "-o", out, "--json").codes == ["BadFile"]
    assert files_in(out) == before


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
