"""Solids: extents, mass and inertia against trimesh; meshes that the engine could not use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from factory.floor.geometry.limits import METRES
from factory.floor.geometry.meshes import (
    LEAST_INERTIA,
    LEAST_MASS,
    MOST_FACES,
    is_inertia,
    measured,
    sound,
    usable,
)
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product, Solid, rotation
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from factory.theory.problem.pag import PAG, Value
from tests.layout_values import table_pag

lengths = st.floats(0.001, 1.0)
turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 0.01)
places = st.tuples(*[st.floats(-2, 2)] * 3)


def product(**given: Value) -> Product:
    return product_geometry(table_pag("p", ("p", "atomic", "", given)))


def from_mesh(folder: Path, mesh: trimesh.Trimesh | str, **given: Value) -> Product:
    """A product of one part, whose mesh is written to a file first."""
    if isinstance(mesh, str):
        (folder / "m.obj").write_text(mesh)
    else:
        mesh.export(folder / "m.obj")
    pag = table_pag("p", ("p", "atomic", "", {"mesh": "m.obj", **given}))
    return product_geometry(PAG(pag.root, pag.nodes, folder=str(folder)))


def real(solid: Solid) -> trimesh.Trimesh:
    """The same body made by trimesh."""
    if solid.kind == "box":
        body = trimesh.creation.box(2 * np.array(solid.size))
    elif solid.kind == "cylinder":
        body = trimesh.creation.cylinder(solid.size[0], 2 * solid.size[1], sections=256)
    else:
        body = trimesh.creation.icosphere(4, solid.size[0])
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation(solid.quaternion), solid.position
    return body.apply_transform(turn)


@pytest.mark.parametrize("size", [1e308, 1e-320])
def test_a_quaternion_is_normalised_however_long(size: float) -> None:
    text = f"root = p; p = atomic ( sphere = 0.1, quat = ({size}, {size}, 0, 0) )"
    solid = product_geometry(read_pag(text, all_templates())).solids["p"]
    assert np.allclose(solid.quaternion, [0.5**0.5, 0.5**0.5, 0, 0])


@given(
    st.one_of(
        st.tuples(st.just("box"), st.tuples(lengths, lengths, lengths)),
        st.tuples(st.just("cylinder"), st.tuples(lengths, lengths)),
        st.tuples(st.just("sphere"), lengths),
    ),
    places,
    turns,
)
def test_primitives_are_as_trimesh_has_them(
    shape: tuple[str, Value], pos: tuple[float, ...], quat: tuple[float, ...]
) -> None:
    solid = product(**{shape[0]: shape[1]}, pos=pos, quat=quat).solids["p"]
    body = real(solid)
    size = float(np.ptp(body.bounds, axis=0).max())
    rough = 1e-9 if shape[0] == "box" else 0.01 * size
    assert np.abs(np.array([solid.low, solid.high]) - body.bounds).max() <= rough + 1e-9
    assert (solid.low <= body.bounds[0] + 1e-9).all() and (
        solid.high >= body.bounds[1] - 1e-9
    ).all()
    assert solid.mass == pytest.approx(max(1000 * body.volume, LEAST_MASS), rel=0.01)
    wanted = body.moment_inertia * 1000
    moments = np.linalg.eigvalsh(solid.inertia)
    if np.linalg.eigvalsh(wanted)[0] > LEAST_INERTIA:
        assert solid.inertia == pytest.approx(wanted, abs=0.02 * moments[2])
    assert moments[0] >= LEAST_INERTIA * 0.999 and is_inertia(solid.inertia)
    assert np.linalg.norm(solid.centre - body.center_mass) <= 1e-9 + 1e-3 * size


@given(st.tuples(*[st.floats(-9, 4)] * 3), st.floats(-9, 12), turns)
def test_a_sound_inertia_is_that_of_a_body_in_nine_digits(
    extents: tuple[float, ...], mass: float, quat: tuple[float, ...]
) -> None:
    x, y, z = (10**extent for extent in extents)
    turn = rotation(np.array(quat) / np.linalg.norm(quat))
    box = np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * 10**mass / 12
    written = np.vectorize(lambda v: float(f"{v:.9g}"))(sound(turn @ box @ turn.T))
    low, middle, high = np.linalg.eigvalsh(written)
    assert low > 0 and low + middle > high


def test_an_inertia_that_is_sound_stays_as_it_is() -> None:
    thin = np.diag([2.0, 3.0, 5.0 - 1e-6])
    assert np.array_equal(sound(thin), thin)


@given(turns, places, st.floats(0.1, 10))
def test_a_turned_mesh(quat: tuple[float, ...], pos: tuple[float, ...], scale: float) -> None:
    """v stands at R(quat) · (scale · v) + pos."""
    body = trimesh.creation.cone(0.1, 0.3, sections=12)
    mesh, trouble = usable("m", np.asarray(body.vertices) * scale, np.asarray(body.faces))
    assert trouble is None
    found = measured(mesh)
    q = np.array(quat) / np.linalg.norm(quat)
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation(q), pos
    moved = body.copy().apply_scale(scale).apply_transform(turn)
    corners = found.hull @ rotation(q).T + pos
    assert corners.min(axis=0) == pytest.approx(moved.bounds[0], abs=1e-9)
    assert rotation(q) @ found.centre + pos == pytest.approx(moved.center_mass, abs=1e-9)
    inertia = rotation(q) @ found.inertia @ rotation(q).T
    assert inertia == pytest.approx(moved.moment_inertia, rel=1e-6, abs=1e-12)


def test_a_mesh_file_scaled_turned_and_placed(tmp_path: Path) -> None:
    body = trimesh.creation.box((100, 40, 20))
    quat = (0.5**0.5, 0.0, 0.0, 0.5**0.5)  # a quarter turn about z
    found = from_mesh(tmp_path, body, scale=0.001, quat=quat, pos=(1.0, 0.0, 0.0), density=500.0)
    solid = found.solids["p"]
    assert solid.high - solid.low == pytest.approx([0.04, 0.1, 0.02])
    assert solid.centre == pytest.approx([1, 0, 0], abs=1e-12)
    assert solid.mass == pytest.approx(0.04)
    assert found.warnings == ()


def test_mass_beats_density(tmp_path: Path) -> None:
    body = trimesh.creation.box((0.1, 0.1, 0.1))
    assert from_mesh(tmp_path, body, mass=2.0, density=5.0).mass == 2.0
    assert from_mesh(tmp_path, body, density=5.0).mass == pytest.approx(0.005)
    assert product(sphere=0.1, mass=0.3, density=9.0).mass == 0.3


FLAT = {
    "level": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]],
    "tilted": [[0, 0, 0], [0.1, 0, 0.1], [0.1, 0.1, 0.1], [0, 0.1, 0]],
    "askew": [[0, 0, 0], [0.1, 0.02, 0.03], [0.12, 0.1, 0.09], [0.02, 0.08, 0.06]],
}


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


def test_degenerate_meshes_still_have_a_body(tmp_path: Path) -> None:
    line = "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n"
    point = "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n"
    for text in (line, point):
        found = from_mesh(tmp_path, text)
        assert "is flat" in found.warnings[0].message
        assert is_inertia(found.solids["p"].inertia) or found.solids["p"].mass == LEAST_MASS
        assert np.linalg.eigvalsh(found.solids["p"].inertia)[0] >= LEAST_INERTIA * 0.999
    dust = from_mesh(tmp_path, trimesh.creation.box((1e-5, 2e-5, 2e-5)))
    assert "is tiny; its box is used instead" in dust.warnings[0].message


def test_an_open_mesh_has_the_mass_of_its_hull(tmp_path: Path) -> None:
    opened = trimesh.creation.box((0.1, 0.1, 0.1))
    opened.update_faces(np.arange(len(opened.faces)) < 10)
    found = from_mesh(tmp_path, opened)
    (warning,) = found.warnings
    assert warning.message == "m.obj is open (not watertight); its convex hull is used instead"
    assert found.mass == pytest.approx(1.0)
    assert found.solids["p"].centre == pytest.approx([0, 0, 0], abs=1e-9)


def test_open_meshes_are_named_once_a_file(tmp_path: Path) -> None:
    opened = trimesh.creation.box((0.1, 0.1, 0.1))
    opened.update_faces(np.arange(len(opened.faces)) < 10)
    files = 5
    for n in range(files):
        opened.export(tmp_path / f"{n}.obj")
    rows = [
        (f"p{n}-{scale}", "atomic", "", {"mesh": f"{n}.obj", "scale": scale})
        for n in range(files)
        for scale in (1, 2)
    ]
    pag = table_pag("x", ("x", "mate", " ".join(row[0] for row in rows), {}), *rows)  # type: ignore[arg-type]
    found = product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path))).warnings
    assert [w.message[:10] for w in found] == [f"{n}.obj is o" for n in range(files)]
    assert {w.many for w in found} == {"meshes are open: their convex hulls are used"}


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


def test_a_hull_with_too_many_faces_is_made_coarser() -> None:
    ball = trimesh.creation.icosphere(7, 0.05)
    mesh, trouble = usable("m", np.asarray(ball.vertices), np.asarray(ball.faces))
    assert trouble is not None and "327680 triangles" in trouble.text
    assert len(mesh.faces) <= MOST_FACES
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.1] * 3, rel=0.01)


def test_a_broken_file_is_an_error_at_its_part(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        from_mesh(tmp_path, "v 1 2\nf 1 2 3\n")
    (found,) = caught.value.diagnostics
    assert found.code == "BadMesh" and found.message.startswith("cannot read 'm.obj': line 1 ")


def test_every_broken_mesh_is_reported_at_once(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.obj").write_text("")
    rows = [(f"p{n}", "atomic", "", {"mesh": f"{n}.obj"}) for n in "aab"]
    pag = table_pag("x", ("x", "mate", "pa pb", {}), *rows[:1], *rows[2:])  # type: ignore[arg-type]
    with pytest.raises(InputError) as caught:
        product_geometry(PAG(pag.root, pag.nodes, folder=str(tmp_path)))
    assert len(caught.value.diagnostics) == 2


@pytest.mark.parametrize(
    ("edge", "warns"), [(6.0, True), (4.9, False), (0.006, False), (0.004, True)]
)
def test_a_product_of_an_unlikely_size_warns(edge: float, warns: bool) -> None:
    found = product(box=(edge, edge / 2, edge / 2)).warnings
    assert bool(found) == warns
    if warns:
        assert found[0].message == f"the product is {edge:g} m long"
        assert found[0].hint == METRES


def test_only_a_mesh_is_suspected_of_millimetres(tmp_path: Path) -> None:
    """And only one that is too large."""
    for edge, advice in ((20.0, "write unit = mm;"), (0.002, f"{METRES}: check")):
        (found,) = from_mesh(tmp_path, trimesh.creation.box((edge, edge, edge))).warnings
        assert advice in found.hint


def test_parts_without_geometry_are_packed_near_a_cube() -> None:
    for count in (1, 3, 8, 27, 200):
        names = " ".join(f"p{n}" for n in range(count))
        rows = [(f"p{n}", "atomic", "", {}) for n in range(count)]
        root = ("x", "mate", names, {}) if count > 1 else None
        table = ([root] if root else []) + rows  # type: ignore[operator]
        found = product_geometry(table_pag("x" if root else "p0", *table))  # type: ignore[arg-type]
        extent = found.high - found.low
        assert extent.max() <= 0.2 + 1e-9
        solids = list(found.solids.values())
        for i, one in enumerate(solids):
            for other in solids[i + 1 :]:
                apart = np.maximum(one.low - other.high, other.low - one.high).max()
                assert apart > 0
