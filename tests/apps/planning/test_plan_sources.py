"""Where parts in place come from: files of every kind, parts alike, broken input, output."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import factory
from factory.apps.planning import source
from factory.apps.planning.parts import InPlace
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product
from factory.pipeline import read
from factory.support.arrays import Array
from factory.support.files import write_all
from factory.theory.lang.template_reader import all_templates
from tests.command_line import Terminal
from tests.paths import ROOT

TEMPLATES = all_templates(())


def block(low: Any, high: Any) -> trimesh.Trimesh:
    """A box from corner to corner."""
    return trimesh.creation.box(bounds=[low, high])


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


def test_a_folder_of_meshes_is_read_whatever_their_format(tmp_path: Path) -> None:
    source = read_source(folder_of(tmp_path / "table", table(), ".glb"), TEMPLATES)
    assert boxes_of(source) == TABLE
    assert [p.kind for p in source.parts].count("leg-1") == 4
    assert len(source.files) == 2  # a mesh a kind
    assert "5 parts of 2 kinds (4 like leg-1)" in source.notes
    assert any("taken as mm" in note and "the product is 0.6 x " in note for note in source.notes)
    for part in source.parts:
        low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
        assert np.allclose((*low, *high), TABLE[part.label], atol=1e-7)


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


def test_what_is_no_source_is_refused(run: Terminal, tmp_path: Path) -> None:
    (tmp_path / "text.docx").write_bytes(b"x")
    assert refused(run, tmp_path / "text.docx")["code"] in ("BadFile", "BadMesh")


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

    monkeypatch.setattr("factory.floor.geometry.drawn_solids.can_decompose", lambda: True)
    monkeypatch.setattr(source, "product_geometry", seen)
    found = read_source(tmp_path, TEMPLATES, SourceOptions("mm"))
    assert asked == [{"block2", "block3"}] and len(found.parts) == 4
