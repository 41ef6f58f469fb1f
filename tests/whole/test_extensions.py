"""Extensions: exporters in a folder, and packages with entry points. Mistakes in them are told at
the line of the user's file."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from factory.support.extensions import extensions
from tests.command_line import Terminal
from tests.paths import PAPER
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


MISTAKES = [
    (
        '"labels", "pag"',
        '"dot", "pag"',
        2,
        "FORMAT of this exporter is 'dot', which there is already",
    ),
    ("def export", "def exporting", 1, "export of this exporter is no function"),
    ('"pag"\n', '"pag\n', 2, "SyntaxError: unterminated string"),
    ("subject):\n", "subject):\n    exit(7)\n", 6, "SystemExit: 7"),
    ('return "', 'return b"x" or "', 5, "the exporter labels gave bytes, not a text or files"),
    ('return "', 'return "\\ud800" or "', 5, "the exporter labels gave a text with a lone"),
    ('return "', 'return {} if 1 else "', 5, "the exporter labels gave no file"),
    ('return "', 'return {"": "x"} or "', 5, "the exporter labels gave str for the file '', not"),
    ('return "', 'return {7: b"x"} or "', 5, "the exporter labels gave a file whose name is 7,"),
    ('return "', 'return {"a\\0": b""} or "', 5, "the exporter labels gave a file whose name 'a"),
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
        ("/tmp/outside.txt", "a file that is not in the folder"),
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


def test_a_folder_that_is_not_there(run: Terminal, tmp_path: Path) -> None:
    done = run("export", PAPER, "--format", "dot", "--exporters", tmp_path / "no")
    assert done.status == 2
    assert "Usage" in done.err and "give a folder with modules" in done.err


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


PACKAGE_MISTAKES = [
    ("laws.py", "return navigation", "return 3 or navigation", 4, "gave int, not a Mode"),
    ("laws.py", "def near", "def far", None, "has no attribute 'near'"),
    ("robots/catalogue.toml", "[dabber]", "[dot]", 1, "there is a robot type 'dot' already"),
    ("robots/catalogue.toml", '"tool"', '"toool"', 1, "did you mean 'tool'?"),
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
