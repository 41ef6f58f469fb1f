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
