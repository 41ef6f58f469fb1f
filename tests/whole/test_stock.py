"""The MJCF that is written is driven as its page says, in MuJoCo of several versions and in MuJoCo
Warp: it starts at rest, robot i goes where `ctrl[i - 1]` tells, nothing touches."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from benches.fidelity.products import layout
from factory.apps.exports.stock import model_files
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.timestep import timed
from factory.engine.simulation.modelling import physical_model
from factory.support.files import write_all
from factory.support.settings import Settings
from tests.oracles.driving import ahead, start
from tests.paths import ROOT
from tests.stock_models import written

PAGE = ROOT / "docs" / "guide" / "driving.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
ENGINES = ROOT / ".engines"
"""Environments of other engines, made by tools/oracles."""


@cache
def run_model(name: str) -> Model:
    """The model that a run of a product takes."""
    return physical_model(layout(name), 1, timed(Settings(), layout(name)))


@cache
def stock(name: str) -> mujoco.MjModel:
    return load(written(run_model(name)))


def driven(python: Path | str, folder: Path, block: str) -> dict[str, Any]:
    """What tests/oracles/driving.py finds in a folder with the paper's example."""
    write_all(model_files(written(run_model("paper")), folder / "paper" / "paper.xml"))
    script = ROOT / "tests" / "oracles" / "driving.py"
    words = [str(python), str(script), "paper/paper.xml", block]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return said


def assert_driven(said: dict[str, Any]) -> None:
    """It stays where it is until it is told, and each robot comes where it is told, alone."""
    assert said["moved"] < 1e-5 and said["touched"] == 0
    for robot in said["robots"]:
        assert robot["off"] < 1e-4 and robot["others"] < 1e-6 and robot["touched"] == 0, robot
    assert sum(robot["taken"] for robot in said["robots"]) == 3


def test_the_page_says_what_can_be_done(tmp_path: Path) -> None:
    assert_driven(driven(sys.executable, tmp_path, BLOCKS[0]))


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["mujoco-3.3.7", "mujoco-3.17"])
def test_older_engines_drive_it(engine: str, tmp_path: Path) -> None:
    said = driven(_python(engine), tmp_path, BLOCKS[0])
    assert said["version"].startswith(engine.partition("-")[2])
    assert_driven(said)


@pytest.mark.slow
def test_mujoco_warp_drives_it_world_by_world(tmp_path: Path) -> None:
    assert driven(_python("mujoco-warp"), tmp_path, BLOCKS[2])["apart"] < 1e-4


def _python(engine: str) -> Path:
    python = ENGINES / engine / "bin" / "python"
    if not python.exists():
        pytest.skip("run tools/oracles to have it driven by other engines")
    return python


def test_it_stays_where_it_starts() -> None:
    """Lifts up where they start up, parts in their feeders, hands round them."""
    _, moved, touched = start(stock("truck"))
    assert moved < 1e-5 and touched == 0


def test_robots_with_lifts_go_where_told() -> None:
    m, robots = stock("stool"), layout("stool").factory.robots
    went = [ahead(m, robot.index + 1) for robot in robots]
    assert max(one["off"] for one in went) < 1e-4
    assert not any(one["touched"] for one in went)
    assert sum(one["taken"] for one in went) == len(layout("stool").factory.leaves)


def test_the_camera_of_a_viewer_shows_the_factory() -> None:
    """The free camera of an engine begins where the camera `overview` is."""
    m = stock("truck")
    d, camera = mujoco.MjData(m), mujoco.MjvCamera()
    mujoco.mj_forward(m, d)
    mujoco.mjv_defaultFreeCamera(m, camera)
    a, e = np.radians([camera.azimuth, camera.elevation])
    ahead_of_it = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    at = camera.lookat - camera.distance * ahead_of_it
    assert at == pytest.approx(d.camera("overview").xpos, abs=1e-6)
    assert ahead_of_it == pytest.approx(-d.camera("overview").xmat.reshape(3, 3)[:, 2], abs=1e-6)
