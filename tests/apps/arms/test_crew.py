"""The arms of a cell in `factory.toml`, and the plan of a cell."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from factory.api import Diagnostic, InputError, Position, RunError, Settings
from factory.apps.arms import few_arms
from factory.apps.arms.ground import CellGround, CellProject, with_arms
from factory.apps.log.cell_table import cell_in
from factory.engine.timing.cycle_time import CycleTime
from factory.floor.layout.request import Ground
from factory.pipeline import Project, read
from tests.apps.arms.test_read import OWN, own
from tests.arm_cells import SMALL
from tests.command_line import Terminal

__all__ = ["own"]

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
