"""The tests of the core need the core alone: they pass in a checkout without apps and commands."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.paths import ROOT


@pytest.mark.slow
def test_the_tests_of_the_core_pass_without_apps_and_commands(tmp_path: Path) -> None:
    gone = shutil.ignore_patterns("apps", "commands", "__pycache__")
    for name in ("factory", "tests", "benches"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=gone)
    for name in ("docs", "examples", "mjcf", "templates", "pyproject.toml"):
        (tmp_path / name).symlink_to(ROOT / name)
    words = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", "tests/core"]
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    done = subprocess.run(
        words,
        cwd=tmp_path,
        env={**environment, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
