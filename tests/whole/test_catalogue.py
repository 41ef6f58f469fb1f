"""What is found by directory, each tried once: templates, robot types, exporters, examples."""

from __future__ import annotations

import tomllib
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import pytest

import factory
from factory.apps.exports import exporters
from factory.engine.mjcf.robots import load_robot_model
from factory.floor.robots.catalogue import load_catalogue
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.export_values import kept_log
from tests.good_runs import assert_good
from tests.paths import ROOT, files_in
from tests.slow import slow_but

TEMPLATES = sorted(path.stem for path in (ROOT / "templates").glob("*.op"))
ROBOTS = list(tomllib.loads((ROOT / "mjcf" / "catalogue.toml").read_text("utf-8")))
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.pag"))


def smallest_product(template: Template) -> str:
    """A PAG that needs the template: parts, one operation, and a weld to take its product on."""
    if template.geometry:
        return "root = p; p = atomic ( box = (0.05, 0.04, 0.03) )"
    parts = [f"p{n}" for n in range(len(template.inputs))]
    made = [f"{p} = atomic ()" for p in parts]
    if template.name == "dropoff":
        return "root = p0; " + "; ".join(made)
    if template.name in ("pick", "place"):
        block, pin = "box = (0.08, 0.08, 0.02)", "box = (0.04, 0.02, 0.03), pos = (0, 0, 0.025)"
        return f"root = s; s = place ( p0, p1 ); p0 = atomic ( {block} ); p1 = atomic ( {pin} )"
    if template.name == "insert":
        return "root = s; s = mate ( p0, p1, p2 ); p2 = atomic (); " + "; ".join(made)
    operation = f"s = {template.name} ( {', '.join(parts)} )"
    return f"root = t; t = weld ( s, dwell = 0.1 ); {operation}; " + "; ".join(made)


@pytest.mark.parametrize(
    ("name", "world"),
    slow_but(
        [("pick", "mujoco"), *product(TEMPLATES, ["ideal"])],
        product(TEMPLATES, ["ideal", "mujoco"]),
    ),
)
def test_templates_run(name: str, world: str) -> None:
    templates = all_templates()
    plan = factory.compile(read_pag(smallest_product(templates[name]), templates))
    assert name in {operation.template.name for operation in plan.operations}
    assert factory.verify(plan).holds
    run = factory.run(factory.lay_out(plan), world=world, units=1)
    assert run.products == 1
    assert run.refines_net
    if world == "mujoco":
        assert_good(run)


@pytest.mark.parametrize("name", ROBOTS)
def test_robot_types_load(name: str) -> None:
    """Alone in stock MuJoCo, with the joint and the actuator that every type has."""
    robot = load_catalogue()[name]
    assert robot.summary
    m = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    first, kind = "slide", mujoco.mjtJoint.mjJNT_SLIDE
    if not robot.travels:
        first, kind = "turn", mujoco.mjtJoint.mjJNT_HINGE
    assert m.joint(first).type == kind
    assert m.actuator("drive").trnid[0] == m.joint(first).id
    assert m.njnt == len(robot.body.axes)
    assert m.site("nest").id >= 0
    model = load_robot_model(robot)
    assert model.name == name
    assert ElementTree.parse(robot.mjcf).getroot().get("model") == name


def test_every_file_of_the_folder_is_in_the_catalogue() -> None:
    listed = {robot.mjcf.name for robot in load_catalogue().types.values()}
    assert {path.name for path in (ROOT / "mjcf").glob("*.xml")} == listed


def test_templates_ask_for_robots_that_exist() -> None:
    wanted = {robot for template in all_templates().values() for robot in template.robots}
    assert wanted <= set(ROBOTS)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run of the paper's example."""
    return kept_log(with_hands("paper"), tmp_path_factory.mktemp("log") / "run.log")


FORMATS = [e.format for e in exporters().values() if e.takes != "cell"]
LARGE = ("gltf-factory", "gltf", "urdf", "stl", "dxf")


@pytest.mark.parametrize("form", slow_but({*FORMATS} - {*LARGE}, FORMATS))
def test_exporters_run(run: Terminal, form: str, tmp_path: Path, log: Path) -> None:
    if form == "usd":
        pytest.importorskip("pxr", reason="the extra `usd` is not installed")
    exporter = exporters()[form]
    source = ROOT / "examples" / "paper.pag"
    if exporter.takes == "log":
        source = log
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        assert run("export", source, "--format", form, "-o", tmp_path / name / "x").status == 0
    one, other = (files_in(tmp_path / name) for name in ("one", "other"))
    assert any(one.values())
    assert one == other


@pytest.mark.parametrize("name", slow_but(["lamp"], EXAMPLES))
def test_examples_check(run: Terminal, name: str) -> None:
    done = run("check", ROOT / "examples" / f"{name}.pag", "--json")
    assert done.status == 0
    document = done.json
    n, robots = document["transitions"] // 2 - 1, document["robots"]
    steps = sum(len(gear["places"]) // 2 for gear in document["gears"])
    assert document["places"] == n + 1 + steps
    assert "products" in document or steps == n + robots
    assert document["tokens"] == robots
    assert document["clashes"] == []
