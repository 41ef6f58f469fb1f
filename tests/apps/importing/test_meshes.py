"""Mesh files: what is closed is read as closed, what is nearly closed is mended, and what is broken
is told in sentences of ours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.apps.importing.bodies import FileBody, solids_of
from factory.apps.importing.zipping import zipped
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.support.errors import InputError
from factory.support.meshes.mesh_file import EXPECTED, MeshFile, UnreadableMesh
from factory.support.meshes.mesh_reader import read_mesh
from factory.support.meshes.triangles import is_closed, volume_of
from factory.theory.problem.pag import PAG
from tests.layout_values import table_pag

EDGE = 0.1


def product(folder: Path, name: str, content: bytes | str) -> Product:
    """A product of one part, with this mesh."""
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    pag = table_pag("p", ("p", "atomic", "", {"mesh": name}))
    return product_geometry(PAG(pag.root, pag.nodes, folder=str(folder)))


def cube() -> trimesh.Trimesh:
    return trimesh.creation.box((EDGE, EDGE, EDGE))


def seamed_obj(mesh: trimesh.Trimesh) -> str:
    """An OBJ in which every corner has a texture coordinate and a normal of its own, in materials
    and groups that change from face to face."""
    lines = ["mtllib none.mtl", *(f"v {x} {y} {z}" for x, y, z in mesh.vertices)]
    for number, (face, normal) in enumerate(zip(mesh.faces, mesh.face_normals, strict=True)):
        lines += [f"vt {k / 3} {number / len(mesh.faces)}" for k in range(3)]
        lines += ["vn {} {} {}".format(*normal), f"usemtl m{number % 3}", f"g side{number}"]
        lines += [
            "f "
            + " ".join(f"{v + 1}/{3 * number + k + 1}/{number + 1}" for k, v in enumerate(face))
        ]
    return "\n".join(lines) + "\n"


Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From z upwards to y upwards, as in GLB."""


def seamed_glb(mesh: trimesh.Trimesh) -> bytes:
    """A GLB in which every triangle has its own vertices, with normals and texture coordinates."""
    apart = trimesh.Trimesh(
        mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3), process=False
    )
    uv = np.random.default_rng(0).random((len(apart.vertices), 2))
    apart.visual = trimesh.visual.TextureVisuals(uv, trimesh.visual.material.PBRMaterial())
    apart.apply_transform(Y_UP)
    return bytes(apart.export(file_type="glb", include_normals=True))


SEAMED: dict[str, Callable[[trimesh.Trimesh], bytes | str]] = {
    "m.obj": seamed_obj,
    "m.glb": seamed_glb,
}


@pytest.mark.parametrize("name", SEAMED)
def test_bodies_that_touch_are_kept_apart_behind_seams(tmp_path: Path, name: str) -> None:
    """An L of two boxes that share a corner each: in one OBJ, and as two meshes of a GLB."""
    boxes = [cube(), cube().apply_scale((1, 1, 2))]
    boxes[1].apply_translation((EDGE, 0, EDGE / 2))
    if name == "m.obj":
        content: bytes | str = seamed_obj(trimesh.util.concatenate(boxes))
    else:
        scene = trimesh.Scene()
        for box in boxes:
            single = trimesh.load_scene(
                trimesh.util.wrap_as_stream(seamed_glb(box)), file_type="glb", process=False
            )
            scene.add_geometry(single.to_mesh())
        content = scene.export(file_type="glb", include_normals=True)
    found = product(tmp_path, name, content)
    assert found.warnings == ()
    assert [len(piece) for piece in found.solids["p"].pieces] == [8, 8]
    assert found.mass == pytest.approx(3.0, rel=1e-5)


def to_and_fro() -> trimesh.Trimesh:
    mesh = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=24)
    mesh.faces[::3] = mesh.faces[::3, ::-1]
    return mesh


def inside_out() -> trimesh.Trimesh:
    mesh = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=24)
    mesh.invert()
    return mesh


def with_a_sliver() -> trimesh.Trimesh:
    """A side of a cube is of three triangles, the next one has an edge past their corner."""
    mesh = cube()
    side = np.flatnonzero((mesh.face_normals == (0, 0, 1)).all(axis=1))[0]
    a, b, c = mesh.faces[side]
    points = np.concatenate([mesh.vertices, [(mesh.vertices[a] + mesh.vertices[b]) / 2]])
    faces = np.concatenate([np.delete(mesh.faces, side, axis=0), [[a, 8, c], [8, b, c]]])
    return trimesh.Trimesh(points, faces, process=False)


def cracked() -> trimesh.Trimesh:
    """Every triangle has corners of its own, off by a few millionths of the mesh."""
    mesh = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=24)
    corners = mesh.triangles.reshape(-1, 3)
    corners = corners + np.random.default_rng(1).uniform(-1e-8, 1e-8, corners.shape)
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


def divided_twice() -> trimesh.Trimesh:
    """The rims of a cylinder: 100 segments in its wall, 64 in its ends, four corners in common."""
    wall, ends = (trimesh.creation.cylinder(0.05, 0.1, sections=sections) for sections in (100, 64))
    level = np.abs(wall.face_normals[:, 2]) > 0.5
    wall.update_faces(~level)
    ends.update_faces(np.abs(ends.face_normals[:, 2]) > 0.5)
    return trimesh.util.concatenate([wall, ends])


def two_sided() -> trimesh.Trimesh:
    mesh = cube()
    faces = np.concatenate([mesh.faces, mesh.faces[:, ::-1]])
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


TUBE = trimesh.creation.annulus(0.05, 0.1, 0.1, sections=24).volume
MENDED: tuple[tuple[Callable[[], trimesh.Trimesh], str, float], ...] = (
    (to_and_fro, "had triangles of inconsistent orientation", TUBE),
    (inside_out, "was inside out", TUBE),
    (with_a_sliver, "had slivers or small holes", EDGE**3),
    (cracked, "had cracks", TUBE),
    (two_sided, "had duplicate triangles", EDGE**3),
)


def test_faces_of_a_solid_are_zipped_where_they_divide_an_edge_differently() -> None:
    mesh = divided_twice()
    mesh.merge_vertices()
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    closed = zipped(vertices, faces)
    assert not is_closed(faces) and is_closed(closed)
    assert volume_of(vertices, closed) == pytest.approx(5 * np.sin(np.pi / 50) * 0.05**2)
    (solid,) = solids_of(FileBody("p", MeshFile(((vertices, faces),))))
    assert is_closed(solid.mesh.merged()[1])
    open_box = faces[: len(faces) // 2]
    assert zipped(vertices, open_box) is open_box


@pytest.mark.parametrize(
    ("make", "was", "volume"), MENDED, ids=lambda x: getattr(x, "__name__", "")
)
def test_what_is_nearly_closed_is_mended(
    tmp_path: Path, make: Callable[[], trimesh.Trimesh], was: str, volume: float
) -> None:
    mesh = make()
    content = mesh.copy().apply_transform(Y_UP).export(file_type="glb")
    found = product(tmp_path, "m.glb", content)
    (warning,) = found.warnings
    assert warning.message == f"m.glb {was}; it was repaired" and not warning.hint
    solid = found.solids["p"]
    assert solid.mass == pytest.approx(1000 * volume, rel=1e-4)
    assert solid.mesh is not None
    assert solid.mesh.vertices.min(axis=0) == pytest.approx(mesh.bounds[0], abs=1e-7)
    assert solid.mesh.vertices.max(axis=0) == pytest.approx(mesh.bounds[1], abs=1e-7)


def test_a_cavity_stays_one(tmp_path: Path) -> None:
    """A hollow ball has an inner surface that is turned inwards; from outside in, it is the outer
    one that is wrong."""
    outer, inner = trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.05)
    volume = outer.volume - inner.volume
    inner.invert()
    ball = trimesh.util.concatenate([outer, inner])
    found = product(tmp_path, "m.stl", ball.export(file_type="stl"))
    assert found.warnings == () and found.mass == pytest.approx(1000 * volume, rel=1e-5)
    ball.invert()
    found = product(tmp_path, "m.stl", ball.export(file_type="stl"))
    assert len(found.warnings) == 1 and found.mass == pytest.approx(1000 * volume, rel=1e-5)
    both = trimesh.util.concatenate([cube().apply_translation((0.4, 0, 0)), ball])
    both.apply_scale(2)
    found = product(tmp_path, "m.stl", both.export(file_type="stl"))
    assert found.mass == pytest.approx(8000 * (volume + EDGE**3), rel=1e-5)


FAULTS = (
    ("m.obj", "# nothing\n", f"it is not {EXPECTED['.obj']}"),
    (
        "m.obj",
        "v 0 0 1\nf 1 1\n",
        "line 2 has no face: 'f 1 2 3' takes three vertices or more, by number",
    ),
    ("m.obj", "v 0 0 1\nf 1 1 0\n", "line 2 has a face with a vertex that does not exist: 0"),
    ("m.obj", "v 0 0 1\nf 1 1 7\n", "a face has the vertex 7, but there are 1"),
    ("m.stl", b"\xff" * 90, f"it is not {EXPECTED['.stl']}"),
)


@pytest.mark.parametrize(("name", "content", "why"), FAULTS, ids=range(len(FAULTS)))
def test_what_is_wrong_with_a_file_is_a_sentence(
    tmp_path: Path, name: str, content: str | bytes, why: str
) -> None:
    with pytest.raises(InputError) as caught:
        product(tmp_path, name, content)
    assert [d.message for d in caught.value.diagnostics] == [f"cannot read '{name}': {why}"]


def test_a_vertex_that_is_not_finite_is_told_of_any_format() -> None:
    mesh = cube()
    mesh.vertices[3] = np.nan
    for kind in ("stl", "ply", "glb"):
        with pytest.raises(UnreadableMesh, match="vertices that are not finite"):
            read_mesh(bytes(mesh.export(file_type=kind)), f".{kind}")
