"""Logs of cells: judged, shown and continued from the file alone, which takes nothing from any
other file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from factory.api import InputError, RunRequest, Simulation
from factory.apps.arms.ground import with_arm
from factory.apps.log import read_log
from factory.apps.log.blocks import LENGTH, MAGIC
from factory.apps.log.project_table import project_of
from factory.apps.log.writer import LogWriter
from factory.apps.monitor.record import recorded_subject
from factory.pipeline import read
from tests.apps.arms.test_own_arm import BOX, own
from tests.arm_cells import SMALL
from tests.command_line import Terminal

__all__ = ["own"]


@pytest.fixture
def small(tmp_path: Path) -> Path:
    file = tmp_path / "small.pag"
    file.write_text(SMALL)
    return file


def test_a_log_is_judged_shown_and_continued(small: Path, tmp_path: Path, run: Terminal) -> None:
    """By commands that know its file only; the PAG is gone."""
    log, page = tmp_path / "small.log", tmp_path / "small.html"
    cut = run("run", small, "--arm", "six", "--units", "2", "--max-time", "9", "--log", log)
    assert cut.status == 1
    small.unlink()
    done = run("run", log, "--resume", "--json")
    assert done.status == 0, done.err
    judged = run("monitor", log, "--json")
    assert judged.status == 0 and judged.json["verdict"]["succeeded"]
    assert judged.json["verdict"]["failures"] == []
    shown = run("report", log, "-o", page, "--json")
    assert shown.status == 0 and shown.json["predicted"] and shown.json["products"] == 2
    assert ">r2</text>" in page.read_text()
    still = run("render", log, "-o", tmp_path / "small.png", "--at", "3", "--size", "160x90")
    assert still.status == 0


def test_an_arm_of_a_user_is_in_the_log(own: Path, tmp_path: Path, run: Terminal) -> None:
    """With its meshes, and with what it leaves out of contact."""
    file, log = tmp_path / "box.pag", tmp_path / "box.log"
    file.write_text(BOX)
    done = run("run", file, "--arm", own, "--units", "1", "--log", log, "--json")
    assert done.status == 0, done.err
    for path in (own, tmp_path / "shapes" / "link.stl"):
        path.unlink()
    judged = run("monitor", log, "--json")
    assert judged.status == 0 and judged.json["verdict"]["succeeded"], judged.err


def test_what_a_log_says_of_its_arms_is_not_trusted(small: Path, tmp_path: Path) -> None:
    """A kind is one that is shipped, not a file; a text is that of an arm."""
    project, log = with_arm(read(small), "six"), tmp_path / "small.log"
    with LogWriter(log, Simulation(project.layout, RunRequest("ideal")), project):
        pass
    header = dict(read_log(log).header)
    assert header["cell"] == {"kind": "six", "arms": 1}
    assert project_of(header, tmp_path).layout.goals(0) == project.layout.goals(0)
    own = tmp_path / "own.xml"
    own.write_text("<mujoco/>")
    for cell, said in (
        ({"kind": str(own)}, "kind must be the name of a robot type"),
        ({"kind": "own"}, "kind must be one of scara, six"),
        ({"arms": 9}, "arms must be 1 or 2, not 9"),
        ({"text": '<mujoco><include file="own.xml"/></mujoco>'}, "it has <include>"),
        ({"text": "<mujoco/>"}, "BadArm"),
    ):
        forged = {**header, "cell": {**header["cell"], **cell}}
        with pytest.raises((ValueError, InputError)) as error:
            project_of(forged, tmp_path)
        assert said in str(error.value)
    with pytest.raises(InputError, match="its net is not that of its PAG"):
        recorded_subject({**header, "robots": ["r1", "r9"]})


def test_a_log_has_a_layout_or_a_cell(small: Path, tmp_path: Path) -> None:
    project, log = with_arm(read(small), "six"), tmp_path / "small.log"
    with LogWriter(log, Simulation(project.layout, RunRequest("ideal")), project):
        pass
    data = log.read_bytes()
    begin = len(MAGIC) + LENGTH.size
    (length,) = LENGTH.unpack(data[len(MAGIC) : begin])
    header = json.loads(data[begin : begin + length])
    del header["cell"]
    text = json.dumps(header).encode()
    log.write_bytes(MAGIC + LENGTH.pack(len(text)) + text + data[begin + length :])
    with pytest.raises(InputError, match="it must have a layout or a cell"):
        read_log(log)
