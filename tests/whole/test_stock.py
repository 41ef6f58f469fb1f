"""The MJCF that is written is driven as its page says, in MuJoCo of several versions and in MuJoCo
Warp: it starts at rest, robot i goes where `ctrl[i - 1]` tells, nothing touches."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from benches.fidelity.products import layout
from factory import build
from factory.apps.exports.goals import goals
from factory.apps.exports.stock import model_files, scales_of, written
from factory.engine.mjcf import names
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.timestep import timed
from factory.engine.simulation.modelling import physical_model
from factory.support.files import write_all
from factory.support.settings import Settings
from tests.oracles.driving import ahead, start
from tests.paths import ROOT

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


def test_a_controller_from_outside_makes_a_product(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the MJCF and the goals alone; the parts are where the PAG has them."""
    build(ROOT / "examples" / "paper.pag", tmp_path / "paper")
    monkeypatch.chdir(tmp_path)
    done: dict[str, Any] = {}
    exec(BLOCKS[1], done)
    d = done["d"]
    centres = {label: d.body(f"part/{label}#1").xpos for label in ("part1", "part2", "part3")}
    solids = layout("paper").product.solids
    for one, other in pairwise(centres):
        apart = np.subtract(solids[other].position, solids[one].position)
        assert np.abs(centres[other] - centres[one] - apart).max() < 1e-4


@pytest.mark.parametrize("name", ["truck", "gearbox", "family", "peg"])
def test_goals_name_what_the_model_has(name: str) -> None:
    """All actuators and welds; each weld that goes on goes off by the end but those of the tray,
    and no setpoint is clipped."""
    m, on = stock(name), set[str]()
    for operation in goals(run_model(name))["operations"]:
        for actuator, at in operation["goals"].items():
            low, high = m.actuator(actuator).ctrlrange
            assert low - 1e-9 <= at <= high + 1e-9, (operation["label"], actuator)
        for weld in (*operation["on"], *operation["off"]):
            assert m.equality(weld).id >= 0
        assert not on & set(operation["on"])
        on = (on | set(operation["on"])) - set(operation["off"])
    assert {weld.partition("/")[0] for weld in on} == {"hold"}


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


@pytest.mark.parametrize("name", ["stool", "truck"])
def test_it_stays_where_it_starts(name: str) -> None:
    """Lifts up where they start up, parts in their feeders, hands round them."""
    _, moved, touched = start(stock(name))
    assert moved < 1e-5 and touched == 0


def test_parts_in_different_feeders_collide() -> None:
    """But none touches the pad from which it hangs."""
    m = stock("paper")

    def collide(one: str, other: str) -> bool:
        a, b = m.geom(one).id, m.geom(other).id
        masks = m.geom_contype[a] & m.geom_conaffinity[b], m.geom_contype[b] & m.geom_conaffinity[a]
        return any(masks)

    assert collide("part/part1#1", "part/part2#1")
    assert collide("part/part1#1", "r1/carriage")
    assert not collide("part/part1#1", "feeder/part1/pad")


def test_robots_with_lifts_go_where_told() -> None:
    m, robots = stock("stool"), layout("stool").factory.robots
    went = [ahead(m, robot.index + 1) for robot in robots]
    assert max(one["off"] for one in went) < 1e-4
    assert not any(one["touched"] for one in went)
    assert sum(one["taken"] for one in went) == len(layout("stool").factory.leaves)


def test_setpoints_are_in_the_order_of_robots() -> None:
    m, factory = stock("stool"), layout("stool").factory
    drives = [names.drive(robot.name) for robot in factory.robots]
    hoists = [names.actuator(axis) for axis in factory.axes[len(factory.robots) :]]
    assert hoists and [m.actuator(n).name for n in range(m.nu)][: len(drives) + len(hoists)] == [
        *drives,
        *hoists,
    ]
    assert m.nu == sum(m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE)
    assert sorted(m.actuator_trnid[:, 0]) == sorted(
        np.flatnonzero(m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE)
    )


def test_it_has_nothing_that_other_engines_refuse() -> None:
    root = ElementTree.fromstring(written(run_model("truck")).xml)
    assert not {"flag", "pid"} & {element.tag for element in root.iter()}
    for element in root.iter():
        assert not {"sleep", "nsample", "delay"} & element.attrib.keys()
        assert element.tag == "light" or "castshadow" not in element.attrib
    assert not stock("truck").opt.enableflags


def test_its_drives_obey_the_law_of_the_run() -> None:
    """The same motion of all robots in the run's model, by three setpoints, and in the written one,
    by one: places in the run's coordinates are the same."""
    run, m = load(run_model("paper")), load(written(run_model("paper")))
    run.opt.disableflags = m.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    run.opt.enableflags, run.actuator_delay[:], run.actuator_history[:, 0] = 0, 0.0, 0
    one, other = mujoco.MjData(run), mujoco.MjData(m)
    robots = [robot.name for robot in layout("paper").factory.robots]
    scales = [scales_of(layout("paper"))[names.slide(robot)] for robot in robots]
    for step in range(100):
        t = step * run.opt.timestep
        for n, (robot, scale) in enumerate(zip(robots, scales, strict=True)):
            x, u, f = -0.02 * (1 - np.cos(5 * t)), -0.1 * np.sin(5 * t), -0.9 * np.cos(5 * t)
            at = run.actuator(names.drive(robot)).id
            one.ctrl[3 * at : 3 * at + 3] = scale.zero + x, u, f
            kp, kv = -m.actuator_biasprm[n, 1:3]
            other.ctrl[n] = -x - (kv * u + f) / kp
        mujoco.mj_step(run, one)
        mujoco.mj_step(m, other)
    for robot, scale in zip(robots, scales, strict=True):
        joint = names.slide(robot)
        went = scale.at(float(one.joint(joint).qpos[0]))
        assert went == pytest.approx(float(other.joint(joint).qpos[0]), abs=1e-12)
        assert went > 0.01


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
