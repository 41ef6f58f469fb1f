"""The core runs by itself: without the apps and the command line, the paper's example is proved,
laid out, built, run in both worlds and filmed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from factory.support.gl import probe
from tests.paths import ROOT

WITHOUT_APPS = """
import sys
from pathlib import Path
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import Film, Picture
from factory.pipeline import read
from factory.theory.nets.verify import verify

project = read(sys.argv[1])
assert verify(project.factory.net).live
assert project.layout.certificate.holds
assert "<mujoco" in physical_model(project.layout, units=2).xml
assert Simulation(project.layout, RunRequest("ideal", units=2)).run().succeeded
made = Simulation(project.layout, RunRequest("mujoco", units=1))
with Film(made, Path("film.mp4"), Picture((320, 180))) as film:
    assert made.run([film.observe]).succeeded
assert film.frames > 100
there = [name for name in sys.modules if name.startswith(("factory.apps", "factory.commands"))]
assert not there, there
"""


def test_the_core_runs_without_apps(tmp_path: Path) -> None:
    try:
        probe()
    except Exception as error:
        pytest.skip(f"no GL: {error}")
    gone = shutil.ignore_patterns("apps", "commands", "__pycache__")
    shutil.copytree(ROOT / "factory", tmp_path / "factory", ignore=gone)
    for name in ("templates", "mjcf"):
        (tmp_path / name).symlink_to(ROOT / name)
    words = [sys.executable, "-c", WITHOUT_APPS, str(ROOT / "examples" / "paper.pag")]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "film.mp4").stat().st_size > 30_000
