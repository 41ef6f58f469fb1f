"""Extensions: exporters in a folder, and packages with entry points. Mistakes in them are told at
the line of the user's file."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import factory
from factory.api import navigation
from factory.pipeline import read
from factory.support.extensions import extensions
from tests.command_line import Terminal
from tests.core.test_control_laws import SETTING
from tests.paths import PAPER, ROOT
from tests.plug_in import FILES, write_package

GOOD = '''"""The labels, one a line."""
FORMAT, TAKES = "labels", "pag"


def export(subject):
    return "\\n".join(node.label for node in subject.project.pag.nodes)
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "helper.py").write_text("x = 1\n")
    (tmp_path / "labels.py").write_text(GOOD)
    return tmp_path


def listings() -> list[str]:
    """The modules that the page about extensions shows."""
    page = (ROOT / "docs" / "guide" / "extending.md").read_text("utf-8")
    return re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)


def test_what_the_page_shows_runs_with_the_interface_alone() -> None:
    exporter, law, app = listings()
    lines = "\n".join((exporter, law, app)).splitlines()
    loaded = {line for line in lines if "import" in line and "factory" in line}
    assert loaded and all(line.startswith("from factory.api import ") for line in loaded)
    spaces: list[dict[str, Any]] = [{}, {}, {}]
    for listing, space in zip((exporter, law, app), spaces, strict=True):
        exec(compile(listing, "extending.md", "exec", dont_inherit=True), space)
    made = read(PAPER)
    labels = spaces[0]["export"](SimpleNamespace(project=made)).split()
    assert labels == [node.label for node in made.pag.nodes]
    template, setting = made.templates["mate"], SETTING
    plain, near = navigation(template, setting), spaces[1]["near"](template, setting)
    assert near.eps == plain.eps / 2 and (near.goals == plain.goals).all()
    ticks = spaces[2]["busy"](made, units=1)
    assert len(ticks) == len(made.factory.net.threaded.places) and min(ticks) > 0


def test_a_folder_brings_a_format(run: Terminal, folder: Path) -> None:
    done = run("export", PAPER, "--format", "labels", "--exporters", folder)
    assert done.status == 0, done.err
    assert set(done.out.split()) == {n.label for n in factory.load_pag(PAPER).nodes}
    assert factory.export(PAPER, "labels", exporters=[folder]) == done.out.rstrip("\n")
    without = run("export", PAPER, "--format", "labels")
    assert without.status == 2 and "unknown format 'labels'" in without.err


MISTAKES = [
    (
        '"labels", "pag"',
        '"labels", "paper"',
        2,
        "TAKES of this exporter is 'paper', not one of net",
    ),
    (
        '"labels", "pag"',
        '"dot", "pag"',
        2,
        "FORMAT of this exporter is 'dot', which there is already",
    ),
    ('"labels", "pag"', '3, "pag"', 2, "FORMAT of this exporter is 3, not a name"),
    ("def export(subject):", "export = 3\ndef other(subject):", 5, "export of this exporter is no"),
    ("def export", "def exporting", 1, "export of this exporter is no function"),
    ("subject.project", "subject.proyect", 6, "AttributeError: 'Subject' object has no attribute"),
    ("FORMAT, TAKES", "import nothing_of_this_name\nFORMAT, TAKES", 2, "ModuleNotFoundError: No"),
    ('"pag"\n', '"pag\n', 2, "SyntaxError: unterminated string"),
    ("subject):\n", "subject):\n    exit(7)\n", 6, "SystemExit: 7"),
    ('return "', 'return b"" or 7 or "', 5, "the exporter labels gave int, not a text or files"),
    ('return "', 'return b"x" or "', 5, "the exporter labels gave bytes, not a text or files"),
    ('return "', 'return "\\ud800" or "', 5, "the exporter labels gave a text with a lone"),
    ('return "', 'return {} if 1 else "', 5, "the exporter labels gave no file"),
    ('return "', 'return {"": "x"} or "', 5, "the exporter labels gave str for the file '', not"),
    ('return "', 'return {"": None} or "', 5, "the exporter labels gave NoneType for the file ''"),
    ('return "', 'return {7: b"x"} or "', 5, "the exporter labels gave a file whose name is 7,"),
    ('return "', 'return {"a\\0": b""} or "', 5, "the exporter labels gave a file whose name 'a"),
    ('return "', 'return {"\\ud8f0": b""} or "', 5, "the exporter labels gave a file whose name"),
]


@pytest.mark.parametrize(("text", "by", "line", "why"), MISTAKES)
def test_a_mistake_names_file_line_and_reason(
    run: Terminal, folder: Path, text: str, by: str, line: int, why: str
) -> None:
    file = folder / "labels.py"
    assert text in GOOD
    file.write_text(GOOD.replace(text, by, 1))
    form = "dot" if '"dot"' in by else "labels"
    done = run("export", PAPER, "--format", form, "--exporters", folder)
    assert done.status == 2
    first, shown = done.err.splitlines()[:2]
    assert first.startswith(f"{file}:{line}:"), done.err
    assert f"BadExtension {why}" in first or f": {why}" in first, done.err
    assert shown.strip() in file.read_text().splitlines()[line - 1]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("../outside.txt", "a file that is not in the folder"),
        ("/tmp/outside.txt", "a file that is not in the folder"),
        ("link/outside.txt", "a file that is not in the folder"),
        (".", "a file that is not in the folder"),
        ("x/../own.pag", "a file that is the source"),
        ("own.pag", "a file that is the source"),
    ],
)
def test_a_file_beside_the_requested_one_stays_in_its_folder(
    run: Terminal, folder: Path, name: str, why: str
) -> None:
    file, out = folder / "labels.py", folder / "out"
    out.mkdir()
    (out / "link").symlink_to(folder)
    source = out / "own.pag"
    source.write_bytes(PAPER.read_bytes())
    file.write_text(GOOD.replace('return "', f'return {{"": b"x", {name!r}: b"y"}} or "', 1))
    before = sorted(folder.rglob("*"))
    done = run("export", source, "--format", "labels", "--exporters", folder, "-o", out / "a.txt")
    assert done.status == 2 and done.out == ""
    assert done.err.startswith(f"{file}:5:") and why in done.err, done.err
    after = [path for path in sorted(folder.rglob("*")) if "__pycache__" not in path.parts]
    assert after == [path for path in before if "__pycache__" not in path.parts]
    assert source.read_bytes() == PAPER.read_bytes()


def test_the_line_of_success_names_what_was_written(run: Terminal, folder: Path) -> None:
    file, out = folder / "labels.py", folder / "a.txt"
    file.write_text(GOOD.replace('return "', 'return {"d/b.txt": b"y"} or "', 1))
    done = run("export", PAPER, "--format", "labels", "--exporters", folder, "-o", out)
    assert done.status == 0 and not out.exists()
    assert done.out == f"labels: {folder / 'd' / 'b.txt'}\n"
    assert (folder / "d" / "b.txt").read_bytes() == b"y"


def test_a_dash_is_standard_output(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = "export", PAPER, "--format", "dot"
    assert run(*words, "-o", "-").out == run(*words).out != ""
    assert not Path("-").exists()


def test_a_folder_that_is_not_there(run: Terminal, tmp_path: Path) -> None:
    done = run("export", PAPER, "--format", "dot", "--exporters", tmp_path / "no")
    assert done.status == 2
    assert "Usage" in done.err and "give a folder with modules" in done.err


# --- packages -------------------------------------------------------------------------------------


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package as if it were installed: its folder, and the metadata beside it, are found."""
    write_package(tmp_path, installed=True)
    monkeypatch.syspath_prepend(tmp_path)
    extensions.cache_clear()
    yield tmp_path / "gluing"
    extensions.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "gluing"]:
        del sys.modules[name]


def test_a_package_brings_an_operation_a_law_a_robot_type_and_a_format(
    run: Terminal, package: Path, tmp_path: Path
) -> None:
    (tmp_path / "p.pag").write_text(FILES["p.pag"])
    ran = run("run", tmp_path / "p.pag", "--json").json
    assert ran["refines_net"] and ran["products"] == 1
    assert run("export", tmp_path / "p.pag", "--format", "count").out.strip() == "2"
    listed = run("templates", "--json").json
    assert "dab" in {t["name"] for t in listed["templates"]}
    assert {"name": "dabber", "extends": "tool"}.items() <= listed["robots"][-1].items()


PACKAGE_MISTAKES = [
    ("laws.py", "navigation(template", "navigation(templates", 5, "NameError: name 'templates'"),
    ("laws.py", "return navigation", "return 3 or navigation", 4, "gave int, not a Mode"),
    ("laws.py", "def near", "def far", None, "has no attribute 'near'"),
    ("robots/catalogue.toml", "[dabber]", "[dot]", 1, "there is a robot type 'dot' already"),
    ("robots/catalogue.toml", '"tool"', '"toool"', 1, "did you mean 'tool'?"),
    ("robots/catalogue.toml", 'mjcf = "', "mjcf = ", 2, "Syntax Invalid value"),
    ("robots/catalogue.toml", "mjcf", "file", 1, "'dabber' has the unknown key 'file'"),
    (
        "robots/dabber.xml",
        "</actuator>",
        "</actuators>",
        37,
        "Syntax not well-formed XML: mismatched",
    ),
    ("templates/dab.op", "dot, dabber", "dot, daber", 3, "unknown"),
    ("count.py", "len(", "length(", 6, "NameError: name 'length'"),
]


@pytest.mark.parametrize(("name", "text", "by", "line", "why"), PACKAGE_MISTAKES)
def test_a_mistake_in_a_package_names_its_file(
    run: Terminal, package: Path, tmp_path: Path, name: str, text: str, by: str, line: int, why: str
) -> None:
    file, pag = package / name, tmp_path / "p.pag"
    assert text in file.read_text()
    file.write_text(file.read_text().replace(text, by))
    pag.write_text(FILES["p.pag"])
    form = ("export", pag, "--format", "count") if name == "count.py" else ("build", pag)
    done = run(*form, *(("-o", tmp_path / "out") if form[0] == "build" else ()))
    assert done.status == 2
    assert why in done.err, done.err
    assert line is None or f"{file}:{line}:" in done.err, done.err


def test_two_packages_with_one_name(run: Terminal, package: Path, tmp_path: Path) -> None:
    write_package(tmp_path, installed=True, name="other")
    done = run("export", PAPER, "--format", "count")
    assert done.status == 2
    assert "BadExtension the entry point 'count' of factory.exporters, other.count" in done.err
