"""The convex bodies that collide in a part's place: round a round body, exactly those of a mesh of
several, made by a library for the rest, and kept."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.apps.monitor import beside
from factory.engine.mjcf.masks import robot_code
from factory.engine.simulation.mujoco.fusing import Fusion
from factory.engine.simulation.mujoco.holdings import Holdings
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry import decomposition
from factory.floor.geometry.meshes import Mesh
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.support.arrays import Array
from factory.support.meshes.glb_reader import UPRIGHT
from factory.theory.problem.pag import PAG
from tests.layout_values import table_pag
from tests.simulation_values import layout_of, ready


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "klavins-factory" / "pieces"


def solid_of(folder: Path, mesh: trimesh.Trimesh, kind: str = "obj", **given: object) -> Solid:
    """The solid of a mesh that stands upright; in a GLB file y is up."""
    if kind == "glb":
        mesh = mesh.copy().apply_transform(np.linalg.inv(UPRIGHT))
    mesh.export(folder / f"m.{kind}")
    parameters = {"mesh": f"m.{kind}", **given}
    pag = table_pag("p", ("p", "atomic", "", parameters))  # type: ignore[arg-type]
    return product_geometry(PAG(pag.root, pag.nodes, folder=str(folder))).solids["p"]


def hull_volume(points: Array) -> float:
    return float(trimesh.convex.convex_hull(points).volume)


def test_one_body_that_is_not_convex_spoils_it(tmp_path: Path) -> None:
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1)
    block = trimesh.creation.box((0.1, 0.1, 0.1)).apply_translation((0.3, 0, 0))
    solid = solid_of(tmp_path, trimesh.util.concatenate([tube, block]))
    assert solid.mesh is not None and len(solid.mesh.pieces) != 2


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """A library in CoACD's place, which cuts a mesh's box in two, and the calls made."""
    calls: list[int] = []

    def run_coacd(mesh: object, **_: object) -> list[tuple[Array, Array]]:
        calls.append(1)
        ((low, high),) = [(mesh[0].min(axis=0), mesh[0].max(axis=0))]  # type: ignore[index]
        boxes = [trimesh.creation.box((high - low) / (2, 1, 1)) for _ in range(2)]
        sliver = trimesh.creation.box((1e-9, 1e-3, 1e-3))
        return [(np.asarray(b.vertices), np.asarray(b.faces)) for b in (*boxes, sliver)]

    fake = SimpleNamespace(
        Mesh=lambda *arrays: arrays, run_coacd=run_coacd, set_log_level=lambda level: None
    )
    monkeypatch.setitem(sys.modules, "coacd", fake)
    monkeypatch.setattr(decomposition, "release", lambda name: "1.0.0")
    yield calls


def tapered(inner: float, outer: float, height: float) -> trimesh.Trimesh:
    """A tube that is narrower at its upper end: no body of prisms."""
    tube = trimesh.creation.annulus(inner, outer, height)
    tube.vertices[tube.vertices[:, 2] > 0, :2] *= 0.95
    return tube


def test_what_else_is_closed_is_decomposed_once(
    tmp_path: Path, library: list[int], cache: Path
) -> None:
    tube = tapered(0.05, 0.1, 0.1)
    first = solid_of(tmp_path, tube)
    shutil.rmtree(cache.parent / "meshes")
    again = solid_of(tmp_path, tube)
    assert len(first.pieces) == len(again.pieces) == 2 and len(library) == 1
    assert all(np.array_equal(a, b) for a, b in zip(first.pieces, again.pieces, strict=True))
    assert first.mass == pytest.approx(1000 * tube.volume)  # that of the mesh, not of the pieces
    assert len(list(cache.iterdir())) == 1


def test_a_library_that_fails_leaves_the_hull(
    tmp_path: Path, library: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["coacd"], "run_coacd", lambda *_, **__: 1 / 0)
    assert len(solid_of(tmp_path, tapered(0.05, 0.1, 0.1)).pieces) == 1


def turned(mesh: trimesh.Trimesh, seed: int) -> trimesh.Trimesh:
    """A copy that is moved, and turned about any axis."""
    way = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    way[:3, 3] = (0.3, -0.2, 0.1)
    return mesh.copy().apply_transform(way)


def test_a_shape_is_decomposed_once_wherever_it_is(
    tmp_path: Path, library: list[int], cache: Path
) -> None:
    """In one product, and in the next; its bodies move with it. A mirror image is another shape."""
    arm = trimesh.creation.annulus(0.05, 0.1, 0.1)
    arm.vertices[:, 0] += 0.3 * arm.vertices[:, 2] + 0.7 * np.maximum(arm.vertices[:, 1], 0.02)
    first = solid_of(tmp_path, arm, "stl")
    for seed in range(3):
        other = turned(arm, seed)
        found = solid_of(tmp_path, other, "stl")
        assert len(library) == 1
        assert len(found.pieces) == len(first.pieces) == 2
        for one, two in zip(first.pieces, found.pieces, strict=True):
            gap = np.linalg.norm(two - other.vertices.mean(axis=0), axis=1)
            assert gap == pytest.approx(
                np.linalg.norm(one - arm.vertices.mean(axis=0), axis=1), abs=1e-6
            )
    mirrored = arm.copy().apply_transform(np.diag([-1.0, 1, 1, 1]))
    solid_of(tmp_path, mirrored, "stl")
    assert len(library) == 2


def test_copies_in_one_product_are_decomposed_once(
    tmp_path: Path, library: list[int], cache: Path
) -> None:
    tube = tapered(0.05, 0.1, 0.1)
    parts = []
    for number in range(4):
        turned(tube, number).export(tmp_path / f"{number}.obj")
        parts.append((f"p{number}", "atomic", "", {"mesh": f"{number}.obj"}))
    pag = table_pag("s", ("s", "mate", "p0 p1 p2 p3", {}), *parts)  # type: ignore[arg-type]
    product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path)))
    assert len(library) == 1


def test_a_body_is_decomposed_in_the_frame_of_its_own_sides() -> None:
    """However it is turned, its sides lie along the axes; as drawn where some do already."""
    ell = trimesh.creation.box((4, 1, 1)).union(
        trimesh.creation.box((1, 3, 1)).apply_translation((1.5, 1, 0))
    )
    assert (decomposition.own_axes(Mesh("m", ell.vertices, ell.faces)) == np.eye(3)).all()
    for seed in range(5):
        mesh = turned(ell, seed)
        axes = decomposition.own_axes(Mesh("m", mesh.vertices, mesh.faces))
        assert np.linalg.det(axes) == pytest.approx(1)
        normals = mesh.face_normals @ axes.T
        assert np.abs(normals).max(axis=1) == pytest.approx(1)


def bored(body: Manifold, depth: float, *places: tuple[float, float]) -> trimesh.Trimesh:
    """A body with round holes of 8 mm from its top, at z = 0, to a depth [m]."""
    hole = Manifold.cylinder(2 * depth, 0.004, -1.0, 24, True)
    for x, y in places:
        body = body - hole.translate((x, y, 0.0))
    mesh = body.to_mesh64()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


PLATE = Manifold.cube((0.2, 0.15, 0.01), True).translate((0.0, 0.0, -0.005))


def test_a_hole_that_another_part_stands_in_is_open(tmp_path: Path) -> None:
    """A blind hole is closed by a hull unless a pin stands in it; the other part of that file is
    decomposed too, and a plate on which something only stands is not."""
    mesh = bored(PLATE, 0.005, (0.05, 0.02))
    mesh.export(tmp_path / "m.obj")
    places = {"p": (0, 0, 0), "q": (0, 0, 1)}
    plates = [(n, "atomic", "", {"mesh": "m.obj", "pos": at}) for n, at in places.items()]
    pin = ("pin", "atomic", "", {"cylinder": (0.004, 0.02), "pos": (0.05, 0.02, 0.005)})
    foot = ("pin", "atomic", "", {"cylinder": (0.004, 0.02), "pos": (-0.05, 0.02, 0.01)})
    for part, count in ((foot, {1}), (pin, {37})):
        pag = table_pag("s", ("s", "mate", "p q pin", {}), *plates, part)  # type: ignore[arg-type]
        solids = product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path))).solids
        assert {len(solids[label].pieces) for label in "pq"} == count


@pytest.mark.parametrize("scale", [1e-3, 1e-1, 10.0])
@pytest.mark.parametrize("flat", [(1, 1, 0), (1, 0, 0), (0, 0, 0), (1, 1, 1e-9)])
def test_flat_bodies_are_left_out(
    tmp_path: Path, flat: tuple[float, float, float], scale: float
) -> None:
    """A sheet with two sides, a line, a point, a film round two boxes of 0.1 m in an L: what is
    left has its own box, and collides. Triangles without an area are not worth a word."""
    boxes = [trimesh.creation.box((0.1, 0.1, h)) for h in (0.1, 0.3)]
    boxes[1].apply_translation((0.2, 0, 0.1))
    sheet = trimesh.creation.box((1, 1, 1)).apply_transform(np.diag([*flat, 1]))
    sheet.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3)))
    trimesh.util.concatenate([sheet, *boxes]).export(tmp_path / "m.obj")
    part = ("p", "atomic", "", {"mesh": "m.obj", "scale": scale})
    pag = table_pag("p", part)  # type: ignore[arg-type]
    product = product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path)))
    assert ("flat bodies" in str(product.warnings)) == (flat[1] == 1)
    assert np.ptp([product.low, product.high], axis=0) == pytest.approx(
        scale * np.array([0.3, 0.1, 0.3]), rel=1e-6
    )
    assert [len(piece) for piece in product.solids["p"].pieces] == [8, 8]


def test_the_library_is_loaded_with_one_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With more, its bodies come in the order in which threads happen to end."""
    (tmp_path / "coacd.py").write_text(
        "import os\nseen = os.environ['OMP_NUM_THREADS']\nset_log_level = print"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "coacd", sys)
    del sys.modules["coacd"]  # and what is loaded in its place goes after the test
    for before in ("7", None):
        if before is None:
            monkeypatch.delenv("OMP_NUM_THREADS")
        else:
            monkeypatch.setenv("OMP_NUM_THREADS", before)
        assert decomposition._library().seen == "1"
        assert os.environ.get("OMP_NUM_THREADS") == before


def test_the_real_library(tmp_path: Path) -> None:
    pytest.importorskip("coacd")
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=16)
    pieces = solid_of(tmp_path, tube).pieces
    assert len(pieces) > 3
    assert sum(map(hull_volume, pieces)) == pytest.approx(tube.volume, rel=0.1)


def test_the_real_library_gives_the_same_bodies_again(tmp_path: Path, cache: Path) -> None:
    """Whatever the thread did before."""
    pytest.importorskip("coacd")
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=16)
    other = trimesh.creation.annulus(0.02, 0.1, 0.05, sections=10)
    found = []
    for mesh in (tube, other, tube):
        found.append(decomposition._by_coacd(Mesh("m", mesh.vertices, mesh.faces)))
    assert all(np.array_equal(a, b) for a, b in zip(found[0], found[2], strict=True))


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted by Linux")
def test_the_real_library_starts_no_threads() -> None:
    """A thread that calls it is the only one more, though OpenMP keeps those that it starts."""
    pytest.importorskip("coacd")
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=16)
    mesh, found = Mesh("m", tube.vertices, tube.faces), list[str]()
    decomposition._by_coacd(mesh)
    before = os.listdir("/proc/self/task")

    def do() -> None:
        decomposition._by_coacd(mesh)
        found.extend(os.listdir("/proc/self/task"))

    thread = Thread(target=do)
    thread.start()
    thread.join()
    assert len(found) == len(before) + 1


def test_the_monitor_catches_a_body_made_of_another_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the product appears in the output robot's hands, but one input stays there."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2, fuse=True))
    parts, put_away = simulation.physical.parts, Holdings.put_away
    kept: list[str] = []

    def faulty(self: Holdings, bodies: Iterable[int]) -> None:
        bodies = [*bodies]
        labels = [parts.holdings.of(body).label for body in bodies]
        put_away(self, bodies)
        if "part1" in labels and not kept:
            kept.append("part1")
            robot = simulation.layout.factory.by_label["sub1"].carrier
            grip = parts.holdings.weld[robot_code(robot), "part1"]
            parts.welds.open([parts.holdings.parking[parts.holdings.free["part1"][0]][0]])
            parts.welds.close({grip: int(simulation.physical.m.eq_obj2id[grip])})

    monkeypatch.setattr(Holdings, "put_away", faulty)
    monitor = beside(simulation)
    simulation.run([monitor.observe], max_time=20)
    assert kept and not monitor.report().refines_net


def test_a_misfit_is_part_of_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: parts are 3 mm out of place when they become one body."""
    misfits = Fusion.misfits
    monkeypatch.setattr(Fusion, "misfits", lambda self, groups: misfits(self, groups) + 3e-3)
    simulation = ready("paper", fuse=True, units=1)
    run = simulation.run()
    assert run.physics is not None
    assert run.physics.product_error_max_mm == pytest.approx(3.0, abs=0.01)
