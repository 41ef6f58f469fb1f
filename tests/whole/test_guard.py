"""No command writes over what it reads, whatever the path of the output, and says so before the
work."""

from __future__ import annotations

import os
import shutil
import sys
from itertools import cycle
from pathlib import Path

import pytest
import trimesh

import factory
from factory.pipeline import Project
from factory.support.errors import InputError
from tests.command_line import Terminal
from tests.pag_texts import MATE
from tests.paths import files_in

MIX = """mix = 1 c, 1 d; c = op(a, b); d = op(a, e);
a = atomic(mesh = "part.obj"); b = atomic(); e = atomic();"""


def by_another_path(file: Path) -> Path:
    return Path("sub", "..", os.path.relpath(file))


def by_symbolic_link(file: Path) -> Path:
    Path("symbolic.mp4").symlink_to(file)
    return Path("symbolic.mp4")


def by_hard_link(file: Path) -> Path:
    os.link(file, "hard.mp4")
    return Path("hard.mp4")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an input of each kind."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "loose").mkdir()
    for name, height in (("part.obj", 0.0), ("loose/one.obj", 0.0), ("loose/two.obj", 10.0)):
        box = trimesh.creation.box((20, 20, 10))
        box.apply_translation((0, 0, height)).export(folder / name)
    (folder / "sub").mkdir()
    (folder / "ops").mkdir()
    (folder / "ops" / "op.op").write_text(MATE.replace("mate =", "op ="))
    (folder / "p.pag").write_text(
        'root = c; c = op(a, b); a = atomic(mesh = "part.obj"); b = atomic();'
    )
    (folder / "new.pag").write_text("root = c; c = mate(a, b); a = atomic(); b = atomic();")
    (folder / "mix.pag").write_text(MIX)
    (folder / "factory.toml").write_text("units = 2\n")
    (folder / "faults.toml").write_text("")
    (folder / "orders.csv").write_text("product\nc\n")
    (folder / "own").mkdir()
    (folder / "own" / "mine.py").write_text(
        'FORMAT, TAKES = "mine", "pag"\ndef export(subject):\n    "Mine."\n    return "x"\n'
    )
    (folder / "tree.json").write_text('{"name": "t", "children": ["part.obj", "loose/two.obj"]}')
    factory.run(folder / "new.pag", "ideal", log=folder / "run.log")
    factory.build(folder / "new.pag", folder)
    return folder


OPS = ["--templates", "ops"]
NAMED: list[tuple[list[str], list[str], str]] = [
    (["check", "p.pag", *OPS], ["--certificate"], "p.pag ops/op.op factory.toml part.obj"),
    (["check", "new.pag", "--against", "new.proof.json"], ["--certificate"], "new.proof.json"),
    (["check", "new.pnml"], ["--certificate"], "new.pnml"),
    (["build", "p.pag", *OPS], ["--mjcf"], "p.pag ops/op.op factory.toml part.obj"),
    (["build", "plan.json"], ["--mjcf"], "plan.json layout.json new.pag"),
    (
        ["run", "mix.pag", *OPS, "--faults", "faults.toml", "--demand", "orders.csv"],
        ["--log", "--video", "--poster"],
        "mix.pag ops/op.op factory.toml part.obj faults.toml orders.csv",
    ),
    (["render", "p.pag", *OPS], ["-o"], "p.pag factory.toml"),
    (["render", "run.log"], ["-o", "-o x.mp4 --poster"], "run.log"),
    (["report", "run.log"], ["-o"], "run.log"),
    (["report", "p.pag", *OPS], ["-o"], "p.pag ops/op.op factory.toml part.obj"),
    (["fidelity", "p.pag", *OPS], ["-o"], "p.pag ops/op.op factory.toml part.obj"),
    (["sweep", "p.pag", *OPS, "--vary", "seed=0:2"], ["-o"], "p.pag ops/op.op part.obj"),
    (["mix", "p.pag", "new.pag", *OPS], ["-o"], "p.pag new.pag ops/op.op part.obj"),
    (["revise", "p.pag", "new.pag", *OPS], ["--picture"], "p.pag new.pag ops/op.op part.obj"),
    (["revise", "plan.json", "new.pag"], ["--picture"], "plan.json layout.json new.pag"),
    (
        ["export", "p.pag", *OPS, "--format", "mine", "--exporters", "own"],
        ["-o"],
        "p.pag ops/op.op factory.toml part.obj own/mine.py",
    ),
    (["export", "run.log", "--format", "csv"], ["-o"], "run.log"),
    (["export", "new.pnml", "--format", "dot"], ["-o"], "new.pnml"),
]
"""Commands, their options that name a file to write, and the files that they read."""


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the inputs as current folder, in which nothing can be laid out."""
    shutil.copytree(made, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(Project, "layout", property(_too_late))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # of an exporter of one's own
    return tmp_path / "here"


def _too_late(_: Project) -> None:
    raise AssertionError("it is laid out")


@pytest.mark.parametrize(("words", "options", "inputs"), NAMED, ids=str)
def test_a_named_output_is_no_input(
    run: Terminal, here: Path, words: list[str], options: list[str], inputs: str
) -> None:
    """By another path, a symbolic link and a hard link, in turn."""
    ways = cycle((by_symbolic_link, by_hard_link, by_another_path))
    for option in options:
        for name in inputs.split():
            path = next(ways)(Path(name))
            before = files_in(here)
            done = run(*words, *option.split(), path, "--json")
            assert done.status == 2, (option, name, done)
            assert "is read and would be written over" in done.json["errors"][0]["message"], done
            assert files_in(here) == before, (option, name)
            if path.name.endswith(".mp4"):
                path.unlink()


CHOSEN: list[tuple[list[str], str, str]] = [
    (["build", "p.pag", *OPS, "-o", "."], "p.pag part.obj ops/op.op", "p.svg p.xml p.mjb"),
    (["build", "plan.json", "-o", "sub"], "plan.json layout.json", "plan.json new.ways.json"),
    (
        ["revise", "p.pag", "new.pag", *OPS, "--live", "-o", "sub"],
        "p.pag new.pag ops/op.op part.obj",
        "new.svg plan.json family.pag live.csv",
    ),
    (["pareto", "p.pag", *OPS, "-o", "sub"], "p.pag ops/op.op part.obj", "pareto.html"),
    (
        ["plan", "loose", "--unit", "mm", "-o", "sub"],
        "loose/one.obj",
        "loose.pag loose-exploded.png loose-assembly.mp4 meshes/one.obj",
    ),
    (["import", "tree.json", "-o", "sub"], "tree.json part.obj", "tree.pag"),
]
"""Commands, files that they read, and names that they choose in the folder that is given."""


@pytest.mark.parametrize(("words", "inputs", "names"), CHOSEN, ids=str)
def test_a_chosen_output_is_no_input(
    run: Terminal, here: Path, words: list[str], inputs: str, names: str
) -> None:
    """Through a symbolic link and a hard link, in turn."""
    folder, links = Path(words[-1]), cycle((os.symlink, os.link, os.link))
    for name in inputs.split():
        for chosen in names.split():
            link = next(links)
            there = folder / chosen
            kept = there.read_bytes() if there.exists() else None
            there.unlink(missing_ok=True)
            there.parent.mkdir(exist_ok=True)
            link(Path(name).absolute(), there)
            before = files_in(here)
            done = run(*words, "--json")
            assert done.status == 2 and done.codes[0] == "BadFile", (name, chosen, done)
            assert files_in(here) == before, (name, chosen)
            there.unlink()
            if kept is not None:
                there.write_bytes(kept)


@pytest.mark.parametrize(
    "words",
    [
        ["revise", "family.pag", "p.pag", *OPS, "--live", "-o", "."],
        ["revise", "plan.json", "new.pag", "-o", "."],
        ["revise", "p.pag", "new.pag", *OPS, "-o", ".", "--picture", "new.svg"],
        ["build", "p.pag", *OPS, "--mjcf", "p.svg", "-o", "."],
        ["build", "plan.json", "-o", "."],
        ["plan", "two.pag", "--replan", "-o", "."],
        ["plan", "meshes", "--unit", "mm", "-o", "."],
        ["pareto", "pareto.html", "-o", "."],
        ["import", "tree.json", "-o", "."],
    ],
    ids=" ".join,
)
def test_a_chosen_name_is_that_of_no_input(run: Terminal, here: Path, words: list[str]) -> None:
    """Nor that of an output that the user has named."""
    for name in ("family.pag", "pareto.html"):
        shutil.copy("new.pag", name)
    shutil.copytree("loose", "meshes")
    text = "root = c; c = mate(a, b); {}".format(
        "".join(f'{a} = atomic(mesh = "meshes/{f}.obj");' for a, f in (("a", "one"), ("b", "two")))
    )
    Path("two.pag").write_text(f"unit = mm; {text}")
    shutil.copy("loose/two.obj", "one.obj")
    Path("tree.json").write_text('{"name": "t", "children": ["one.obj", "meshes/one.obj"]}')
    before = files_in(here)
    done = run(*words, "--json")
    assert (done.status, done.codes[0]) == (2, "BadFile"), done
    assert files_in(here) == before


def test_functions_write_over_no_input_either(here: Path) -> None:
    before = files_in(here)
    for call in (
        lambda: factory.export("new.pag", "dot", "new.pag"),
        lambda: factory.export(factory.load_pag("new.pag"), "dot", "new.pag"),
        lambda: factory.build("new.pag", mjcf="new.pag"),
        lambda: factory.build("plan.json", "."),
        lambda: factory.run("new.pag", "ideal", log="new.pag"),
        lambda: factory.report("run.log", "run.log"),
        lambda: factory.render("run.log", "run.log"),
        lambda: factory.sweep("new.pag", "new.pag", {"seed": [0]}),
    ):
        with pytest.raises(InputError):
            call()
        assert files_in(here) == before
