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
