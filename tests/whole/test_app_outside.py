"""An app of this package does the same from a package of its own, beside a house without it."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from factory import commands
from factory.support import apps, explanations
from factory.support.extensions import extensions
from tests.command_line import Terminal
from tests.paths import PAPER

CACHES: tuple[Any, ...] = (
    *(apps.shipped, apps.apps, extensions, commands.places),
    *(explanations.codes, explanations._shipped),
)
"""What is kept of the apps that there are."""

FACES = "1 2 4 3;5 7 8 6;1 5 6 2;3 4 8 7;1 3 7 5;2 6 8 4"
"""Those of a box whose corners are numbered by x, then y, then z."""

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


@pytest.fixture
def boxes(tmp_path: Path) -> Path:
    """A folder of two boxes, one upon the other."""
    folder = tmp_path / "boxes"
    folder.mkdir()
    faces = "".join(f"f {face}\n" for face in FACES.split(";"))
    for name, low in {"lower": 0.0, "upper": 0.02}.items():
        corners = [(x, y, low + z) for x in (0, 0.04) for y in (0, 0.04) for z in (0, 0.02)]
        text = "".join("v {} {} {}\n".format(*corner) for corner in corners)
        (folder / f"{name}.obj").write_text(text + faces)
    return folder


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


def test_a_planner(run: Terminal, moved: Move, boxes: Path, tmp_path: Path) -> None:
    out, explained = tmp_path / "out", run("--explain", "CannotAssemble").out
    words = "plan", boxes, "-o", out, "--unit", "m", "--no-look", "--json"
    assert same(run, moved, "planning", *words)["parts"] == 2
    assert (out / "boxes.pag").is_file()
    assert "CannotAssemble" not in explanations.codes()
    assert run("--explain", "CannotAssemble").out == explained != ""


def test_a_variant_of_a_layout(moved: Move) -> None:
    moved("platen")
    assert apps.layout_variant("platen").__module__ == "outside_platen.platen"


def test_without_its_package_the_command_is_not_there(
    run: Terminal, moved: Move, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    moved("analyze")
    monkeypatch.setattr(sys, "path", [p for p in sys.path if p != str(tmp_path / "site")])
    done = run("analyze", PAPER)
    assert done.status == 2 and "there is no command 'analyze'" in done.err
