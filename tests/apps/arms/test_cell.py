"""Cells of one arm and of two: proved, predicted, and made in both worlds; what they refuse. The
arms of a cell in `factory.toml`, and the plan of a cell."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from factory.api import Diagnostic, InputError, RunError, Settings
from factory.apps.arms import few_arms
from factory.apps.arms.arming import armed
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.ground import CellGround, CellProject, with_arms
from factory.apps.arms.model import ArmModel
from factory.apps.live.interventions import Interventions
from factory.apps.log.cell_table import cell_in
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import CycleTime
from factory.floor.layout.coordinating import with_machines
from factory.floor.layout.request import Ground
from factory.pipeline import Project, read
from factory.support.errors import Position
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.verify import verify
from tests.apps.arms.test_read import BOX, OWN, own
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


BEAM = """root = x;
x = mate ( x2, c );
x2 = mate ( x1, b );
x1 = mate ( tray, s );
s = mate ( d, e );
tray = atomic ( box = (0.2, 0.08, 0.03), pos = (0, 0, 0.015) );
b = atomic ( box = (0.03, 0.03, 0.03), pos = (0, 0, 0.0452) );
c = atomic ( box = (0.03, 0.03, 0.03), pos = (0.06, 0, 0.0452) );
d = atomic ( box = (0.04, 0.03, 0.02), pos = (-0.06, 0, 0.0402) );
e = atomic ( box = (0.02, 0.02, 0.02), pos = (-0.06, 0, 0.0604) )"""
"""A tray with two blocks and a sub-assembly."""


def product(folder: Path, text: str = SMALL, arms: str = "") -> Path:
    (folder / "p.pag").write_text(text)
    if arms:
        (folder / "factory.toml").write_text(f"units = 2\n[arms]\n{arms}\n")
    return folder / "p.pag"


def brings(project: Project) -> list[set[str]]:
    """What each arm of a project takes."""
    factory = project.planned
    arms = [robot for robot in factory.robots if robot.body.first.moves]
    taken = [{factory.operations[n].label for n in arm.operations} for arm in arms]
    return [{label for label in of if label in {"b", "c", "s/taken"}} for of in taken]


def table(left: list[str], right: list[str]) -> dict[str, dict[str, object]]:
    return {"l": {"type": "six", "labels": left}, "r": {"type": "six", "labels": right}}


@pytest.mark.parametrize(
    ("left", "right", "dealt"),
    [
        ([], [], [{"s/taken"}, {"b", "c"}]),
        (["b"], [], [{"s/taken", "b"}, {"c"}]),
        ([], ["b"], [{"s/taken", "c"}, {"b"}]),
        ([], ["c", "b"], [{"s/taken"}, {"b", "c"}]),
    ],
)
def test_arms_place_what_they_are_said_to(
    tmp_path: Path, left: list[str], right: list[str], dealt: list[set[str]]
) -> None:
    """What is left goes to those of which nothing is said; sub-assemblies go to the first."""
    rails = read(product(tmp_path, BEAM))
    assert brings(with_arms(rails, table(left, right), Position("factory.toml", 1, 1))) == dealt


@pytest.mark.parametrize(
    ("arms", "said"),
    [
        ('l = { type = "six", label = ["lid"] }', "BadValue [arms] l: there is no key 'label'"),
        ("l = { }", "BadValue [arms]: an arm has either a type or an mjcf"),
        ('l = { type = "sixx" }', "BadValue [arms]: there is no type 'sixx'"),
        ('l = { type = "six", tool = "t" }', "BadValue [arms]: a type has its tool"),
        ('l = { type = "six", labels = "lid" }', "BadValue [arms] l: labels must be a list"),
        ('l = { mjcf = "no.xml" }', "BadValue [arms]: there is no file"),
        ('l = { mjcf = "seven-axes.xml", speed = 2 }', "BadValue [arms]: speed and acceler"),
        ('l = { mjcf = "seven-axes.xml", tool = "t" }', "BadArm has no site 't'"),
        ('l = { mjcf = "seven-axes.xml", speed = [2] }', "BadArm has the speed [2.0]"),
        ('l = { type = "six" }\nr = { type = "scara" }', "BadValue [arms]: both arms of a cell"),
        ("\n".join(f'a{n} = {{ type = "six" }}' for n in range(3)), "BadValue [arms] has 3 arms"),
        ('l = { type = "six", labels = ["lud"] }', "NoCell no arm places 'lud', as l is to"),
        (
            'l = { type = "six" }\nr = { type = "six", labels = ["lid", "motor"] }',
            "NoCell 2 arms: nothing is left for one of them",
        ),
        (
            'l = { type = "six", labels = ["lid"] }\nr = { type = "six", labels = ["lid"] }',
            "NoCell both arms are to place 'lid'",
        ),
        ("l = 3", "BadValue arms must be a table of tables"),
    ],
)
def test_what_is_wrong_with_a_table_is_said(
    tmp_path: Path, own: Path, run: Terminal, arms: str, said: str
) -> None:
    assert own.parent == tmp_path
    done = run("check", product(tmp_path, arms=arms))
    assert done.status == 2 and said in done.err
    assert ("factory.toml:2:2: " if "BadArm" not in said else "seven-axes.xml:1:1: ") in done.err


def test_the_second_arm_has_no_sub_assemblies(tmp_path: Path, run: Terminal) -> None:
    arms = 'l = { type = "six" }\nr = { type = "six", labels = ["s"] }'
    done = run("check", product(tmp_path, BEAM, arms))
    assert "NoCell r cannot place 's', which has to do with a sub-assembly" in done.err
    assert "give it to l" in done.err


def test_an_arm_is_as_its_table_says(tmp_path: Path, own: Path) -> None:
    """Its tool and limits are written into its MJCF, which a log has with it."""
    own.write_text(
        OWN.replace('<site name="tool"', '<site name="tool" pos="9 9 9"/><site name="tip"')
    )
    row = {"mjcf": own.name, "tool": "tip", "speed": [1.5] * 7, "labels": ["lid", "motor"]}
    made = with_arms(
        read(product(tmp_path)), {"left": row}, Position(str(tmp_path / "f.toml"), 1, 1)
    )
    assert isinstance(made.ground, CellGround) and made.ground.model is not None
    chain = made.ground.model.chain
    assert set(chain.limits.speed) == {1.5} and set(chain.limits.acceleration) == {16.0}
    assert abs(chain.tool_place[2] - 0.02) < 1e-9
    product_of_it, cell = cell_in(made) or (None, None)
    assert product_of_it is not None and cell is not None
    again = cell.project(product_of_it)
    assert isinstance(again.ground, CellGround) and again.ground.arms == made.ground.arms
    assert again.ground.model is not None
    assert (again.ground.model.chain.limits.speed == chain.limits.speed).all()


@pytest.mark.parametrize(
    ("takes", "cycle", "arms", "warned"),
    [
        ((9.0, 5.0), 9.0, 1, False),
        ((9.0, 5.0), 8.0, 2, False),
        ((9.0, 5.0), 4.0, 2, True),
        ((9.0, 9.5), 4.0, 1, True),
        ((None, 5.0), 6.0, 2, False),
        ((9.0, None), 6.0, 1, True),
    ],
)
def test_a_cycle_time_asks_for_few_arms(
    takes: tuple[float | None, ...],
    cycle: float,
    arms: int,
    warned: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two only where one is too slow, and no slower ones; if either has no layout, the other."""

    def paced(made: CellProject, _: Settings) -> tuple[CycleTime, tuple[()]]:
        seconds = takes[len(brings(made)) - 1]
        if seconds is None:
            raise RunError(Diagnostic("Layout", "no room"))
        return CycleTime(seconds, ""), ()

    monkeypatch.setattr(CellProject, "layout", property(lambda made: made))
    monkeypatch.setattr(few_arms, "pace", paced)
    warnings = list[Diagnostic]()
    product_of_it = read(product(tmp_path, BEAM), ground=Ground(cycle=cycle))
    made = few_arms.with_few_arms(product_of_it, "six", cycle, warnings.append)
    assert len(brings(made)) == arms and [d.code for d in warnings] == ["SlowCycle"] * warned
    with pytest.raises(InputError, match="the number is looked for"):
        few_arms.with_few_arms(product_of_it, "six=2", cycle, warnings.append)


def test_the_plan_of_a_cell_makes_the_same(tmp_path: Path, run: Terminal) -> None:
    """It has the arms with what they place, so it is read without the file that said so."""
    file = product(tmp_path, arms='left = { type = "six" }')
    built = run("build", file, "-o", tmp_path / "out", "--json")
    assert built.status == 0, built.err
    names = {Path(path).name for path in built.json["files"]}
    assert {"plan.json", "p.r2.joints.csv", "p.r2.program.txt", "p.clearance.json"} <= names
    assert not names & {"layout.json", "p.goals.json", "p.ways.json"}
    first = run("run", file, "--json")
    (tmp_path / "factory.toml").unlink()
    second = run("run", tmp_path / "out" / "plan.json", "--units", "2", "--json")
    assert first.status == second.status == 0
    assert first.json["events"] == second.json["events"]
    plan = tmp_path / "out" / "plan.json"
    refused = run("revise", plan, file)
    assert refused.status == 2 and "revise cannot be combined with --arm" in refused.err
    refused = run("run", plan, "--floor", "9x9")
    assert refused.status == 2 and "is a cell, as large as its arm" in refused.err
    table = json.loads(plan.read_text())
    for key, value, code in (
        *(("kind", "sixx", "BadPlan"), ("kind", 1, "BadPlan"), ("arms", 3, "BadPlan")),
        *(("text", "<mujoco/>", "BadArm"), ("crew", [{"labels": ["lud"]}], "NoCell")),
        *(("crew", [{}, {}], "BadPlan"), ("crew", {}, "BadPlan"), ("files", [], "BadPlan")),
    ):
        plan.write_text(json.dumps({**table, "cell": {**table["cell"], key: value}}))
        done = run("check", plan)
        assert done.status == 2 and f"{code} " in done.err, (key, done.err)
