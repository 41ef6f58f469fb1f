"""The convex bodies that collide in a part's place: round a round body, exactly those of a mesh of
several, made by a library for the rest, and kept."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from threading import Barrier, Thread
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold, OpType

from factory.apps.exports.stock import model_files
from factory.engine.mjcf import names
from factory.engine.simulation.modelling import physical_model
from factory.floor.geometry import decomposition
from factory.floor.geometry.glb_reader import UPRIGHT
from factory.floor.geometry.meshes import Mesh, is_closed
from factory.floor.geometry.overlap import drawn
from factory.floor.geometry.pieces import (
    MOST_PIECES,
    ROUND,
    box_piece,
    closed_bodies,
    components,
    cylinder_piece,
    is_convex,
    sphere_piece,
)
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.floor.geometry.touching import bodies
from factory.support.arrays import Array, Indices
from factory.theory.problem.pag import PAG
from tests.examples import plainly_laid_out
from tests.layout_values import table_pag
from tests.work import counted

radii = st.floats(1e-4, 2.0)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "klavins-factory" / "pieces"


def ring(sides: int = 24, inner: float = 0.005, outer: float = 0.01) -> list[trimesh.Trimesh]:
    """A ring as wedges that share their faces."""
    turns = np.linspace(0, 2 * np.pi, sides + 1)
    found = []
    for a, b in pairwise(turns):
        flat = [(r * np.cos(t), r * np.sin(t)) for t in (a, b) for r in (inner, outer)]
        found.append(
            trimesh.convex.convex_hull(np.array([(*p, z) for p in flat for z in (0, 0.01)]))
        )
    return found


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


# --- primitives -----------------------------------------------------------------------------------


def faces_of(points: Array) -> tuple[Array, Array]:
    """Outward normals of a polytope's faces, and how far they are from the origin."""
    hull = trimesh.convex.convex_hull(points)
    return hull.face_normals, np.einsum("ij,ij->i", hull.face_normals, hull.triangles[:, 0])


@given(radii, radii)
def test_a_cylinder_is_inside_its_polytope_and_little_smaller(radius: float, half: float) -> None:
    piece = cylinder_piece(radius, half)
    assert np.abs(piece[:, 2]) == pytest.approx(half)
    reach = np.hypot(piece[:, 0], piece[:, 1])
    assert reach.max() <= radius + max(ROUND, 7.6e-5 * radius)
    rim = piece[: len(piece) // 2, :2]
    middles = (rim + np.roll(rim, 1, axis=0)) / 2
    assert np.hypot(*middles.T) == pytest.approx(radius, rel=1e-12)


@given(radii)
def test_a_sphere_is_inside_its_polytope_and_little_smaller(radius: float) -> None:
    piece = sphere_piece(radius)
    assert np.linalg.norm(piece, axis=1).max() <= radius + max(ROUND, 4.6e-3 * radius)
    _, distance = faces_of(piece / radius)
    assert distance.min() >= 1 - 1e-9


def test_pieces_stand_where_the_part_does() -> None:
    quarter = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
    for shape in ({"box": (0.1, 0.2, 0.3)}, {"cylinder": (0.05, 0.3)}, {"sphere": 0.1}):
        given = {**shape, "quat": quarter, "pos": (1.0, 2.0, 3.0)}
        pag = table_pag("p", ("p", "atomic", "", given))  # type: ignore[arg-type]
        (solid,) = product_geometry(pag).solids.values()
        (piece,) = solid.pieces
        assert piece.min(axis=0) == pytest.approx(solid.low, abs=5e-4)
        assert piece.max(axis=0) == pytest.approx(solid.high, abs=5e-4)
    assert len(box_piece(np.ones(3))) == 8


# --- meshes ---------------------------------------------------------------------------------------


def test_what_is_convex_or_open_has_its_hull(tmp_path: Path) -> None:
    opened = trimesh.creation.annulus(0.05, 0.1, 0.1)
    opened.update_faces(np.arange(len(opened.faces)) > 4)
    for mesh in (trimesh.creation.icosphere(2, 0.1), opened):
        solid = solid_of(tmp_path, mesh)
        assert solid.mesh is not None and solid.mesh.pieces == ()
        assert len(solid.pieces) == 1 and solid.pieces[0] is solid.corners


@pytest.mark.parametrize("kind", ["obj", "ply", "glb"])
def test_wedges_that_touch_are_the_pieces(tmp_path: Path, kind: str) -> None:
    mesh = trimesh.util.concatenate(ring())
    mesh.visual = trimesh.visual.ColorVisuals()
    pos = (0.1, 0.0, 0.0)
    solid = solid_of(tmp_path, mesh, kind, density=1000.0, pos=pos)
    assert len(solid.pieces) == 24
    whole = sum(body.volume for body in ring())
    assert sum(map(hull_volume, solid.pieces)) == pytest.approx(whole, rel=1e-4)
    assert solid.mass == pytest.approx(1000 * whole, rel=1e-5)
    assert solid.centre == pytest.approx([0.1, 0, 0.005], abs=1e-7)
    true = trimesh.creation.annulus(0.005, 0.01, 0.01, sections=256).moment_inertia * 1000
    assert np.diag(solid.inertia) == pytest.approx(np.diag(true), rel=0.05)
    inside = np.concatenate(solid.pieces) - pos
    assert np.hypot(inside[:, 0], inside[:, 1]).min() == pytest.approx(0.005, rel=1e-5)


def test_bodies_apart_are_the_pieces_of_any_file(tmp_path: Path) -> None:
    boxes = [trimesh.creation.box((0.1, 0.1, 0.1)) for _ in range(2)]
    boxes[1].apply_translation((0.2, 0, 0))
    for kind in ("stl", "obj"):
        solid = solid_of(tmp_path, trimesh.util.concatenate(boxes), kind)
        assert [len(piece) for piece in solid.pieces] == [8, 8]
        assert solid.mass == pytest.approx(2.0)


def test_one_body_that_is_not_convex_spoils_it(tmp_path: Path) -> None:
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1)
    block = trimesh.creation.box((0.1, 0.1, 0.1)).apply_translation((0.3, 0, 0))
    solid = solid_of(tmp_path, trimesh.util.concatenate([tube, block]))
    assert solid.mesh is not None and len(solid.mesh.pieces) != 2


def test_too_many_bodies_are_their_hull(tmp_path: Path) -> None:
    one = trimesh.creation.box((0.1, 0.1, 0.1))
    many = [one.copy().apply_translation((0.2 * n, 0, 0)) for n in range(MOST_PIECES + 1)]
    assert len(solid_of(tmp_path, trimesh.util.concatenate(many)).pieces) == 1


def test_closed_is_every_edge_to_and_fro() -> None:
    box = trimesh.creation.box()
    assert is_closed(box.faces) and not is_closed(box.faces[1:])
    assert is_closed(np.concatenate([box.faces, box.faces + 8]))


def test_components_are_numbered_as_their_triangles_come() -> None:
    """Whatever lies between the triangles of one, and in whatever order vertices are."""
    box = trimesh.creation.box()
    faces = np.stack([box.faces + 8, box.faces, box.faces + 20], axis=1).reshape(-1, 3)
    assert components(30, faces).tolist() == [0, 1, 2] * 12
    vertices = np.random.default_rng(0).normal(size=(30, 3))
    vertices[8:16], vertices[:8], vertices[20:28] = box.vertices, box.vertices + 3, box.vertices + 6
    bodies = closed_bodies(vertices, faces)
    assert [body[0].min() for body in bodies] == [-0.5, 2.5, 5.5]
    assert all(np.array_equal(body[1], box.faces) for body in bodies)


def test_very_many_bodies_are_only_counted() -> None:
    corners = np.random.default_rng(0).normal(size=(40_000, 4, 3)).reshape(-1, 3)
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    faces = (tetrahedron + 4 * np.arange(40_000)[:, None, None]).reshape(-1, 3)
    calls, bodies = counted(closed_bodies, corners, faces)
    assert bodies == [] and calls < 1000


# --- bodies that touch ---------------------------------------------------------------------------


def _soup(*bodies: trimesh.Trimesh) -> tuple[Array, Indices]:
    """Bodies as an STL file has them, one vertex at a place."""
    mesh = trimesh.util.concatenate(bodies)
    mesh.merge_vertices()
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _boxes(*cells: tuple[int, int, int]) -> list[trimesh.Trimesh]:
    return [trimesh.creation.box((1, 1, 1)).apply_translation(cell) for cell in cells]


@given(
    st.sets(st.tuples(*[st.integers(0, 2)] * 3), min_size=1, max_size=27),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_boxes_that_share_sides_edges_and_corners_are_told_apart(
    cells: set[tuple[int, int, int]], seed: int
) -> None:
    """Whatever way the whole is turned, and in whatever order its triangles come."""
    rng, boxes = np.random.default_rng(seed), _boxes(*sorted(cells))
    vertices, faces = _soup(*boxes)
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    order = rng.permutation(len(faces))
    number = bodies(vertices @ turn.T, faces[order])
    assert number.max() + 1 == len(cells)
    middles = vertices[faces[order]].mean(axis=1)
    for body in range(len(cells)):
        mine = middles[number == body]
        assert len(mine) == 12 and (np.ptp(mine, axis=0) < 1 + 1e-9).all()
    assert all(is_convex(*body) for body in closed_bodies(vertices @ turn.T, faces[order]))


def test_bodies_of_a_file_without_common_vertices_are_exact(tmp_path: Path) -> None:
    """An STL file writes each triangle's corners by themselves."""
    wedges = trimesh.util.concatenate(ring())
    solid = solid_of(tmp_path, wedges, "stl")
    assert len(solid.pieces) == 24
    assert sum(map(hull_volume, solid.pieces)) == pytest.approx(wedges.volume, rel=1e-5)


def test_a_body_with_corners_inwards_stays_one() -> None:
    """Edges of two triangles join them, whatever their angle."""
    tube = trimesh.creation.annulus(0.5, 1, 1, sections=12)
    beside = trimesh.creation.box((1, 1, 1)).apply_translation((5, 0, 0))
    vertices, faces = _soup(tube, beside)
    number = bodies(vertices, faces)
    assert np.bincount(number).tolist() == [len(tube.faces), 12]


# --- decomposition --------------------------------------------------------------------------------


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


def test_each_body_is_decomposed_by_itself(tmp_path: Path, library: list[int]) -> None:
    """What touches would be a mesh that intersects itself, which the library puts on a grid."""
    tube = tapered(0.05, 0.1, 0.1)
    top = tapered(0.05, 0.1, 0.2).apply_translation((0, 0, 0.15))
    foot = trimesh.creation.box((0.1, 0.1, 0.1)).apply_translation((1, 0, 0))
    assert len(solid_of(tmp_path, trimesh.util.concatenate([tube, top, foot])).pieces) == 5
    assert len(library) == 1 + 1  # two tubes, and the box as it is


def turned(mesh: trimesh.Trimesh, seed: int) -> trimesh.Trimesh:
    """A copy that is moved, and turned about any axis."""
    way = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    way[:3, 3] = (0.3, -0.2, 0.1)
    return mesh.copy().apply_transform(way)


@pytest.mark.parametrize("kind", ["obj", "stl"])
def test_a_shape_is_decomposed_once_wherever_it_is(
    tmp_path: Path, library: list[int], cache: Path, kind: str
) -> None:
    """In one product, and in the next; its bodies move with it. A mirror image is another shape."""
    arm = trimesh.creation.annulus(0.05, 0.1, 0.1)
    arm.vertices[:, 0] += 0.3 * arm.vertices[:, 2] + 0.7 * np.maximum(arm.vertices[:, 1], 0.02)
    first = solid_of(tmp_path, arm, kind)
    for seed in range(3):
        other = turned(arm, seed)
        found = solid_of(tmp_path, other, kind)
        assert len(library) == 1
        assert len(found.pieces) == len(first.pieces) == 2
        for one, two in zip(first.pieces, found.pieces, strict=True):
            gap = np.linalg.norm(two - other.vertices.mean(axis=0), axis=1)
            assert gap == pytest.approx(
                np.linalg.norm(one - arm.vertices.mean(axis=0), axis=1), abs=1e-6
            )
    mirrored = arm.copy().apply_transform(np.diag([-1.0, 1, 1, 1]))
    solid_of(tmp_path, mirrored, kind)
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


def test_bodies_that_reach_out_of_their_mesh_count_where_they_collide(
    tmp_path: Path, library: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_coacd(mesh: object, **_: object) -> list[tuple[Array, Array]]:
        low, high = mesh[0].min(axis=0), mesh[0].max(axis=0)  # type: ignore[index]
        boxes = [trimesh.creation.box(high - low + 0.002) for _ in range(2)]
        return [(np.asarray(b.vertices), np.asarray(b.faces)) for b in boxes]

    monkeypatch.setattr(sys.modules["coacd"], "run_coacd", run_coacd)
    tube = tapered(0.05, 0.1, 0.1)
    tube.export(tmp_path / "wide.obj")
    pag = table_pag("p", ("p", "atomic", "", {"mesh": "wide.obj"}))
    product = product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path)))
    assert np.ptp([product.low, product.high], axis=0) == pytest.approx([0.202, 0.202, 0.102])
    (warning,) = product.warnings
    assert "reach 1 mm too far" in warning.message


def test_nearly_convex_meshes_are_not_decomposed(tmp_path: Path, library: list[int]) -> None:
    bump = trimesh.creation.icosphere(3, 0.1)
    bump.vertices[0] *= 0.97
    assert bump.volume < bump.convex_hull.volume
    assert len(solid_of(tmp_path, bump).pieces) == 1 and not library


def bored(body: Manifold, depth: float, *places: tuple[float, float]) -> trimesh.Trimesh:
    """A body with round holes of 8 mm from its top, at z = 0, to a depth [m]."""
    hole = Manifold.cylinder(2 * depth, 0.004, -1.0, 24, True)
    for x, y in places:
        body = body - hole.translate((x, y, 0.0))
    mesh = body.to_mesh64()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


PLATE = Manifold.cube((0.2, 0.15, 0.01), True).translate((0.0, 0.0, -0.005))
CORNERS = [(x, y) for x in (-0.08, 0.08) for y in (-0.05, 0.05)]


@pytest.mark.parametrize("kind", ["obj", "stl"])
def test_a_plate_with_holes_is_decomposed_exactly(tmp_path: Path, kind: str) -> None:
    """However small the holes are, also if it is turned about any axis: slivers are omitted, and
    none of its bodies closes a hole. With a tapered hole, it is no body of prisms."""
    mesh = bored(PLATE, 0.02, *CORNERS)
    assert mesh.volume > 0.98 * mesh.convex_hull.volume
    for plate in (mesh, turned(mesh, 1)):
        solid = solid_of(tmp_path, plate, kind)
        assert sum(hull_volume(p) for p in solid.pieces) == pytest.approx(mesh.volume, rel=1e-3)
        bodies = Manifold.batch_boolean(list(map(Manifold.hull_points, solid.pieces)), OpType.Add)
        assert (bodies - drawn(solid)).volume() < 1e-6 * mesh.volume
    cone = Manifold.cylinder(0.02, 0.001, 0.01, 24, True)
    assert len(solid_of(tmp_path, bored(PLATE - cone, 0.02), kind).pieces) == 1


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


def test_a_rod_may_not_be_as_coarse_as_it_is_thick(
    tmp_path: Path, library: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A share of its length would be half of its thickness."""
    given: list[float] = []
    cut = sys.modules["coacd"].run_coacd

    def run_coacd(mesh: object, threshold: float, **_: object) -> list[tuple[Array, Array]]:
        given.append(threshold)
        return cut(mesh)  # type: ignore[no-any-return]

    monkeypatch.setattr(sys.modules["coacd"], "run_coacd", run_coacd)
    for height in (0.1, 0.6, 2.0):
        solid_of(tmp_path, tapered(0.05, 0.1, height))
    assert given == pytest.approx([0.05, 0.1 / 3, 0.02], rel=0.01)


def test_a_shallow_groove_is_cut_finer(
    tmp_path: Path, library: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the usual share would leave as one body, its hull."""
    given: list[float] = []
    cut = sys.modules["coacd"].run_coacd

    def run_coacd(mesh: object, threshold: float, **_: object) -> list[tuple[Array, Array]]:
        given.append(threshold)
        return cut(mesh)[: 2 if threshold < 0.03 else 1]  # type: ignore[no-any-return]

    monkeypatch.setattr(sys.modules["coacd"], "run_coacd", run_coacd)
    assert len(solid_of(tmp_path, tapered(0.05, 0.1, 0.1)).pieces) == 2
    assert given == [0.05, 0.02]


def test_meshes_are_decomposed_side_by_side(
    tmp_path: Path, library: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Either of two calls of the library ends only once the other has begun; each mesh gets its
    own pieces, and keeps its name."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    both, cut = Barrier(2), sys.modules["coacd"].run_coacd

    def run_coacd(mesh: object, **given: object) -> list[tuple[Array, Array]]:
        both.wait(10)
        return cut(mesh, **given)  # type: ignore[no-any-return]

    monkeypatch.setattr(sys.modules["coacd"], "run_coacd", run_coacd)
    parts = []
    for number, size in enumerate((0.1, 0.2)):
        tapered(size / 2, size, size).export(tmp_path / f"{number}.obj")
        parts += [(f"p{number}{k}", "atomic", "", {"mesh": f"{number}.obj"}) for k in range(2)]
    pag = table_pag("s", ("s", "mate", "p00 p10 p01 p11", {}), *parts)  # type: ignore[arg-type]
    solids = product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path))).solids
    assert len(library) == 2
    for number, size in enumerate((0.1, 0.2)):
        for k in range(2):
            solid = solids[f"p{number}{k}"]
            assert solid.mesh is not None and solid.mesh.name == f"m{number}"
            assert [np.ptp(p, axis=0).max() for p in solid.pieces] == pytest.approx([2 * size] * 2)


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
        found.append(decomposition._run_coacd(Mesh("m", mesh.vertices, mesh.faces)))
    assert all(np.array_equal(a, b) for a, b in zip(found[0], found[2], strict=True))


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted by Linux")
def test_the_real_library_starts_no_threads() -> None:
    """A thread that calls it is the only one more, though OpenMP keeps those that it starts."""
    pytest.importorskip("coacd")
    tube = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=16)
    mesh, found = Mesh("m", tube.vertices, tube.faces), list[str]()
    decomposition._run_coacd(mesh)
    before = os.listdir("/proc/self/task")

    def do() -> None:
        decomposition._run_coacd(mesh)
        found.extend(os.listdir("/proc/self/task"))

    thread = Thread(target=do)
    thread.start()
    thread.join()
    assert len(found) == len(before) + 1


# --- in the engine --------------------------------------------------------------------------------

PEG = """root = s; s = mate(ring, peg);
ring = atomic ( mesh = "ring.obj", rgba = (1, 0, 0, 1) );
peg = atomic ( cylinder = (0.0048, 0.03) )"""


def test_pieces_collide_and_are_not_drawn(tmp_path: Path) -> None:
    trimesh.util.concatenate(ring()).export(tmp_path / "ring.obj")
    (tmp_path / "p.pag").write_text(PEG)
    layout = plainly_laid_out(tmp_path / "p.pag")
    model = physical_model(layout, 2)
    for path, content in model_files(model, tmp_path / "m.xml").items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    for number in (1, 2):
        name = names.part("ring", number)
        body = m.body(name)
        geoms = range(body.geomadr[0], body.geomadr[0] + body.geomnum[0])
        assert len(geoms) == 25 and body.mass[0] == pytest.approx(
            layout.product.solids["ring"].mass
        )
        drawn, *pieces = geoms
        assert m.geom(drawn).name == name and m.geom(name).group[0] == 1
        assert m.geom_contype[drawn] == m.geom_conaffinity[drawn] == 0
        assert (m.geom_group[pieces] == 3).all()
        assert ((m.geom_contype[pieces] != 0) == (number == 1)).all()
        assert m.geom(names.piece(name, 3)).id == pieces[2]
    assert m.geom(names.part("peg", 1)).group[0] == 0


def test_a_peg_fits_its_hole_in_the_engine(tmp_path: Path) -> None:
    """What the engine makes of the pieces: a bore as wide as its sides, not as a hull has it."""
    trimesh.util.concatenate(ring()).export(tmp_path / "ring.obj")
    (tmp_path / "p.pag").write_text(PEG)
    layout = plainly_laid_out(tmp_path / "p.pag")
    files = {Path(k).name: v for k, v in physical_model(layout, 1).files.items()}
    pieces = sorted(name for name in files if name.count(".") == 2)
    assets = "".join(f'<mesh name="{n}" file="{n}"/>' for n in pieces)
    geoms = "".join(f'<geom type="mesh" mesh="{n}"/>' for n in pieces)
    for radius, touches in ((0.00494, False), (0.00497, True)):
        xml = f"""<mujoco><asset>{assets}</asset><worldbody>{geoms}
            <body><freejoint/><geom type="cylinder" size="{radius} 0.03"/></body>
            </worldbody></mujoco>"""
        m = mujoco.MjModel.from_xml_string(xml, files)
        d = mujoco.MjData(m)
        mujoco.mj_forward(m, d)
        assert bool(d.ncon) == touches
