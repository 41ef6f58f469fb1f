"""Getting started: `factory new`, defaults in the environment and in factory.toml, completion."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh

from factory.commands.new import LABELS
from factory.support.settings import RANGES, Settings
from factory.support.user_defaults import OPTIONS, load_defaults
from tests.command_line import Terminal, spawn
from tests.paths import PAPER, files_in

# --- factory new ----------------------------------------------------------------------------------


def test_a_new_product_runs_at_once(run: Terminal, tmp_path: Path) -> None:
    """Without warnings and clashes; the physics makes it."""
    folder = tmp_path / "handbell"
    assert run("new", folder).status == 0
    assert set(files_in(folder)) == {
        *("handbell.pag", "factory.toml", "README.md"),
        *("meshes/bell.stl", "meshes/grip.stl"),
    }
    pag = folder / "handbell.pag"
    document = run("check", pag, "--json").json
    assert (document["product"], document["labels"], document["live"]) == ("handbell", 7, True)
    assert document["clashes"] == []
    built = run("build", pag, "--json")
    assert built.json["warnings"] == []
    done = run("run", pag, "--json").json
    assert (done["products"], done["refines_net"], done["unintended_contacts"]) == (1, True, 0)
    for mesh in ("bell", "grip"):
        solid = trimesh.load(folder / "meshes" / f"{mesh}.stl")
        assert solid.is_watertight and solid.volume > 0


def test_the_new_product_is_told_as_it_is_made(run: Terminal, tmp_path: Path) -> None:
    """Its first line speaks of its own parts, by their labels, and of no others."""
    run("new", tmp_path / "bell-3")
    first = (tmp_path / "bell-3" / "bell-3.pag").read_text().splitlines()[0]
    parts = {"bell", "neck", "grip", "knob"}
    assert parts <= set(re.findall(r"[a-z]+", first.lower())) and "clapper" not in first


def test_the_commands_that_its_readme_tells_are_right(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("new", tmp_path / "bell-2")
    monkeypatch.chdir(tmp_path / "bell-2")
    told = re.findall(r"^ {4}factory ([^#\n]*)", Path("README.md").read_text(), re.M)
    assert [line.split()[0] for line in told] == ["check", "build", "run", "run"]
    for line in told[:3]:
        quick = ["--world", "ideal"] if "run" in line else []
        assert run(*line.split(), "-q", *quick).status == 0


def test_its_factory_toml_tells_every_key_and_its_default(run: Terminal, tmp_path: Path) -> None:
    """All are commented out; without the comment signs they change nothing."""
    run("new", tmp_path / "x")
    text = (tmp_path / "x" / "factory.toml").read_text()
    assert tomllib.loads(text) == {}
    said = tomllib.loads(re.sub(r"(?m)^# (?=\w+ = )", "", text))
    assert set(said) == {*RANGES, *OPTIONS} - {"settle", "wip"}
    usual = Settings(substeps=1)  # by default at least so many: that is all of them
    assert {k: v for k, v in said.items() if k in RANGES} == {
        k: getattr(usual, k) for k in RANGES if k != "settle"
    }
    (tmp_path / "x" / "factory.toml").write_text(re.sub(r"(?m)^# (?=\w+ = )", "", text))
    load_defaults(tmp_path / "x" / "factory.toml")


@pytest.mark.parametrize("name", ["a b", "é", "", "-x", "..", "root", "a;b", "a" * 70, *LABELS])
def test_names_that_no_product_can_have(run: Terminal, tmp_path: Path, name: str) -> None:
    done = run("new", "--json", "--", tmp_path / "sub" / name if name else "")
    assert (done.status, done.codes) == (2, ["BadValue"])
    assert files_in(tmp_path) == {}


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


# --- defaults -------------------------------------------------------------------------------------


@pytest.fixture
def pag(tmp_path: Path) -> Path:
    file = tmp_path / "p.pag"
    file.write_text(PAPER.read_text())
    return file


def test_options_come_before_the_environment_and_that_before_the_file(
    run: Terminal, pag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def units(*words: object) -> tuple[int, str]:
        found = run("run", pag, "--json", *words).json
        return found["units"], found["world"]

    assert units("--world", "ideal") == (1, "ideal")
    pag.with_name("factory.toml").write_text('world = "ideal"\nunits = 2\nseed = 3\n')
    assert units() == (2, "ideal")
    monkeypatch.setenv("FACTORY_UNITS", "3")
    assert units() == (3, "ideal")
    assert units("--units", 1) == (1, "ideal")
    monkeypatch.setenv("FACTORY_UNITS", "many")
    done = run("run", pag, "--json")
    assert done.codes == ["Usage"]
    assert "FACTORY_UNITS" in done.err


def test_settings_too(run: Terminal, pag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def seconds(*words: object) -> float:
        found = run("run", pag, "--world", "ideal", "--json", *words).json["sim_time_s"]
        assert isinstance(found, float)
        return found

    plain = seconds()
    settings = pag.with_name("factory.toml")
    settings.write_text("\ufeffspeed = 0.5\r\n")
    assert seconds() == plain
    settings.write_text("speed = 0.1 # slow\nacceleration = 1")
    slow = seconds()
    assert slow > 2 * plain
    assert seconds("--speed", 0.5, "--acceleration", 2) == plain
    monkeypatch.setenv("FACTORY_SPEED", "0.05")
    slower = seconds()
    assert plain < slow < slower
    assert seconds("--speed", 0.5, "--acceleration", 2) == plain
    monkeypatch.setenv("FACTORY_SPEED", "")
    assert seconds() == slow


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


def test_values_of_picture_options(run: Terminal, pag: Path) -> None:
    pag.with_name("factory.toml").write_text("size = '64x48'\nfloor = '0.1x0.1'")
    assert run("build", pag, "--json").codes == ["Layout"]
    assert run("build", pag, "--floor", "40x40", "-q").status == 0


# --- completion in the shell ----------------------------------------------------------------------


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


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(
    shell: str, run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    if shell == "bash" and shutil.which("bash") is None:
        pytest.skip("there is no bash")
    monkeypatch.setenv("_FACTORY_COMPLETE", f"{shell}_source")
    done = spawn() if shell == "bash" else run()
    assert done.status == 0
    assert "_FACTORY_COMPLETE" in done.out and "factory" in done.out
    if shell == "bash":
        checked = subprocess.run(["bash", "-n"], input=done.out, text=True, capture_output=True)
        assert (checked.returncode, checked.stderr) == (0, "")
