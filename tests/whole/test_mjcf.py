"""The MJCF that is written: readable, relocatable, repeatable, and true to the layout and the
geometry. The timestep that the factory chooses: the longest that its drives allow, and no longer. A
build is left out if and only if nothing has changed since the one before."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

import factory
from factory.apps.exports.binary import beside
from factory.apps.exports.stock import model_files
from factory.apps.fidelity.record import QUANTITIES
from factory.engine.mjcf.driving import ALLOWED
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.simulation.modelling import physical_model
from factory.floor.layout.layout import Layout
from factory.support.errors import InputError
from factory.support.extensions import extensions
from factory.support.files import write_all
from factory.support.settings import AUTO, Settings
from tests.command_line import Terminal
from tests.examples import without_hands
from tests.paths import PAPER, ROOT, files_in
from tests.plug_in import write_package
from tests.stock_models import written

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


def test_the_papers_example_to_the_letter(
    paper: Layout, golden: Callable[[str, str], None]
) -> None:
    golden("paper.xml", written(physical_model(paper, 1, Settings(timestep=0.002))).xml)


def test_odd_names_stay_in_their_folder(run: Terminal, tmp_path: Path) -> None:
    name = "--"
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


def test_what_the_engine_refuses_is_named(tmp_path: Path) -> None:
    model = physical_model(laid_out(tmp_path / "p.pag", "root = a; a = atomic(sphere = 0.01)"), 1)
    with pytest.raises(InputError) as caught:
        load(replace(model, xml=model.xml.replace('fullinertia="', 'fullinertia="-')))
    (found,) = caught.value.diagnostics
    assert (found.code, found.hint) == ("BadValue", "give it another shape or mass")
    assert found.position and found.position.column == 11


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


def lines(run: Terminal, *words: object) -> str:
    done = run("build", *words)
    assert done.status == 0, done.err
    return done.out


def again(text: str) -> bool:
    return "up to date" in text


def test_a_package_that_changed_is_built_with(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """One that is installed: its operation, its law, its robot type."""
    write_package(tmp_path, installed=True, name="gluing2")
    monkeypatch.syspath_prepend(tmp_path)
    request.addfinalizer(extensions.cache_clear)
    assert not again(lines(run, PAPER, "-o", tmp_path / "x"))
    for name in ("dab.op", "laws.py", "dabber.xml", "catalogue.toml"):
        assert again(lines(run, PAPER, "-o", tmp_path / "x"))
        (file,) = (tmp_path / "gluing2").rglob(name)
        file.write_text(file.read_text() + "\n")
        assert not again(lines(run, PAPER, "-o", tmp_path / "x")), name


def test_no_binary_lies_beside_a_device_or_upon_the_mjcf(tmp_path: Path) -> None:
    assert beside(Path("/dev/null")) is None
    assert beside(tmp_path) is None
    assert beside(tmp_path / "m.xml") == tmp_path / "m.mjb"
    assert beside(tmp_path / "m.mjb") == tmp_path / "m.mjb.mjb"


LIMITS = ("tracking_error_max_mm", "handoff_gap_max_mm", "weld_residual_max_mm")
"""The figures that a timestep is chosen by."""


def test_it_is_half_of_what_a_good_factory_keeps() -> None:
    assert {QUANTITIES[key].limit for key in LIMITS} == {2e3 * ALLOWED}


def test_what_is_no_timestep_is_told(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "'soon' is not a valid float" in run("run", PAPER, "--timestep", "soon").err
    monkeypatch.setenv("FACTORY_TIMESTEP", "soon")
    told = run("run", PAPER)
    assert told.status == 2
    assert "FACTORY_TIMESTEP: timestep must be a number" in told.err
    assert 'for example timestep = 0.002, or "auto"' in told.err
    with pytest.raises(InputError, match="speed"):
        Settings().with_options({"speed": 1e9, "timestep": AUTO})
    with pytest.raises(ValueError, match="auto"):
        _ = Settings().step


MESHED = """root = a;
a = mate(b, c);
b = atomic(mesh = "wing.stl", pos = (0, 0, 0.05));
c = atomic(box = (0.1, 0.1, 0.05), pos = (0, 0, 0.2))
"""


@pytest.fixture
def product(tmp_path: Path) -> Path:
    """A product with a mesh of its own."""
    import trimesh

    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "wing.stl")
    (tmp_path / "p.pag").write_text(MESHED)
    return tmp_path / "p.pag"


def test_another_factory_toml_is_another_build(run: Terminal, product: Path) -> None:
    """Whatever it says: branches, lines, arms."""
    mjcf = product.parent / "m.xml"
    lines(run, product, "--mjcf", mjcf)
    (product.parent / "factory.toml").write_text("[parallel]\nb = 2\n")
    assert not again(lines(run, product, "--mjcf", mjcf))
    (product.parent / "factory.toml").unlink()
    assert not again(lines(run, product, "--mjcf", mjcf))
