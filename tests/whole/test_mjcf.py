"""The MJCF that is written: readable, relocatable, repeatable, and true to the layout and the
geometry."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations_with_replacement, cycle
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import trimesh

import factory
from factory.apps.exports.stock import model_files, written
from factory.engine.mjcf import names
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.simulation.modelling import physical_model
from factory.floor.layout.layout import Layout
from factory.support.errors import InputError, RunError
from factory.support.files import write_all
from factory.support.settings import Settings
from tests.command_line import Terminal, spawn
from tests.examples import without_hands
from tests.paths import PAPER, ROOT, files_in

KARY = """root = s; s = mate(a, b, c, t); t = mate(e, f); c = inspect(d, dwell = 0.2);
a = atomic(); b = atomic(); d = atomic(); e = atomic(); f = atomic()"""

SHAPES = """root = s; s = mate(box, cylinder, ball, wedge, flat, plain, shell, heavy);
box = atomic ( box = (0.06, 0.04, 0.02), quat = (1, 2, 3, 4), density = 700 );
cylinder = atomic ( cylinder = (0.02, 0.05), pos = (0.1, 0, 0), quat = (1, 1, 0, 0), mass = 0.3 );
ball = atomic ( sphere = 0.03, pos = (0, 0.1, 0), rgba = (1, 0, 0, 1) );
wedge = atomic ( mesh = "wedge.obj", scale = 2, pos = (0.1, 0.1, 0), quat = (1, 0, 0, 1) );
flat = atomic ( mesh = "flat.obj", pos = (0.2, 0.1, 0) );
shell = atomic ( mesh = "shell.stl", pos = (0.2, 0, 0), mass = 0.2 );
heavy = atomic ( mesh = "wedge.ply", pos = (0.3, 0, 0), density = 7800 );
plain = atomic ()"""


def laid_out(file: Path, text: str) -> Layout:
    file.write_text(text)
    return factory.lay_out(factory.compile(factory.load_pag(file)))


def compiled(model: Model, folder: Path) -> mujoco.MjModel:
    """The model as stock MuJoCo loads it from the disk."""
    write_all(model_files(written(model), folder / "model.xml"))
    return mujoco.MjModel.from_xml_path(str(folder / "model.xml"))


def meshes_of_parts(m: mujoco.MjModel) -> list[str]:
    """The names of a model's meshes, without those of the numbers of robots."""
    return [name for n in range(m.nmesh) if (name := m.mesh(n).name).startswith("mesh/")]


@pytest.fixture(scope="module")
def paper() -> Layout:
    return without_hands("paper")


@pytest.fixture(scope="module")
def shapes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Layout, mujoco.MjModel]:
    folder = tmp_path_factory.mktemp("shapes")
    wedge = trimesh.Trimesh(
        np.array([(0, 0, 0), (3, 0, 0), (0, 2, 0), (0, 0, 1)]) * 0.01,
        [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)],
    )
    wedge.export(folder / "wedge.obj")
    wedge.export(folder / "wedge.ply")
    trimesh.Trimesh([(0, 0, 0), (0.03, 0, 0), (0, 0.03, 0)], [(0, 1, 2)]).export(
        folder / "flat.obj"
    )
    shell = trimesh.creation.icosphere(radius=0.02)
    shell.update_faces(np.arange(len(shell.faces)) < 200)
    shell.export(folder / "shell.stl")
    layout = laid_out(folder / "shapes.pag", SHAPES)
    return layout, compiled(physical_model(layout, 1, Settings(timestep=0.002)), folder)


# --- the file -------------------------------------------------------------------------------------


def test_the_papers_example_to_the_letter(
    paper: Layout, golden: Callable[[str, str], None]
) -> None:
    golden("paper.xml", written(physical_model(paper, 1, Settings(timestep=0.002))).xml)


def test_builds_are_the_same_in_every_process(
    run: Terminal, shapes: tuple[Layout, object], tmp_path: Path
) -> None:
    source, seed = Path(shapes[0].factory.pag.file), os.environ.get("PYTHONHASHSEED")
    other = spawn("build", source, "-o", tmp_path / "b", PYTHONHASHSEED="2" if seed == "1" else "1")
    assert run("build", source, "-o", tmp_path / "a").status == other.status == 0
    assert files_in(tmp_path / "a") == files_in(tmp_path / "b")


def test_the_xml_and_its_meshes_move_together(
    run: Terminal, shapes: tuple[Layout, mujoco.MjModel], tmp_path: Path
) -> None:
    (tmp_path / "here").mkdir()
    source = shapes[0].factory.pag.file
    document = run("build", source, "--mjcf", tmp_path / "here" / "a&b <1>.xml", "--json").json
    assert {Path(name).suffix for name in files_in(tmp_path)} >= {".xml", ".stl", ".obj"}
    shutil.move(tmp_path / "here", tmp_path / "there")
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "there" / "a&b <1>.xml"))
    assert len(meshes_of_parts(m)) == 4
    assert m.njnt == document["joints"]
    assert m.neq == document["welds"]
    assert sum(names.kind(m.body(b).name) == "part" for b in range(m.nbody)) == document["parts"]
    assert sum(m.body(b).name.endswith("/carriage") for b in range(m.nbody)) == document["robots"]


@pytest.mark.parametrize(
    "name", ["..", ".", "x y", "ü", "--", "a'\"&<b", ".hidden", "a.b.c", "\x01"]
)
def test_odd_names_stay_in_their_folder(run: Terminal, tmp_path: Path, name: str) -> None:
    source = tmp_path / "in" / f"{name}.pag"
    source.parent.mkdir()
    shutil.copy(ROOT / "tests/broken/bricks/3001.obj", tmp_path / "brick.obj")
    source.write_text('root = p; p = atomic ( mesh = "../brick.obj" )')
    before = files_in(tmp_path)
    done = run("build", source, "-o", tmp_path / "out", "--json")
    assert done.status == 0
    created = files_in(tmp_path).keys() - before.keys()
    assert all(file.startswith("out/") for file in created)
    assert any(file.endswith((".obj", ".stl")) for file in created)
    assert len(meshes_of_parts(mujoco.MjModel.from_xml_path(done.json["mjcf"]))) == 1


# --- what is in it --------------------------------------------------------------------------------


def test_names_carry_meaning(paper: Layout, tmp_path: Path) -> None:
    m = compiled(physical_model(paper), tmp_path)
    for robot in paper.factory.robots:
        assert m.joint(names.slide(robot.name)).type == mujoco.mjtJoint.mjJNT_SLIDE
        drive = m.actuator(names.drive(robot.name))
        assert drive.trnid[0] == m.joint(names.slide(robot.name)).id
        low, high = m.actuator_forcerange[drive.id]
        assert -1000 < low < 0 < high < 1000
        assert m.body(names.carriage(robot.name)).id > 0
    pool = {"part1": 4, "part2": 4, "part3": 3}
    for label, copies in pool.items():
        for number in range(1, copies + 1):
            assert m.joint(names.part(label, number)).type == mujoco.mjtJoint.mjJNT_FREE
    bodies = [m.body(b).name for b in range(1, m.nbody)]
    assert sum(names.kind(b) == "part" for b in bodies) == sum(pool.values())
    assert all(bodies) and all(m.geom(g).name for g in range(m.ngeom))
    assert {names.label_of(b) for b in bodies if names.kind(b) == "part"} == set(pool)
    assert {m.camera(c).name for c in range(m.ncam)} == {"overview", "top", "product"}
    assert m.cam_bodyid[m.camera("product").id] == m.body("r1/carriage").id


def test_robots_come_before_parts(paper: Layout, tmp_path: Path) -> None:
    m = compiled(physical_model(paper), tmp_path)
    kinds = [names.kind(m.body(int(b)).name) for b in m.dof_bodyid]
    assert kinds == sorted(kinds, key=["robot", "outfeed", "feeder", "part"].index)


def principal_axis(m: mujoco.MjModel, seen: np.ndarray) -> np.ndarray:
    """Along which the places of geoms vary most: the engine's broad phase sweeps along it, and
    boxes bodies along it and those across."""
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    return np.asarray(np.linalg.eigh(np.cov(d.geom_xpos[seen & (m.geom_bodyid > 0)].T))[1][:, -1])


@pytest.mark.parametrize(
    "name", ["paper", "stool", pytest.param("gearbox", marks=pytest.mark.slow)]
)
def test_the_broad_phase_sweeps_along_the_floor(name: str, tmp_path: Path) -> None:
    layout = without_hands(name)
    m = compiled(physical_model(layout), tmp_path)
    xlo, xhi, ylo, yhi = layout.floor
    compass = m.geom_bodyid == m.body(names.COMPASS).id
    axis = 0 if xhi - xlo >= yhi - ylo else 1
    assert abs(principal_axis(m, ~compass)[axis]) < 0.999
    assert abs(principal_axis(m, compass | ~compass)[axis]) > 1 - 1e-9
    assert not m.geom_contype[compass].any() and not m.geom_conaffinity[compass].any()
    assert (m.geom_rgba[compass, 3] == 0).all() and (m.geom_group[compass] > 2).all()


def test_bodies_that_collide_have_no_geoms_that_are_only_shown(
    paper: Layout, tmp_path: Path
) -> None:
    m = compiled(physical_model(paper, 1), tmp_path)
    collides = (m.geom_contype | m.geom_conaffinity) != 0
    boxed = ((m.body_contype | m.body_conaffinity) != 0)[m.geom_bodyid]
    hands = 3 * sum(hand is not None for hand in paper.hands)
    robots, feeders = 3 * 6 + hands, (3 + 4 + 1) * 3
    outfeed = 3 + 6 + 2 + 2 * 2  # a slot for the hand makes three of belt and tray
    assert hands == 3 * 5
    assert collides.sum() == robots + feeders + outfeed + 1 + 3  # and the floor, and parts
    assert (boxed == collides).all()


@pytest.mark.parametrize("text", [PAPER.read_text(), KARY], ids=["paper", "kary"])
def test_a_weld_for_every_pair_that_can_be_joined(tmp_path: Path, text: str) -> None:
    layout = laid_out(tmp_path / "p.pag", text)
    m = compiled(physical_model(layout), tmp_path)
    joined = {(m.body(int(a)).name, names.label_of(m.body(int(b)).name)) for a, b in pairs(m)}
    made = layout.factory
    for operation in made.operations:
        for slot, robot in enumerate(operation.robots):
            for label in {operation.before[slot], operation.after[slot]} & set(made.contents):
                for part in made.contents[label]:
                    assert (names.carriage(made.robots[robot].name), part) in joined
    for part in made.contents[made.pag.root]:
        assert (names.slider(part), part) in joined
        assert (names.OUTFEED_TRAY, part) in joined


def pairs(m: mujoco.MjModel) -> list[tuple[int, int]]:
    return [(int(a), int(b)) for a, b in zip(m.eq_obj1id, m.eq_obj2id, strict=True)]


@pytest.mark.parametrize(
    "label", ["box", "cylinder", "ball", "wedge", "flat", "plain", "shell", "heavy"]
)
def test_mass_and_inertia_are_the_geometrys(
    shapes: tuple[Layout, mujoco.MjModel], label: str
) -> None:
    layout, m = shapes
    body = m.body(names.part(label, 1))
    solid = layout.product.solids[label]
    assert body.mass[0] == pytest.approx(solid.mass, rel=1e-6)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    turn = turn.reshape(3, 3)
    inertia = turn @ np.diag(body.inertia) @ turn.T
    assert inertia == pytest.approx(solid.inertia, rel=1e-4, abs=1e-6 * np.abs(solid.inertia).max())


def test_masses_worked_out_by_hand(shapes: tuple[Layout, mujoco.MjModel]) -> None:
    mass = {part: shapes[1].body(names.part(part, 1)).mass[0] for part in shapes[0].product.solids}
    assert mass["box"] == pytest.approx(700 * 0.06 * 0.04 * 0.02)
    assert mass["cylinder"] == pytest.approx(0.3)
    assert mass["ball"] == pytest.approx(1000 * 4 / 3 * np.pi * 0.03**3)
    assert mass["wedge"] == pytest.approx(1000 * 0.06 * 0.04 * 0.02 / 6)
    assert mass["heavy"] == pytest.approx(7800 * 0.03 * 0.02 * 0.01 / 6)
    assert mass["shell"] == pytest.approx(0.2)


def test_parts_stand_where_the_pag_says(shapes: tuple[Layout, mujoco.MjModel]) -> None:
    """In the output robot's hands the parts are the product: R(quat) · (scale · v) + pos."""
    layout, m = shapes
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    wedge = np.array([(0, 0, 0), (3, 0, 0), (0, 2, 0), (0, 0, 1)]) * 0.02
    turned = wedge @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T + (0.1, 0.1, 0)
    geom = m.geom(names.part("wedge", 1))
    mesh = m.geom_dataid[geom.id]
    start, count = m.mesh_vertadr[mesh], m.mesh_vertnum[mesh]
    local = m.mesh_vert[start : start + count]
    seen = local @ d.geom_xmat[geom.id].reshape(3, 3).T + d.geom_xpos[geom.id]
    first = names.part("box", 1)
    offset = d.xpos[m.body(names.part("wedge", 1)).id] - d.xpos[m.body(first).id]
    at_feeder = seen - d.xpos[m.body(names.part("wedge", 1)).id]
    wanted = turned - layout.product.solids["wedge"].centre
    assert sorted(map(tuple, at_feeder.round(6))) == sorted(map(tuple, wanted.round(6)))
    assert np.isfinite(offset).all()


def test_the_engine_sees_what_was_written(shapes: tuple[Layout, mujoco.MjModel]) -> None:
    """Nothing is left out where numbers become text: tiny parts keep mass and inertia."""
    _, m = shapes
    assert (m.body_mass[1:] >= 0).all()
    parts = [b for b in range(m.nbody) if names.kind(m.body(b).name) == "part"]
    assert (m.body_inertia[parts] > 0).all()
    assert (m.opt.timestep, m.opt.integrator) == (0.002, mujoco.mjtIntegrator.mjINT_EULER)


def test_settings_reach_the_model(paper: Layout) -> None:
    weak = physical_model(paper, 1, Settings(force=1.0, timestep=0.004))
    strong = physical_model(paper, 1, Settings(force=9.0))
    assert all(a.force < b.force for a, b in zip(weak.drives, strong.drives, strict=True))
    assert 'timestep="0.004"' in weak.xml


LENGTHS = (1e-9, 2e-8, 1e-5, 1e-3, 1.0, 1e3, 15e3)
SIZES = [
    *(f"sphere = {a}" for a in LENGTHS),
    *(f"cylinder = ({a}, {b})" for a in LENGTHS for b in LENGTHS),
    *(f"box = {box}" for box in combinations_with_replacement(LENGTHS[::2], 3)),
    *(f"box = {box[::-1]}" for box in combinations_with_replacement(LENGTHS[1::2], 3)),
]
TURNS = ["", ", quat = (1, 0, 1, 0)", ", quat = (4, -3, 2, 1)", ", mass = 1", ", mass = 1e-12"]


def test_the_engine_takes_every_size_that_is_accepted(tmp_path: Path) -> None:
    """Dust, sheets, threads and towers: what is refused is refused at the shape or the mass."""
    refused = 0
    for size, turn in zip(SIZES, cycle(TURNS), strict=False):
        try:
            layout = laid_out(tmp_path / "p.pag", f"root = a; a = atomic({size}{turn})")
        except RunError as error:  # a hand is thicker than what it holds over the tray's slot
            assert {found.code for found in error.diagnostics} == {"Layout"}
            assert min(map(float, re.findall(r"[\d.e-]+", size.partition("=")[2]))) < 2e-3
            continue
        except InputError as error:
            (found,) = error.diagnostics
            assert found.code == "BadValue" and found.position
            assert found.position.column == 24 + size.index("=")
            refused += 1
            continue
        model = physical_model(layout, 1)
        m = mujoco.MjModel.from_xml_string(model.xml)
        assert m.body(names.part("a", 1)).inertia.min() > 0
    assert 0 < refused < len(SIZES) / 2


def test_what_the_engine_refuses_is_named(tmp_path: Path) -> None:
    model = physical_model(laid_out(tmp_path / "p.pag", "root = a; a = atomic(sphere = 0.01)"), 1)
    with pytest.raises(InputError) as caught:
        load(replace(model, xml=model.xml.replace('fullinertia="', 'fullinertia="-')))
    (found,) = caught.value.diagnostics
    assert (found.code, found.hint) == ("BadValue", "give it another shape or mass")
    assert found.position and found.position.column == 11


# --- how it behaves -------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [PAPER.read_text(), KARY], ids=["paper", "kary"])
def test_at_home_everything_stands_still(tmp_path: Path, text: str) -> None:
    m = compiled(physical_model(laid_out(tmp_path / "p.pag", text)), tmp_path)
    assert_still(m)


def test_parts_of_every_shape_stand_still(shapes: tuple[Layout, mujoco.MjModel]) -> None:
    assert_still(shapes[1])


def assert_still(m: mujoco.MjModel) -> None:
    """For two seconds, from the start, nothing moves or touches."""
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    start = d.xpos.copy()
    for _ in range(1000):
        mujoco.mj_step(m, d)
        assert d.ncon == 0
    assert np.abs(d.xpos - start).max() < 1e-4
    assert np.abs(d.qvel).max() < 1e-3
    assert sum(w.number for w in d.warning) == 0


def test_the_file_is_plain_mjcf(paper: Layout) -> None:
    """Known sections only, in an order that people expect, each element on a line of its own."""
    xml = written(physical_model(paper, 1)).xml
    root = ElementTree.fromstring(xml)
    assert [child.tag for child in root] == [
        *("compiler", "option", "size", "visual", "statistic", "default", "asset", "worldbody"),
        *("equality", "actuator", "sensor", "keyframe"),
    ]
    assert sum(1 for _ in root.iter()) <= len(xml.splitlines())
    assert xml.isascii()


def test_meshes_are_shared(tmp_path: Path) -> None:
    shutil.copy(ROOT / "tests/broken/bricks/3001.obj", tmp_path / "b.obj")
    parts = "".join(f'p{n} = atomic(mesh = "b.obj", pos = (0, 0, {n}));' for n in range(3))
    layout = laid_out(tmp_path / "p.pag", f"root = s; s = mate(p0, p1, p2); {parts}")
    files: Mapping[str, bytes] = physical_model(layout, 1).files
    assert len(files) == 1
    assert all(Path(name).name == name for name in files)
