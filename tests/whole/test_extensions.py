"""Extensions: exporters in a folder, and packages with entry points. Mistakes in them are told at
the line of the user's file. Apps are found by their folders, and in other packages by entry
points."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from factory import commands
from factory.support import apps, explanations
from factory.support.apps import App, layout_variant
from factory.support.errors import InputError, MissingError
from factory.support.extensions import extensions
from tests.command_line import Terminal
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


def test_the_apps_of_the_house_are_found_by_their_folders() -> None:
    folders = {file.parent.name for file in (ROOT / "factory" / "apps").glob("*/app.py")}
    assert folders == {*apps.apps()} >= {"platen", "relay"}
    for app in apps.apps().values():
        assert all(callable(layout_variant(name)) for name in app.layouts)


def test_a_variant_that_no_app_gives_is_refused_by_name() -> None:
    with pytest.raises(MissingError, match="no app lays out a 'spiral'") as refused:
        layout_variant("spiral")
    assert "platen, relay" in str(refused.value)


def test_what_is_no_app_of_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    given = "platen"
    monkeypatch.setattr(apps, "extensions", lambda kind: {"mine": given})
    apps.apps.cache_clear()
    try:
        with pytest.raises(InputError, match="is no App with a name of its own"):
            apps.apps()
    finally:
        apps.apps.cache_clear()


def factory_in(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """What `factory` does with the packages in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "factory", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (folder, ROOT)))},
        capture_output=True,
        text=True,
        check=False,
    )


def install(folder: Path, name: str) -> None:
    """Make a package of a folder one that gives its `app:APP` by an entry point."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Name: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[factory.apps]\n{name} = {name}.app:APP\n")


def built(folder: Path) -> Any:
    """What `build --relay` says of the paper's example with the packages in a folder."""
    done = factory_in(folder, "build", str(ROOT / "examples" / "paper.pag"), "--relay", "--json")
    document = json.loads(done.stdout)
    return done.returncode, {k: v for k, v in document.items() if k != "compile_s"}


def test_an_app_of_the_house_works_as_well_from_a_package_of_its_own(tmp_path: Path) -> None:
    gone = shutil.ignore_patterns("relay", "__pycache__")
    shutil.copytree(ROOT / "factory", tmp_path / "factory", ignore=gone)
    for name in ("templates", "mjcf"):
        (tmp_path / name).symlink_to(ROOT / name)
    status, refused = built(tmp_path)
    assert status and "no app lays out a 'relay'" in refused["errors"][0]["message"]
    package, moved = ROOT / "factory" / "apps" / "relay", tmp_path / "relaying"
    moved.mkdir()
    for file in package.glob("*.py"):
        (moved / file.name).write_text(file.read_text().replace("factory.apps.relay", "relaying"))
    install(tmp_path, "relaying")
    assert built(tmp_path) == built(ROOT)


HELLO = '''import click
from factory.commands.options import OUTPUT
from factory.support.console import emit, say

@click.command()
@click.argument("name")
@OUTPUT
def hello(name, out):
    """Greet NAME."""
    emit({"hello": name}) if out.as_json else say(f"hello, {name}")
    return 1
'''


def test_an_app_from_outside_gives_a_command(tmp_path: Path) -> None:
    package = tmp_path / "greeting"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "words.py").write_text(HELLO)
    (package / "app.py").write_text(
        "from factory.api import App\n"
        "APP = App('greeting', commands={'hello': 'greeting.words:hello'})\n"
    )
    install(tmp_path, "greeting")
    assert "\n  hello      Greet NAME.\n" in factory_in(tmp_path, "--help").stdout
    done = factory_in(tmp_path, "hello", "you", "--json")
    assert (done.returncode, json.loads(done.stdout)["hello"]) == (1, "you")
    assert "did you mean 'hello'?" in factory_in(tmp_path, "helo").stderr


@pytest.mark.parametrize(
    ("word", "place", "why"),
    [
        ("plan", "os:getcwd", "gives the command 'plan', which is there already"),
        ("hello", "os:hello", "has no attribute 'hello'"),
        ("hello", "json:dumps", "the command 'hello' of an app is no click.Command"),
    ],
)
def test_what_is_no_command_of_its_own_is_refused(
    word: str, place: str, why: str, run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = App("greeting", commands={word: place})
    monkeypatch.setattr(apps, "extensions", lambda kind: {"greeting": app})
    _forget()
    try:
        done = run("hello", "--json")
        assert (done.status, done.codes) == (2, ["BadExtension"])
        assert why in done.json["errors"][0]["message"]
        assert run("templates").status == 0  # what this package gives needs no other
    finally:
        _forget()


def _forget() -> None:
    apps.apps.cache_clear()
    commands.places.cache_clear()


def test_a_table_of_an_app_has_places() -> None:
    with pytest.raises(TypeError, match="is no place"):
        App("greeting", commands={3: "module:hello"})


CACHES: tuple[Any, ...] = (
    *(apps.shipped, apps.apps, extensions, commands.places),
    *(explanations.codes, explanations._shipped),
)
"""What is kept of the apps that there are."""


Move = Callable[[str], None]


def forget(beginning: str) -> None:
    """Forget imported modules whose names begin so, and what is kept of apps."""
    for name in [name for name in sys.modules if name.startswith(beginning)]:
        del sys.modules[name]
    for cache in CACHES:
        cache.cache_clear()


@pytest.fixture
def moved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Move]:
    """Moves an app of this package into one of its own, as if that were installed, and out of the
    folder of apps."""
    house, here = tmp_path / "apps", dict(sys.modules)
    there, gone = tmp_path / "site", list[str]()
    house.mkdir()

    def move(name: str) -> None:
        package = there / f"outside_{name}"
        shutil.copytree(apps.FOLDER / name, package, ignore=shutil.ignore_patterns("__pycache__"))
        for file in package.rglob("*.py"):
            text = file.read_text("utf-8")
            file.write_text(text.replace(f"factory.apps.{name}", package.name), "utf-8")
        data = there / f"{package.name}-1.0.dist-info"
        data.mkdir()
        (data / "METADATA").write_text(f"Name: {package.name}\nVersion: 1.0\n")
        points = f"[factory.apps]\n{name} = {package.name}.app:APP\n"
        if (package / "explanations").is_dir():
            points += f"[factory.explanations]\n{name} = {package.name}.explanations\n"
        (data / "entry_points.txt").write_text(points)
        for folder in apps.FOLDER.iterdir():
            if folder.name != name:
                (house / folder.name).symlink_to(folder)
        monkeypatch.syspath_prepend(there)
        monkeypatch.setattr(apps, "FOLDER", house)
        monkeypatch.setattr(explanations, "APPS", house)
        forget(f"factory.apps.{name}")
        gone.append(f"factory.apps.{name}")
        sys.modules[gone[-1]] = None  # type: ignore[assignment]

    yield move
    for name in (*gone, "outside_"):
        forget(name)
    sys.modules.update(here)


def same(run: Terminal, moved: Move, name: str, *words: object) -> Any:
    """What an app prints in this package, which it prints from a package of its own, too."""
    here = run(*words)
    helped = run(words[0], "--help")
    moved(name)
    assert run(words[0], "--help") == helped
    assert run(*words) == here
    assert f"outside_{name}" in sys.modules and sys.modules[f"factory.apps.{name}"] is None
    return json.loads(here.out)


def test_a_study(run: Terminal, moved: Move) -> None:
    assert same(run, moved, "analyze", "analyze", PAPER, "--json")["cycle_time_s"] > 1
