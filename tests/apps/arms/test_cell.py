"""Cells of one arm and of two: proved, predicted, and made in both worlds; what they refuse."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from factory.api import Diagnostic, RunError
from factory.apps.arms.arming import armed
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.model import ArmModel
from factory.apps.live.interventions import Interventions
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.coordinating import with_machines
from factory.pipeline import Project, all_templates
from factory.theory.lang import read_pag
from factory.theory.nets.verify import verify
from tests.apps.arms.test_read import BOX, own
from tests.arm_cells import SMALL, cell, refusal
from tests.command_line import Terminal, spawn

ARMS = ("six", "six=2")

SUBS = """root = x;
x = mate ( a, z ); z = mate ( b, c );
a = atomic ( box = (0.09, 0.06, 0.02), pos = (0, 0, 0.01) );
b = atomic ( box = (0.04, 0.04, 0.02), pos = (0.01, 0, 0.0301) );
c = atomic ( box = (0.03, 0.03, 0.02), pos = (0.01, 0, 0.0502) )"""
MIX = """mix = x, y;
x = mate ( a, b ); y = mate ( c, d ); a = atomic(); b = atomic(); c = atomic(); d = atomic()"""


def column(height: float) -> str:
    """A part on a column of a height [m]."""
    return f"""root = x;
x = mate ( a, b );
a = atomic ( box = (0.1, 0.07, {height}), pos = (0, 0, {height / 2}) );
b = atomic ( box = (0.05, 0.03, 0.02), pos = (0, 0, {height + 0.0102}) )"""


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """The file of the small product."""
    file = tmp_path / "drive.pag"
    file.write_text(SMALL, "utf-8")
    return file


@pytest.mark.parametrize("arm", ARMS)
def test_the_net_of_a_cell_is_live_with_its_order_places(arm: str) -> None:
    layout = cell(arm)
    factory = layout.factory
    assert len(factory.robots) == (2 if arm == "six" else 3)
    proof = verify(factory.net)
    assert proof.holds and proof.live and proof.safe and proof.reversible
    assert layout.certificate is not None
    apart = layout.certificate.apart
    assert len(apart.orders) == (1 if arm == "six" else 3)
    assert not with_machines(layout, apart.passes, apart.orders).deadlock


@pytest.mark.parametrize("arm", ARMS)
def test_arms_take_parts_by_turns(arm: str) -> None:
    taken = [robot.operations for robot in cell(arm).factory.robots[1:]]
    assert [len(each) for each in taken] == ([4] if arm == "six" else [2, 2])


def test_two_arms_are_faster_than_one() -> None:
    one, two = (Simulation(cell(arm), RunRequest("ideal", units=4)).cycle.seconds for arm in ARMS)
    assert one is not None and two is not None and two < 0.97 * one


def test_the_command_line_makes_a_cell(drive: Path) -> None:
    """In a process of its own."""
    drive.write_text(column(0.04))
    done = spawn("run", drive, "--arm", "six", "--units", "1", "--json")
    assert done.status == 0, done.err
    assert done.json["products"] == 1 and done.json["unintended_contacts"] == 0
    assert done.json["refines_net"] and done.json["verdict"]["succeeded"]


def test_options_that_no_cell_has_are_refused(
    drive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--arm", "six=3"]
    done = Terminal(capsys)("run", drive, *words, "--json")
    assert done.status == 2
    (error,) = done.json["errors"]
    assert (
        error["code"] == "Usage"
        and "one arm or two" in error["message"]
        and "six=2" in error["hint"]
    )


@pytest.mark.parametrize(
    ("text", "arm", "code", "said", "line"),
    [
        (SUBS, "six=2", "NoCell", "2 arms: all that is placed has to do with", None),
        (MIX, "six", "NoCell", "one product, not a mix", None),
    ],
)
def test_what_a_cell_cannot_make_is_refused_where_it_is(
    text: str, arm: str, code: str, said: str, line: int | None
) -> None:
    why = refusal(text, arm)
    assert why.code == code and said in why.message and "rails" in why.hint
    assert (why.position.line if why.position else None) == line


def test_a_push_of_an_arm_is_at_its_tool() -> None:
    """With the moment about its first joint that its drive has a share of; that joint gives way."""
    share = -0.4
    simulation = Simulation(cell("six"), RunRequest(units=1))
    world, interventions = simulation.physical, Interventions(simulation)
    m, d = world.m, world.d
    mujoco.mj_forward(m, d)
    interventions.push(1, share, 0.3)
    pushed = interventions.pushed
    assert pushed is not None and abs(pushed.force) < 150.0 * abs(share) / 0.2
    for _ in range(5):
        simulation.supervisor.step()
    tool, joint = m.body("r2/tool").id, m.joint("r2/pan").id
    force, off = d.xfrc_applied[tool, :3], d.xipos[tool] - d.xanchor[joint]
    assert np.cross(off, force)[2] == pytest.approx(share * 150.0, rel=0.02)
    assert force @ off == pytest.approx(0.0, abs=0.05 * np.linalg.norm(force))
    assert 1e-4 < pushed.gave < 0.1


def test_three_arms_have_no_room() -> None:
    text = SMALL.replace("root = box", "root = top; top = mate ( box, knob )")
    text += "; knob = atomic ( cylinder = (0.008, 0.012), pos = (0, 0, 0.0665) )"
    templates = all_templates()
    rails = Project(read_pag(text, templates), templates)
    factory = armed(rails, ArmModel.of("six"), (CellArm(),) * 3).compiled
    place = Arrangement(
        factory, rails.product, {0: rails.layout}, 0, ArmModel.of("six").chain, 0.0, 0.41
    )
    with pytest.raises(RunError) as error:
        place.stands  # noqa: B018
    assert_layout(error.value.diagnostics, "3 arms have no room", "at most 2")


def assert_layout(found: tuple[Diagnostic, ...], said: str, hint: str) -> None:
    (why,) = found
    assert why.code == "Layout" and said in why.message and hint in why.hint


__all__ = ["own"]


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
