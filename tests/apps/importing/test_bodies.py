"""Files of bodies: what is noted of them, how fine triangles are, how large they may be."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.apps.importing import scene_file, threemf_file
from factory.apps.importing.ldraw.shapes import mesh_of
from factory.apps.importing.loose import bodies_in
from factory.apps.importing.scene_file import COARSE, FINE, Y_UP, read_scene, read_step
from factory.support.meshes.glb_reader import GlbBody
from factory.support.meshes.mesh_file import UnreadableMesh


def scene(form: str) -> bytes:
    """Two boxes beside each other."""
    made = trimesh.Scene()
    for x in (0, 2):
        made.add_geometry(
            trimesh.creation.box(), transform=np.diag([1, 1, 1, 1]) + x * np.eye(4, k=3)
        )
    return bytes(made.export(file_type=form))


def test_only_of_a_glb_file_it_is_noted_that_y_is_up() -> None:
    assert Y_UP in read_scene(scene("glb"), ".glb").notes
    assert Y_UP not in read_scene(scene("3mf"), ".3mf").notes


def test_notes_on_files_of_a_folder_are_told(tmp_path: Path) -> None:
    (tmp_path / "pair.glb").write_bytes(scene("glb"))
    (tmp_path / "box.glb").write_bytes(trimesh.creation.box().export(file_type="glb"))
    notes = bodies_in(tmp_path).notes
    assert "pair.glb has 2 bodies: one part, as each file of a folder" in notes


def box(size: float) -> GlbBody:
    """A body whose box has this longest edge [m]."""
    made = trimesh.creation.box((size, size / 2, size / 2))
    return GlbBody(("box",), ((np.array(made.vertices), np.array(made.faces)),), (None,))


POINT = b"ISO-10303-21 SI_UNIT(.MILLI.,.METRE.) CARTESIAN_POINT('',(0.,50.,-9.))"


@pytest.mark.parametrize(
    ("content", "millimetres", "lost", "deflections", "steps"),
    [
        (b"ISO-10303-21", (50, 1500), {}, [FINE, COARSE], [COARSE, FINE]),
        (b"ISO-10303-21", (50, 290), {}, [FINE, FINE], [COARSE, FINE]),
        (b"ISO-10303-21", (50, 310), {}, [FINE, 0.03], [COARSE, FINE, 0.03]),
        (b"ISO-10303-21", (50, 1500), {FINE: 1}, [FINE], [COARSE, FINE]),
        (POINT, (50, 290), {}, [FINE, FINE], [FINE]),
        (POINT, (50, 310), {}, [FINE, 0.03], [FINE, COARSE, 0.03]),
    ],
)
def test_triangles_of_a_step_file_are_as_fine_as_each_part_needs(
    content, millimetres, lost, deflections, steps, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All are as fine as the finest where other steps show other parts. The points of a file say
    whether all are likely to be read finely, and no more than that."""
    made: dict[float, list[GlbBody]] = {}

    def triangles(source: Path, deflection: float) -> list[GlbBody]:
        bodies = [box(length / 1e3) for length in millimetres][lost.get(deflection, 0) :]
        return made.setdefault(deflection, bodies)

    monkeypatch.setattr(scene_file, "optional", lambda *words: None)
    monkeypatch.setattr(scene_file, "_triangles", triangles)
    bodies = read_step(content)
    of = [next(d for d in made for b in made[d] if b.bodies is body.bodies) for body in bodies]
    assert of == deflections
    assert (next(iter(made)), {*made}) == (steps[0], {*steps})


def test_models_of_a_3mf_file_may_be_as_large_as_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    content = scene("3mf")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(i.file_size for i in archive.infolist() if i.filename.endswith(".model"))
    monkeypatch.setattr(threemf_file, "MESH", size)
    assert len(threemf_file.read_3mf(content)[0]) == 2
    monkeypatch.setattr(threemf_file, "MESH", size - 1)
    with pytest.raises(UnreadableMesh, match="it unpacks to more than"):
        threemf_file.read_3mf(content)


def test_triangles_of_ldraw_parts_that_are_lines_are_left_out() -> None:
    faces = [[(0, 0, 0), (9, 0, 0), (0, 9, 0)], [(0, 0, 0), (9, 0, 0), (9, 0, 0)]]
    mesh = mesh_of(np.array(faces, float), np.eye(3))
    assert mesh is not None and mesh.count(b"\nf ") == 1
    assert mesh_of(np.array(faces[1:], float), np.eye(3)) is None
