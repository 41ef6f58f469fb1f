"""Solids: extents, mass and inertia against trimesh; meshes that the engine could not use. Solids
as drawn: what two have in common, by how much, and what one sweeps."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.floor.geometry.limits import METRES
from factory.floor.geometry.meshes import MOST_FACES, usable
from factory.floor.geometry.overlap import MODULES, is_seen_near, may_share
from factory.floor.geometry.overlapping import Overlapping
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.floor.layout.hands.surfaces import BLOCK, Surfaces
from factory.support.errors import InputError
from factory.theory.problem.pag import PAG, Value
from tests.layout_values import table_pag
from tests.paths import ROOT


def from_mesh(folder: Path, mesh: trimesh.Trimesh | str, **given: Value) -> Product:
    """A product of one part, whose mesh is written to a file first."""
    if isinstance(mesh, str):
        (folder / "m.obj").write_text(mesh)
    else:
        mesh.export(folder / "m.obj")
    pag = table_pag("p", ("p", "atomic", "", {"mesh": "m.obj", **given}))
    return product_geometry(PAG(pag.root, pag.nodes, folder=str(folder)))


@pytest.mark.parametrize("side", [(0, 1), (0, -1), (1, 1), (2, 1), (2, -1)])
def test_lines_meet_the_outermost_of_many_boxes(side: tuple[int, int]) -> None:
    """More boxes than are compared at a time; against each box by itself."""
    rng = np.random.default_rng(7)
    size, middle = rng.uniform(0.02, 0.1, (3 * BLOCK, 3)), rng.uniform(-0.3, 0.3, (3 * BLOCK, 3))
    rows = [
        (f"p{n}", "atomic", "", {"box": tuple(s), "pos": tuple(p)})
        for n, (s, p) in enumerate(zip(size.tolist(), middle.tolist(), strict=True))
    ]
    whole = "s", "mate", " ".join(label for label, *_ in rows), {}
    surfaces = Surfaces(product_geometry(table_pag("s", whole, *rows)))
    points, labels, (axis, way) = rng.uniform(-0.4, 0.4, (500, 3)), [*surfaces.bodies], side
    across = [a for a in range(3) if a != axis]
    low, high = surfaces.boxes(labels).swapaxes(0, 1)
    at = points[:, None, across]
    over = (at >= low[:, across]) & (at <= high[:, across])
    ends = np.where(over.all(axis=2), way * (high if way > 0 else low)[:, axis], -np.inf)
    found = surfaces.outermost(labels, points, side)
    assert np.array_equal(found, ends.max(axis=1)) and len(labels) == 3 * BLOCK


def test_a_mesh_file_scaled_turned_and_placed(tmp_path: Path) -> None:
    body = trimesh.creation.box((100, 40, 20))
    quat = (0.5**0.5, 0.0, 0.0, 0.5**0.5)  # a quarter turn about z
    found = from_mesh(tmp_path, body, scale=0.001, quat=quat, pos=(1.0, 0.0, 0.0), density=500.0)
    solid = found.solids["p"]
    assert solid.high - solid.low == pytest.approx([0.04, 0.1, 0.02])
    assert solid.centre == pytest.approx([1, 0, 0], abs=1e-12)
    assert solid.mass == pytest.approx(0.04)
    assert found.warnings == ()


FLAT = {"level": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]}


@pytest.mark.parametrize("name", FLAT)
def test_a_flat_mesh_becomes_a_box(tmp_path: Path, name: str) -> None:
    corners = np.array(FLAT[name], float)
    sheet = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    found = from_mesh(tmp_path, sheet)
    (warning,) = found.warnings
    assert warning.code == "BadMesh" and warning.message == "m.obj is flat; its box is used instead"
    solid = found.solids["p"]
    assert (
        solid.mesh is not None and trimesh.Trimesh(solid.mesh.vertices, solid.mesh.faces).is_volume
    )
    thick = 2e-3 * 0.15
    assert (solid.low <= corners.min(axis=0) + 1e-9).all()
    assert (solid.high >= corners.max(axis=0) - 1e-9).all()
    if name != "askew":
        assert (solid.high - solid.low <= np.ptp(corners, axis=0) + 2 * thick).all()
    assert solid.mass < 0.02


def test_a_huge_mesh_becomes_its_hull() -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 300)] * 2), axis=-1).reshape(-1, 2)
    bumps = np.column_stack([grid, 0.1 * np.sin(9 * grid[:, 0]) * np.cos(7 * grid[:, 1])])
    n = np.arange(299)[:, None] * 300 + np.arange(299)[None, :]
    n = n.ravel()
    faces = np.concatenate(
        [np.stack([n, n + 1, n + 300], 1), np.stack([n + 1, n + 301, n + 300], 1)]
    )
    mesh, trouble = usable("m", bumps, faces)
    assert trouble is not None
    assert trouble.text == f"has {len(faces)} triangles; its convex hull is used instead"
    assert len(mesh.faces) <= MOST_FACES
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx(np.ptp(bumps, axis=0), rel=0.01)


def test_a_broken_file_is_an_error_at_its_part(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        from_mesh(tmp_path, "v 1 2\nf 1 2 3\n")
    (found,) = caught.value.diagnostics
    assert found.code == "BadMesh" and found.message.startswith("cannot read 'm.obj': line 1 ")


def test_only_a_mesh_is_suspected_of_millimetres(tmp_path: Path) -> None:
    """And only one that is too large."""
    for edge, advice in ((20.0, "write unit = mm;"), (0.002, f"{METRES}: check")):
        (found,) = from_mesh(tmp_path, trimesh.creation.box((edge, edge, edge))).warnings
        assert advice in found.hint


def test_an_overlap_that_is_all_facets_is_said_to_be_and_may_be_allowed() -> None:
    for sagitta, is_facets in ((1e-4, False), (2e-4, True), (3e-4, True)):
        fault = Overlapping("peg", "hole", 2e-4, sagitta).fault(())
        assert fault is not None
        assert ("may be their facets" in fault.message) == is_facets
        assert (fault.hint or "").endswith(f"peg:hole:{1e3 * sagitta:g}mm") == is_facets


@pytest.mark.parametrize(
    ("up", "shares", "near"), [(1.0, False, True), (1.01, False, False), (0.99, True, False)]
)
def test_plates_that_lie_on_each_other_share_nothing_and_are_near(up, shares, near) -> None:
    plate = Manifold.cube((3.0, 3.0, 1.0)).refine(4)
    other = plate.translate((0.3, 0.2, up))
    assert (may_share(plate, other), is_seen_near(plate, other)) == (shares, near)
    assert is_seen_near(plate, other, 0.02) == (up >= 1) or shares


def test_what_is_kept_of_shapes_depends_on_all_modules_that_compute_it() -> None:
    code = (
        "import sys, factory.floor.geometry.product\n"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('factory.')))"
    )
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    folders = {Path(name).parent for name in names.stdout.split()}
    theory = {folder for folder in folders if "theory" in folder.parts}
    assert folders - theory - {ROOT / "factory", ROOT / "factory" / "floor"} <= {*MODULES}
