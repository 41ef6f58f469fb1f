"""Getting started: `factory new`, defaults in the environment and in factory.toml, completion."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from factory.support.settings import Settings
from factory.support.user_defaults import OPTIONS, load_defaults
from tests.command_line import Terminal, spawn
from tests.paths import PAPER, files_in


def test_its_factory_toml_tells_every_key_and_its_default(run: Terminal, tmp_path: Path) -> None:
    """All are commented out; without the comment signs they change nothing."""
    run("new", tmp_path / "x")
    text = (tmp_path / "x" / "factory.toml").read_text()
    assert tomllib.loads(text) == {}
    said = tomllib.loads(re.sub(r"(?m)^# (?=\w+ = )", "", text))
    assert set(said) == {*Settings.RANGES, *OPTIONS} - {"settle", "wip"}
    usual = Settings(substeps=1)  # by default at least so many: that is all of them
    assert {k: v for k, v in said.items() if k in Settings.RANGES} == {
        k: getattr(usual, k) for k in Settings.RANGES if k != "settle"
    }
    (tmp_path / "x" / "factory.toml").write_text(re.sub(r"(?m)^# (?=\w+ = )", "", text))
    load_defaults(tmp_path / "x" / "factory.toml")


def test_what_is_there_is_left_alone(run: Terminal, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    assert run("new", tmp_path / "a").status == 0
    before = files_in(tmp_path)
    assert run("new", tmp_path / "a", "--json").codes == ["BadFile"]
    (tmp_path / "b").write_text("mine")
    assert run("new", tmp_path / "b", "--json").codes == ["BadFile"]
    (tmp_path / "c").symlink_to(tmp_path / "nowhere")
    assert run("new", tmp_path / "c", "--json").codes == ["BadFile"]
    assert {k: v for k, v in files_in(tmp_path).items() if k != "b"} == before


@pytest.fixture
def pag(tmp_path: Path) -> Path:
    file = tmp_path / "p.pag"
    file.write_text(PAPER.read_text())
    return file


def test_faults_of_the_environment_name_the_variable(
    run: Terminal, pag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("SPEED", "fast"), ("EPS", "nan"), ("SUBSTEPS", "2.5"), ("FORCE", "-1")):
        monkeypatch.setenv(f"FACTORY_{name}", value)
    done = run("build", pag, "--json")
    assert done.codes == ["BadValue"] * 4
    for name in ("FACTORY_SPEED", "FACTORY_EPS", "FACTORY_SUBSTEPS", "FACTORY_FORCE"):
        assert f"BadValue in the environment {name}: " in done.err


def test_each_command_takes_what_it_has_an_option_for(
    run: Terminal, pag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folders are relative to the file; a file beside the PAG takes precedence over the one in the
    current folder."""
    mine = pag.parent / "mine"
    mine.mkdir()
    (mine / "join.op").write_text("nonsense")
    monkeypatch.chdir(mine)
    pag.with_name("factory.toml").write_text("units = 3\ntemplates = ['mine']")
    for command in (("check",), ("programs",), ("export", "--format", "dot")):
        assert run(command[0], pag, *command[1:], "--json").codes[0] == "Syntax"
    pag.with_name("factory.toml").write_text("units = 3")
    (mine / "factory.toml").write_text("nonsense = 1")
    assert run("check", pag, "-q").status == 0
    pag.with_name("factory.toml").unlink()
    assert run("check", pag, "--json").codes == ["UnknownParameter"]


Completions = Callable[[str], list[str]]


@pytest.fixture
def completions(run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Completions:
    """The completions of the last of some words in a shell, in the folder of the test."""
    monkeypatch.chdir(tmp_path)

    def completed(words: str) -> list[str]:
        monkeypatch.setenv("_FACTORY_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        lines = run().out.splitlines()
        monkeypatch.delenv("_FACTORY_COMPLETE")
        return [line.partition(",")[2] for line in lines if line.startswith("plain,")]

    return completed


def test_commands_options_codes_and_products_are_completed(
    completions: Completions, tmp_path: Path
) -> None:
    for name in ("lamp.pag", "log.txt", ".hidden.pag", "stand.pag"):
        (tmp_path / name).write_text("")
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "chair.pag").write_text("")
    assert completions("factory im") == ["import"]
    assert {"check", "run", "new"} <= set(completions("factory "))
    assert completions("factory check ") == ["lamp.pag", "stand.pag", "more/"]
    assert completions("factory run l") == ["lamp.pag"]
    assert completions("factory run more/") == ["more/chair.pag"]
    assert completions("factory run lamp.pag --wo") == ["--world"]
    assert completions("factory run --world ") == ["mujoco", "ideal"]
    assert completions("factory --explain undef") == ["UndefinedLabel"]
    assert "stl" in completions("factory export x.pag --format s")
    assert completions("factory render x.pag --with g") == ["gantt"]


def test_cameras_are_completed_with_the_labels_of_the_file(
    completions: Completions, run: Terminal, tmp_path: Path
) -> None:
    cameras = ["tour", "overview", "orbit", "top", "product"]
    labels = ["part1", "part2", "part3", "sub1", "sub2", "sub3"]
    parts = [f"part:{label}" for label in labels[:3]]
    taken = [f"handover:{label}" for label in labels]
    log = tmp_path / "run.log"
    assert run("run", PAPER, "--log", log, "--max-time", "0.1", "-q").status in (0, 1)
    for file in (PAPER, log):
        assert completions(f"factory render {file} --camera ") == cameras + parts + taken
    assert completions(f"factory run {PAPER} --units 2 --camera part:") == parts
    assert completions(f"factory run {PAPER} --units 2 --camera hand") == taken
    assert completions("factory render --camera o") == ["overview", "orbit"]
    (tmp_path / "broken.pag").write_text("root = ")
    for file in ("broken.pag", "missing.pag"):
        assert completions(f"factory run {file} --camera ") == cameras


def test_bash_gets_its_script(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")
    monkeypatch.setenv("_FACTORY_COMPLETE", "bash_source")
    done = spawn()
    assert done.status == 0
    assert "_FACTORY_COMPLETE" in done.out and "factory" in done.out
    checked = subprocess.run(["bash", "-n"], input=done.out, text=True, capture_output=True)
    assert (checked.returncode, checked.stderr) == (0, "")
