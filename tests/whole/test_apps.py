"""Apps are found by their folders, and in other packages by entry points."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from factory.support import apps
from factory.support.apps import App, layout_variant
from factory.support.errors import InputError, MissingError
from tests.paths import ROOT


def test_the_apps_of_the_house_are_found_by_their_folders() -> None:
    folders = {file.parent.name for file in (ROOT / "factory" / "apps").glob("*/app.py")}
    assert folders == {*apps.apps()} >= {"platen", "relay"}
    for app in apps.apps().values():
        assert all(callable(layout_variant(name)) for name in app.layouts)


def test_a_variant_that_no_app_gives_is_refused_by_name() -> None:
    with pytest.raises(MissingError, match="no app lays out a 'spiral'") as refused:
        layout_variant("spiral")
    assert "platen, relay" in str(refused.value)


@pytest.mark.parametrize("given", [App("platen"), "platen"])
def test_what_is_no_app_of_its_own_is_refused(
    given: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apps, "extensions", lambda kind: {"mine": given})
    apps.apps.cache_clear()
    try:
        with pytest.raises(InputError, match="is no App with a name of its own"):
            apps.apps()
    finally:
        apps.apps.cache_clear()


def built(folder: Path) -> Any:
    """What `build --relay` says of the paper's example with the package in a folder."""
    words = ["-m", "factory", "build", str(ROOT / "examples" / "paper.pag"), "--relay", "--json"]
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
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
    info = tmp_path / "relaying-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Name: relaying\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[factory.apps]\nrelaying = relaying.app:APP\n")
    assert built(tmp_path) == built(ROOT)
