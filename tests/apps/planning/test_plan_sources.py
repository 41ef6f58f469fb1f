"""Where parts in place come from: files of every kind, parts alike, broken input, output."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import factory
from factory.apps.importing.alike import alike
from factory.apps.planning import source
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product
from factory.floor.geometry.alike import PartShape, RigidMotion, motion_between, moved, shape_of
from factory.pipeline import all_templates, read
from factory.support.arrays import Array
from factory.support.files import write_all
from tests.command_line import Terminal
from tests.paths import ROOT, files_in
from tests.plan_models import box, model_source, rod
from tests.step_boxes import step_of

TEMPLATES = all_templates(())


def block(low: Any, high: Any) -> trimesh.Trimesh:
    """A box from corner to corner."""
    return trimesh.creation.box(bounds=[low, high])


def wedge() -> trimesh.Trimesh:
    """A body that is not its own mirror image: three arms of three lengths."""
    arms = [block((0, 0, 0), (5, 1, 1)), block((0, 1, 0), (1, 4, 1)), block((0, 0, 1), (1, 1, 3))]
    return trimesh.util.concatenate(arms)


def table() -> dict[str, trimesh.Trimesh]:
    """A top on four legs of two lengths of side, in millimetres, in place."""
    legs = {
        f"leg {n + 1}": block((x, y, 0), (x + 40, y + 40, 400))
        for n, (x, y) in enumerate(((0, 0), (560, 0), (0, 360), (560, 360)))
    }
    return {"top": block((0, 0, 400), (600, 400, 425)), **legs}


def axes_of(suffix: str) -> Array:
    """From z upwards to what is up in a format: y in GLB."""
    turn = -np.pi / 2 if suffix == ".glb" else 0.0
    return trimesh.transformations.rotation_matrix(turn, (1, 0, 0)).round()


def folder_of(folder: Path, meshes: Mapping[str, trimesh.Trimesh], suffix: str = ".stl") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, mesh in meshes.items():
        drawn = mesh.copy().apply_transform(axes_of(suffix))
        (folder / f"{name}{suffix}").write_bytes(_bytes(drawn.export(file_type=suffix[1:])))
    return folder


def _bytes(content: Any) -> bytes:
    return content.encode() if isinstance(content, str) else bytes(content)


def scene_of(meshes: Mapping[str, trimesh.Trimesh], suffix: str) -> bytes:
    scene = trimesh.Scene()
    for name, mesh in meshes.items():
        scene.add_geometry(mesh, name, name, transform=axes_of(suffix))
    return _bytes(scene.export(file_type=suffix[1:]))


def boxes_of(source: InPlace) -> dict[str, list[float]]:
    return {
        part.label: [round(float(x), 6) for x in (*part.solid.low, *part.solid.high)]
        for part in source.parts
    }


TABLE = {
    "top": [0.0, 0.0, 0.4, 0.6, 0.4, 0.425],
    "leg-1": [0.0, 0.0, 0.0, 0.04, 0.04, 0.4],
    "leg-2": [0.56, 0.0, 0.0, 0.6, 0.04, 0.4],
    "leg-3": [0.0, 0.36, 0.0, 0.04, 0.4, 0.4],
    "leg-4": [0.56, 0.36, 0.0, 0.6, 0.4, 0.4],
}


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".off", ".glb"])
def test_a_folder_of_meshes_is_read_whatever_their_format(tmp_path: Path, suffix: str) -> None:
    source = read_source(folder_of(tmp_path / "table", table(), suffix), TEMPLATES)
    assert boxes_of(source) == TABLE
    assert [p.kind for p in source.parts].count("leg-1") == 4
    assert len(source.files) == 2  # a mesh a kind
    assert "5 parts of 2 kinds (4 like leg-1)" in source.notes
    assert any("taken as mm" in note and "the product is 0.6 x " in note for note in source.notes)
    for part in source.parts:
        low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
        assert np.allclose((*low, *high), TABLE[part.label], atol=1e-7)


def test_a_scene_keeps_its_names_and_colours(tmp_path: Path) -> None:
    meshes = {name: mesh.apply_scale(0.001) for name, mesh in table().items()}
    meshes["top"].visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[51, 102, 153, 255])
    )
    (tmp_path / "table.glb").write_bytes(scene_of(meshes, ".glb"))
    source = read_source(tmp_path / "table.glb", TEMPLATES)
    assert boxes_of(source) == TABLE
    assert any("metres by its standard" in note for note in source.notes)
    colours = {part.label: part.node.parameter("rgba") for part in source.parts}
    assert colours["top"] == (0.485, 0.665, 0.798, 1.0)  # linear in the file
    assert len({colours[f"leg-{n}"] for n in range(1, 5)}) == 1


def test_an_exported_glb_is_planned_as_its_product(tmp_path: Path) -> None:
    """The same tree, with the same side up, in the same colours, screws driven."""
    unlaid = PlanOptions(lay_out=False)
    parts = {
        "base": box(60, 40, 10) - rod(2.5, 30).translate((20, 0, 0)),
        "lid": box(60, 40, 6, (0, 0, 8)) - rod(2.5, 30).translate((20, 0, 8)),
        "screw": rod(2.4, 16).translate((20, 0, 3)) + rod(4.5, 5).translate((20, 0, 13.5)),
    }
    (tmp_path / "drawn").mkdir()
    source = model_source(tmp_path / "drawn", parts)
    first = plan(source, unlaid)
    assert isinstance(first, Planned)
    made = planned_product(source, first.tree, first.orientation)
    (name,) = (name for name in made.files if name.endswith(".pag"))
    text = made.files[name].decode()
    text = text.replace("screw = atomic (", "screw = atomic ( rgba = ( 0.2, 0.4, 0.6, 1 ),")
    write_all({tmp_path / "made" / name: content for name, content in made.files.items()})
    (tmp_path / "made" / "drawn.pag").write_text(text)
    factory.export(tmp_path / "made" / "drawn.pag", "gltf", tmp_path / "made.glb")
    again = read_source(tmp_path / "made.glb", TEMPLATES)
    second = plan(again, unlaid)
    assert isinstance(second, Planned)
    assert second.tree == first.tree and "Screwed" in str(first.tree)
    assert np.allclose(second.orientation, np.eye(3)) and np.allclose(first.orientation, np.eye(3))
    colours = {part.label: part.node.parameter("rgba") for part in again.parts}
    assert colours["screw"] == (0.2, 0.4, 0.6, 1.0)


def test_a_scene_in_the_wrong_unit_is_told(tmp_path: Path) -> None:
    (tmp_path / "table.glb").write_bytes(scene_of(table(), ".glb"))
    source = read_source(tmp_path / "table.glb", TEMPLATES)
    assert boxes_of(source) == TABLE
    assert any("taken as mm" in n and "product of 600 m" in n for n in source.notes)
    inches = read_source(tmp_path / "table.glb", TEMPLATES, SourceOptions(unit="in"))
    assert max(part.solid.high[0] for part in inches.parts) == pytest.approx(600 * 0.0254, rel=1e-2)


def test_a_3mf_file_states_its_unit(tmp_path: Path) -> None:
    pytest.importorskip("lxml")
    (tmp_path / "table.3mf").write_bytes(scene_of(table(), ".3mf"))
    source = read_source(tmp_path / "table.3mf", TEMPLATES)
    assert boxes_of(source) == {label: TABLE[label] for label in boxes_of(source)}
    assert any("3MF file states millimeter" in note for note in source.notes)


def test_a_step_file_has_its_bodies_by_name(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    boxes = {n: (tuple(m.bounds[0]), tuple(m.bounds[1])) for n, m in table().items()}
    (tmp_path / "table.step").write_text(step_of(boxes))
    source = read_source(tmp_path / "table.step", TEMPLATES)
    assert boxes_of(source) == {label: TABLE[label] for label in boxes_of(source)}
    assert len(source.parts) == 5


def test_what_reads_step_may_be_missing(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "cascadio", None)
    (tmp_path / "a.step").write_text("ISO-10303-21;")
    done = run("plan", tmp_path / "a.step", "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (3, ["Missing"])
    assert "klavins-factory[" in done.json["errors"][0]["hint"]


def test_one_mesh_of_several_pieces_is_taken_to_pieces(tmp_path: Path) -> None:
    legs = [mesh for name, mesh in table().items() if name != "top"]
    (tmp_path / "legs.stl").write_bytes(trimesh.util.concatenate(legs).export(file_type="stl"))
    source = read_source(tmp_path / "legs.stl", TEMPLATES, SourceOptions(in_place=True))
    assert len(source.parts) == 4
    assert len({part.kind for part in source.parts}) == 1


def test_the_steps_of_an_ldraw_model_are_thrown_away() -> None:
    source = read_source(ROOT / "examples" / "cart.mpd", TEMPLATES)
    assert len(source.parts) == 10
    assert "its 5 steps are discarded" in source.notes[0]
    assert source.tree is not None


def test_a_sub_tree_is_kept_and_the_rest_replanned(tmp_path: Path) -> None:
    chair = ROOT / "examples" / "chair.pag"
    source = read_source(chair, TEMPLATES, SourceOptions(keep=("left", "left_side", "right")))
    assert [keep.label for keep in source.kept] == ["left", "right"]
    units = dict(source.units())
    assert {p.label for p in units["left"]} == {"left_front", "left_rail", "left_back"}
    assert len(units) == 11 - 3 - 3 + 2
    made = planned_product(source, tuple(units))
    write_all({tmp_path / name: content for name, content in made.files.items()})
    pag = read(tmp_path / "chair.pag").pag
    assert pag["left"].operation == "press"
    assert pag["left_side"].inputs == ("left_front", "left_rail", "left_back")
    assert pag[pag.root].inputs == tuple(units)


# Parts alike


@st.composite
def motions(draw: st.DrawFn) -> RigidMotion:
    """Any rotation, and a shift by up to two sizes of the part."""
    axis = np.array([draw(st.floats(-1, 1)) for _ in range(4)])
    if np.linalg.norm(axis) < 0.1:
        axis = np.array([1.0, 0, 0, 0])
    turn = trimesh.transformations.quaternion_matrix(axis / np.linalg.norm(axis))[:3, :3]
    return RigidMotion(turn, np.array([draw(st.floats(-10, 10)) for _ in range(3)]))


def shuffled(shape: PartShape, seed: int) -> PartShape:
    """The same surface, its vertices and triangles numbered anew."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(shape.vertices))
    faces = np.argsort(order)[shape.faces]
    faces = np.roll(faces[rng.permutation(len(faces))], int(rng.integers(3)), axis=1)
    return PartShape(shape.vertices[order], faces)


SHAPES = {
    "wedge": wedge(),
    "cube": trimesh.creation.box((2, 2, 2)),
    "cylinder": trimesh.creation.cylinder(1.0, 3.0, sections=24),
    "ring": trimesh.creation.annulus(1.0, 2.0, 1.0, sections=16),
    "cone": trimesh.creation.cone(1.0, 2.0, sections=12),
    "ball": trimesh.creation.icosphere(2),
}
FORMS = {name: shape_of(np.array(m.vertices), np.array(m.faces)) for name, m in SHAPES.items()}


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(sorted(FORMS)), motions(), st.integers(0, 10**6))
def test_a_part_is_recognised_wherever_it_is(name: str, by: RigidMotion, seed: int) -> None:
    one = FORMS[name]
    other = shuffled(PartShape(moved(by, one.vertices), one.faces), seed)
    found = motion_between(one, other)
    assert found is not None
    assert np.linalg.det(found.turn) == pytest.approx(1.0)
    assert_same(moved(found, one.vertices), other.vertices)


def test_a_round_copy_that_is_only_shifted_is_not_turned() -> None:
    """Of the rotations that map a ring to itself none is chosen."""
    one = FORMS["ring"]
    found = motion_between(one, shuffled(PartShape(one.vertices + 0.2, one.faces), 1))
    assert found is not None and np.allclose(found.turn, np.eye(3), atol=1e-9)


def assert_same(one: Array, other: Array) -> None:
    """Two sets of points (n, 3) are the same."""
    from scipy.spatial import cKDTree

    gap, order = cKDTree(other).query(one)
    assert gap.max() < 1e-4
    assert len(set(order.tolist())) == len(one)


@settings(max_examples=20, deadline=None)
@given(motions(), st.integers(0, 10**6))
def test_mirrored_twins_are_two_kinds(by: RigidMotion, seed: int) -> None:
    one = FORMS["wedge"]
    twin = one.mirrored()
    other = shuffled(PartShape(moved(by, twin.vertices), twin.faces), seed)
    assert motion_between(one, other) is None
    assert alike([one, other, one]).kinds == (0, 1, 0)
    assert alike([one, other]).twins == ((0, 1),)


@settings(max_examples=20, deadline=None)
@given(motions(), st.sampled_from(sorted(FORMS)), st.floats(1e-3, 0.2))
def test_a_part_with_a_corner_moved_is_another_kind(
    by: RigidMotion, name: str, by_how_much: float
) -> None:
    one = FORMS[name]
    vertices = one.vertices.copy()
    vertices[0] += by_how_much * one.size * np.array([0.6, 0.64, 0.48])
    assert motion_between(one, PartShape(moved(by, vertices), one.faces)) is None


# Broken input, through the command line


def refused(run: Terminal, source: Path, *words: object) -> dict[str, Any]:
    """The one error with which a source is refused; nothing is written."""
    out = source.parent / "out"
    done = run("plan", source, "-o", out, "--no-look", "--json", *words)
    assert done.status == 2
    assert not out.exists()
    (error,) = done.json["errors"]
    assert error["hint"]
    return dict(error)


def test_no_part_and_one_part_are_refused(run: Terminal, tmp_path: Path) -> None:
    empty = tmp_path / "parts"
    empty.mkdir()
    assert refused(run, empty)["code"] == "TooFewParts"
    folder_of(empty, {"top": table()["top"]})
    error = refused(run, empty)
    assert error["code"] == "TooFewParts"
    assert "'top'" in error["message"]


def test_a_part_in_another_unit_is_told(run: Terminal, tmp_path: Path) -> None:
    meshes = table()
    meshes["leg 3"].apply_scale(0.001)
    error = refused(run, folder_of(tmp_path / "parts", meshes))
    assert error["code"] == "Size"
    assert "'leg-3'" in error["message"]
    assert "in metres, and the others in millimetres" in error["message"]
    for name, mesh in (meshes := table()).items():
        mesh.apply_scale(1.0 if name == "leg 3" else 0.001)
    error = refused(run, folder_of(tmp_path / "parts", meshes))
    assert "in millimetres, and the others in metres" in error["message"]


def test_two_parts_in_one_place_are_told(run: Terminal, tmp_path: Path) -> None:
    meshes = {**table(), "leg 5": table()["leg 2"]}
    error = refused(run, folder_of(tmp_path / "parts", meshes))
    assert error["code"] == "UsedTwice"
    assert "'leg-5' has the shape and the place of 'leg-2'" in error["message"]


def test_a_part_far_away_is_told(run: Terminal, tmp_path: Path) -> None:
    meshes = table()
    meshes["leg 4"].apply_translation((0, 3000, 0))
    error = refused(run, folder_of(tmp_path / "parts", meshes))
    assert error["code"] == "FarAway"
    assert "'leg-4'" in error["message"]
    assert "2.96 m away" in error["message"]


BROKEN = {
    "empty.stl": b"",
    "text.stl": b"no mesh at all",
    "cut.glb": scene_of(table(), ".glb")[:200],
    "nan.obj": b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "none.ply": b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
    "cut.off": b"OFF\n8 6 0\n1 2",
}


def test_every_file_that_cannot_be_read_is_told(run: Terminal, tmp_path: Path) -> None:
    parts = folder_of(tmp_path / "parts", table())
    for name, content in BROKEN.items():
        (parts / name).write_bytes(content)
    done = run("plan", parts, "-o", tmp_path / "out", "--json")
    assert done.status == 2
    assert done.codes == ["BadMesh"] * len(BROKEN)
    for name in BROKEN:
        assert any(name in error["message"] for error in done.json["errors"])


@pytest.mark.parametrize("name", ["gone", "gone.glb", "gone.pag", "text.docx", "broken.glb"])
def test_what_is_no_source_is_refused(run: Terminal, tmp_path: Path, name: str) -> None:
    if not name.startswith("gone"):
        (tmp_path / name).write_bytes(b"x")
    assert refused(run, tmp_path / name, *(["--replan"] * name.endswith(".pag")))["code"] in (
        "BadFile",
        "BadMesh",
    )


def test_an_open_mesh_is_mended_and_that_is_said(run: Terminal, tmp_path: Path) -> None:
    meshes = table()
    top = meshes["top"].subdivide()
    top.update_faces(np.arange(len(top.faces)) > 0)
    done = run(
        *("plan", folder_of(tmp_path / "parts", {**meshes, "top": top}, ".obj")),
        *("-o", tmp_path / "out", "--no-look", "--json"),
    )
    assert done.status == 0
    assert any("it was repaired" in warning["message"] for warning in done.json["warnings"])


def test_a_hull_that_stands_for_a_mesh_is_told(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tapered bore: bodies of prisms need no library."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")
    profile = [(20, -15), (40, -15), (40, 15), (30, 15), (20, -15)]
    ring = trimesh.creation.revolve(np.array(profile))
    ring.apply_translation((300, 200, 440))
    parts = folder_of(tmp_path / "parts", {"top": table()["top"], "ring": ring})
    done = run("plan", parts, "-o", tmp_path / "out", "--no-look", "--json")
    (warning,) = done.json["warnings"]
    assert "ring.obj is not convex" in warning["message"]
    assert "decompose" in warning["hint"]


def sleeve() -> dict[str, trimesh.Trimesh]:
    """A peg in a sleeve, with a plate below, in millimetres; the hull of the sleeve has the peg
    in it."""
    ring, peg = trimesh.creation.annulus(20, 40, 30), trimesh.creation.cylinder(19.5, 60)
    plate = block((-50, -50, -25), (50, 50, -15))
    peg.apply_translation((0, 0, 15))
    return {"plate": plate, "ring": ring, "peg": peg}


def test_a_peg_comes_out_of_a_sleeve_that_no_library_decomposes(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The hull of the sleeve hides its hole; its volume does not."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")
    parts, out = folder_of(tmp_path / "parts", sleeve()), tmp_path / "out"
    done = run("plan", parts, "-o", out, "--no-look", "--json")
    join = next(j for j in done.json["joins"] if {"peg", "ring"} <= {*j["pile"], *j["come"]})
    assert [abs(x) for x in join["direction"]] == [0, 0, 1]


def test_a_plan_that_rests_on_the_hull_of_an_open_mesh_is_refused_unless_hulls_are_asked_for(
    run: Terminal, tmp_path: Path
) -> None:
    made = sleeve()
    made["ring"].update_faces(np.arange(len(made["ring"].faces)) >= 9)
    parts, out = folder_of(tmp_path / "parts", made), tmp_path / "out"
    error = refused(run, parts)
    assert error["code"] == "Hulls"
    assert "'ring' is open" in error["message"] and "overlaps 'peg' by" in error["message"]
    assert "'plate'" not in error["message"] and "--hulls" in error["hint"]
    words = ("plan", parts, "-o", out, "--no-look", "--hulls")
    (pair,) = run(*words, "--json").json["hulls"]
    assert {pair["one"], pair["other"]} == {"peg", "ring"} and pair["depth"] > 0.018
    told = run(*words, "-v").out.splitlines()
    (ways,) = [line for line in told if "; ways: " in line]
    assert ways.endswith("for hulls only: a pair overlaps")
    assert sum(line.endswith("for hulls only: a pair overlaps") for line in told) == 2
    # with a tree, the hulls of open meshes are what `check` takes
    again = ("plan", out / "parts.pag", "--replan", "-o", tmp_path / "again", "--no-look")
    done = run(*again, "--json")
    assert done.status == 0 and "hulls" not in done.json
    assert any("ring.obj is open" in w["message"] for w in done.json["warnings"])


def test_a_tree_is_not_thrown_away_unasked(run: Terminal, tmp_path: Path) -> None:
    paper = ROOT / "examples" / "paper.pag"
    chair = ROOT / "examples" / "chair.pag"
    done = run("plan", chair, "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (2, ["Usage"])
    done = run("plan", paper, "--replan", "-o", tmp_path / "out", "--json")
    assert (done.status, set(done.codes)) == (2, {"MissingPart"})
    done = run("plan", chair, "--keep", "lft", "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (2, ["UndefinedLabel"])
    assert "did you mean 'left'" in done.json["errors"][0]["hint"]
    done = run("plan", chair, "--keep", "chair", "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (2, ["Usage"])


# What is written


def test_what_is_written_checks_and_runs_as_it_is(run: Terminal, tmp_path: Path) -> None:
    parts, out = folder_of(tmp_path / "my table", table()), tmp_path / "out"
    done = run("plan", parts, "-o", out, "--no-look", "--json")
    assert done.status == 0, done.err
    assert done.json["parts"] == 5
    assert done.json["kinds"] == 2
    assert {"pag", "notes", "approaches", "files", "warnings"} <= {*done.json}
    assert done.out.count("\n") == 1
    assert sorted(files_in(out)) == ["meshes/leg-1.obj", "meshes/top.obj", "my-table.pag"]
    pag = out / "my-table.pag"
    again = run("plan", parts, "-o", tmp_path / "again", "--no-look", "--json")
    assert again.status == 0
    assert files_in(out) == files_in(tmp_path / "again")
    assert run("check", pag, "--json").json["live"]
    done = run("run", pag, "--units", 1, "--json")
    assert done.status == 0, done.err
    assert done.json["product_error_max_mm"] < 1


@settings(max_examples=15, deadline=None)
@given(motions())
def test_a_turned_product_is_the_same_product(by: RigidMotion) -> None:
    source = read_source(ROOT / "examples" / "chair.pag", TEMPLATES, SourceOptions(replan=True))
    made = planned_product(source, tuple(p.label for p in source.parts), by.turn)
    from factory.floor.geometry.product import product_geometry

    solids = product_geometry(made.pag, made.files).solids
    for part in source.parts:
        centre = by.turn @ part.solid.centre
        assert np.allclose(solids[part.label].centre, centre, atol=1e-8)
        inertia = by.turn @ part.solid.inertia @ by.turn.T
        assert np.allclose(solids[part.label].inertia, inertia, rtol=1e-6, atol=1e-9)


def test_names_from_files_stay_in_the_folder(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for n, name in enumerate(("../../etc/passwd", "root", "12", "a b")):
        mesh = block((0, 0, n * 0.1), (0.1, 0.1, n * 0.1 + 0.1))
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    (tmp_path / "evil.glb").write_bytes(_bytes(scene.export(file_type="glb")))
    source = read_source(tmp_path / "evil.glb", TEMPLATES)
    made = planned_product(source, tuple(p.label for p in source.parts))
    assert all(".." not in name and not name.startswith("/") for name in made.files)
    write_all({tmp_path / "out" / name: content for name, content in made.files.items()})
    assert len(list(read(tmp_path / "out" / "evil.pag").pag.parts())) == 4


def test_the_exploded_view_takes_back_what_is_assembled() -> None:
    from factory.apps.planning.exploding import explosion

    project = read(ROOT / "examples" / "chair.pag")
    assert project.matings is not None
    found = explosion(project.pag, project.matings, project.product)
    count = len(found.steps)
    assert count == len(project.matings.all)
    assert np.abs(found.offsets(count)).max() == 0
    apart = found.offsets(0)
    solids = [project.product.solids[label] for label in found.parts]
    low = np.array([s.low for s in solids]) + apart
    high = np.array([s.high for s in solids]) + apart
    clear = ((low[:, None] >= high[None]) | (high[:, None] <= low[None])).any(axis=2)
    assert clear[~np.eye(len(solids), dtype=bool)].all()


def test_only_what_is_beside_an_open_mesh_is_decomposed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ways of all other parts are judged by the volumes that their meshes bound."""
    meshes = {f"block{n}": block((0, 0, 10 * n), (20, 20, 10 * n + 10)) for n in range(4)}
    meshes["block3"].update_faces(np.arange(12) > 5)
    for label, mesh in meshes.items():
        mesh.export(tmp_path / f"{label}.stl")
    asked = []
    made = source.product_geometry

    def seen(pag: factory.PAG, *words: Any, **named: Any) -> Any:
        if named.get("decomposed", True):
            asked.append({node.label for node in pag.parts()})
        return made(pag, *words, **named)

    monkeypatch.setattr(source, "can_decompose", lambda: True)
    monkeypatch.setattr(source, "product_geometry", seen)
    found = read_source(tmp_path, TEMPLATES, SourceOptions("mm"))
    assert asked == [{"block2", "block3"}] and len(found.parts) == 4


@pytest.mark.parametrize(
    ("folder", "name"), [("lamp/stl", "lamp"), ("lamp/STLs", "lamp"), ("lamp/arm", "arm")]
)
def test_a_product_is_not_called_by_a_format(folder: str, name: str, tmp_path: Path) -> None:
    place = tmp_path / folder
    place.mkdir(parents=True)
    for label, mesh in table().items():
        mesh.export(place / f"{label}.stl")
    found = read_source(place, TEMPLATES, SourceOptions("mm"))
    assert found.name == name
    text = planned_product(found, tuple(label for label, _ in found.units())).files[f"{name}.pag"]
    assert text.decode().startswith(f"// {name}: 5 parts, planned\nroot = {name};\n")


def test_turned_copies_have_clean_rotations(tmp_path: Path) -> None:
    """As STL has 32 bits, motions between copies are off by 1e-8."""
    body = wedge()
    for n, angle in enumerate((0, 90, 180)):
        turned = body.copy()
        turn = trimesh.transformations.rotation_matrix(np.radians(angle), (0, 0, 1))
        turned.apply_transform(trimesh.transformations.translation_matrix((20 * n, 0, 0)) @ turn)
        turned.export(tmp_path / f"arm{n}.stl")
    block((-9, -9, -5), (60, 9, 0)).export(tmp_path / "base.stl")
    found = read_source(tmp_path, TEMPLATES, SourceOptions("mm"))
    (text,) = [
        text.decode()
        for name, text in planned_product(found, ("base", "arm0", "arm1", "arm2")).files.items()
        if name.endswith(".pag")
    ]
    assert "quat" not in text
    assert text.count("turn = ( 0, 0, 90 )") == text.count("turn = ( 0, 0, 180 )") == 1
