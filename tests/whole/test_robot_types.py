"""Robot types of packages: what is read of their MJCF is what the engine compiles, what is laid out
and what runs; what cannot differ is refused by name."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from factory.floor.robots.catalogue import load_catalogue
from factory.floor.robots.reader import read_body
from factory.pipeline import Project
from factory.support.errors import InputError
from factory.support.extensions import extensions
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.robot_bodies import ARM_TOP, CARRIAGE, CARRIAGE_TOP, MAST
from factory.theory.problem.robot_types import Catalogue, RobotType
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT

DOT, LIFT = ((ROOT / "mjcf" / f"{name}.xml").read_text() for name in ("dot", "lift"))

BOX = 'size="0.03 0.03 0.0175" pos="0 0 0.0325" mass="1.6"'
"""The carriage in dot.xml."""

SHELL = '<body name="shell">'
DRIVE = 'name="drive" joint="slide"'

BIG = (
    DOT.replace(BOX, 'size="0.05 0.04 0.0175" pos="0.01 0 0.0325" mass="7.5"')
    .replace(DRIVE, f'{DRIVE} kp="9000" kv="700" forcerange="-45 45"')
    .replace('armature="0"', 'armature="0.5"')
)
"""A type with a larger and heavier carriage, which is not in the mast's middle, and a drive of its
own."""


def written(folder: Path, text: str) -> Path:
    path = folder / "big.xml"
    path.write_text(text)
    return path


def with_type(text: str, folder: Path, extends: str = "dot") -> Project:
    """The paper's example, in which robots of the type replace each `dot`."""
    path = written(folder, text)
    types = dict(load_catalogue().types)
    types["big"] = RobotType("big", path, read_body("big", path), extends)
    templates = {
        name: replace(t, robots=tuple("big" if r == "dot" else r for r in t.robots))
        for name, t in all_templates().items()
    }
    return Project(load_pag(PAPER, templates), templates, Catalogue(types))


side = st.floats(0.002, 0.2).map(lambda value: round(value, 4))
place = st.floats(-0.05, 0.05).map(lambda value: round(value, 4))
mass = st.floats(0.001, 50).map(lambda value: round(value, 3))
forms = st.sampled_from(("box", "sphere", "cylinder", "capsule", "ellipsoid"))


@given(
    sizes=st.tuples(side, side, side),
    where=st.tuples(place, place),
    form=forms,
    masses=st.tuples(mass, mass),
    lift=st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
def test_what_is_read_is_what_the_engine_compiles(
    tmp_path: Path,
    sizes: tuple[float, float, float],
    where: tuple[float, float],
    form: str,
    masses: tuple[float, float],
    lift: bool,
) -> None:
    """Widths and masses, or it is refused because it is not where a carriage may be."""
    size, text = " ".join(map(str, sizes)), LIFT if lift else DOT
    bumper = (
        f'<geom name="bumper" class="solid" type="{form}" size="{size}"'
        f' pos="{where[0]} {where[1]} 0.025" mass="{masses[0]}"/>'
    )
    text = re.sub(r'mass="1\.[26]"', f'mass="{masses[1]}"', text, count=1)
    path = written(tmp_path, text.replace(SHELL, bumper + SHELL))
    m = mujoco.MjModel.from_xml_path(str(path))
    geom = m.geom("bumper").id
    at, half = m.geom_pos[geom] + m.geom_aabb[geom, :3], m.geom_aabb[geom, 3:]
    low, high = at - half, at + half
    wide = 2 * max(abs(low[:2]).max(), abs(high[:2]).max())
    if low[2] < -1e-9 or high[2] > CARRIAGE_TOP + 1e-9:
        within = high[2] <= ARM_TOP and low[2] >= 0 and wide <= MAST
        if not within:
            with pytest.raises(InputError, match="BadRobot robot type 'big': the geom 'bumper'"):
                read_body("big", path)
            return
    body = read_body("big", path)
    assert max(wide, CARRIAGE) - 1e-9 <= body.carriage < max(wide, CARRIAGE) + 0.002 + 1e-9
    moved = [m.body_subtreemass[m.jnt_bodyid[m.joint(axis.joint).id]] for axis in body.axes]
    assert [axis.mass for axis in body.axes] == pytest.approx(moved)
    assert body.mass == pytest.approx(m.body_subtreemass[0])
    assert [a.armature for a in body.axes] == pytest.approx([*m.dof_armature])
    assert [a.friction for a in body.axes] == pytest.approx([*m.dof_frictionloss])


WRONG = [
    (BOX, BOX.replace("0.03 0.03", "0.51 0.03"), 22, "510 mm from the mast's axis"),
    (BOX, BOX.replace(' mass="1.6"', ""), 22, "has no mass"),
    (BOX, BOX.replace("1.6", "nan"), 22, "mass of <geom> is 'nan'"),
    ('size="0.009 0.009 0.0175"', 'size="0.009 0.02 0.0175"', 23, "20 mm from the mast's axis"),
    ('size="0.03 0.008 0.009"', 'size="0.03 0.02 0.009"', 24, "20 mm to a side"),
    ('name="stripe" class="shown"', 'name="stripe" class="solid" mass="0"', 29, "is solid"),
    ('size="0.0305 0.0305 0.002"', 'size="0.09 0.0305 0.002"', 29, "is seen 90 mm from"),
    ('name="cap"', 'name="tower"', 30, "as a limb of a hand is"),
    ('contype="1"', 'contype="0"', 22, "contype 0, conaffinity 1"),
    ('name="slide" type="slide"', 'name="slide" type="hinge"', 21, "is of the type hinge"),
    ('name="slide" type="slide"', 'name="sled" type="slide"', 21, "the joint 'sled' is in"),
    ('axis="-1 0 0"', 'axis="0 -1 0"', 21, "has the axis 0 -1 0"),
    ('axis="-1 0 0"', 'axis="-1 0 0" range="-1 1"', 21, "<joint> has 'range'"),
    ('<site name="nest"', '<site name="tip"', 20, "its sites are 'tip' in 'carriage'"),
    (DRIVE, f'{DRIVE} kp="4000"', 36, "one of kp and kv"),
    (DRIVE, f'{DRIVE} forcerange="-10 50"', 36, "forcerange of 'slide' is -10 50"),
    ('<position name="drive"', '<motor name="drive"', 36, "<motor> inside <actuator>"),
    ('<body name="carriage">', '<body name="carriage" pos="0.1 0 0">', 20, "<body> has 'pos'"),
    (SHELL, '<body name="head">', 26, "the geom 'finger' is in 'head'"),
    ('<material name="rubber"', '<material name="gum"', 5, "no material 'rubber'"),
]


@pytest.mark.parametrize(("text", "by", "line", "why"), WRONG)
def test_what_cannot_differ_is_refused_at_its_line(
    tmp_path: Path, text: str, by: str, line: int, why: str
) -> None:
    assert text in DOT
    path = written(tmp_path, DOT.replace(text, by, 1))
    with pytest.raises(InputError) as caught:
        read_body("big", path)
    found = caught.value.diagnostics
    assert {d.code for d in found} == {"BadRobot"}
    assert any(why in d.message and d.position and d.position.line == line for d in found), found
    assert all(d.hint.startswith("valid: ") for d in found)


@pytest.mark.parametrize(
    ("drive", "why"),
    [
        ('forcerange="-5 5"', "the motor of 'slide' gives 5 N, and r1, with 0.61 kg, needs"),
        ('kp="40" kv="15"', "kp 40 and kv 15 of 'slide' do not keep r1"),
    ],
)
def test_a_drive_that_cannot_follow_is_refused(tmp_path: Path, drive: str, why: str) -> None:
    project = with_type(DOT.replace(DRIVE, f"{DRIVE} {drive}"), tmp_path)
    with pytest.raises(InputError) as caught:
        _ = project.layout
    first = caught.value.diagnostics[0]
    assert first.code == "BadRobot" and why in first.message, first
    assert first.position is not None and first.position.line == 36


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with the type `big` as if it were installed, and templates of its own that ask for
    it."""
    robots, about = tmp_path / "hauling" / "robots", tmp_path / "hauling-1.0.dist-info"
    for folder in (robots, about, tmp_path / "mine"):
        folder.mkdir(parents=True)
    for folder in (robots, robots.parent):
        (folder / "__init__.py").touch()
    (robots / "catalogue.toml").write_text('[big]\nmjcf = "big.xml"\nextends = "dot"\n')
    (robots / "big.xml").write_text(BIG)
    (about / "METADATA").write_text("Name: hauling\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[factory.robots]\nhauling = hauling.robots\n")
    for path in (ROOT / "templates").glob("*.op"):
        (tmp_path / "mine" / path.name).write_text(re.sub(r"\bdot\b", "big", path.read_text()))
    monkeypatch.syspath_prepend(tmp_path)
    extensions.cache_clear()
    yield tmp_path
    extensions.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "hauling"]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("text", "by", "why"),
    [
        ('extends = "dot"', 'extends = "lift"', "'big' extends 'lift' and cannot do as that does"),
        ('extends = "dot"', 'extend = "dot"', "'big' has the unknown key 'extend'"),
        ('mjcf = "big.xml"\n', "", "'big' has no 'mjcf'"),
        ('"big.xml"', '"none.xml"', "the file of robot type 'big' cannot be read"),
        ('"dot"', "3", "extends of 'big' is 3, not a text"),
    ],
)
def test_a_mistake_in_a_catalogue_is_named(
    run: Terminal, package: Path, text: str, by: str, why: str
) -> None:
    file = package / "hauling" / "robots" / "catalogue.toml"
    assert text in file.read_text()
    file.write_text(file.read_text().replace(text, by))
    done = run("check", PAPER)
    assert done.status == 2 and why in done.err, done.err
