"""Importing LDraw models, trees and bills of materials: products, and the errors of bad files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.importing import Options, import_product
from factory.apps.importing.part_maker import quaternion
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import rotation
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from factory.theory.problem.pag import PAG
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.paths import ROOT, files_in
from tests.strategies import pags

CART = ROOT / "examples" / "cart.mpd"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
TILE = """0 FILE tile.dat
3 16 0 0 0 20 0 0 0 0 20
3 16 0 0 0 0 0 20 0 20 0
3 16 0 0 0 0 20 0 20 0 0
3 16 20 0 0 0 20 0 0 0 20
"""
PLAIN = "1 0 0 0 1 0 0 0 1"


class Importer:
    """Imports texts as files of a new folder with a good mesh and two bad ones."""

    def __init__(self, folder: Path, templates: Mapping[str, Template]) -> None:
        self.folder, self.templates = folder, templates
        (folder / "leg.obj").write_text(TETRAHEDRON)
        (folder / "broken.stl").write_text("no mesh")
        (folder / "empty.obj").write_text("")

    def product(self, name: str, text: str | bytes, **options: Any) -> Any:
        file = self.folder / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return import_product(file, self.templates, Options(**options))

    def pag(self, name: str, text: str, **options: Any) -> PAG:
        """The PAG, read back from its text."""
        made = self.product(name, text, **options)
        written = made.files[f"{made.name}.pag"].decode()
        for path, content in made.files.items():
            (self.folder / "out" / path).parent.mkdir(parents=True, exist_ok=True)
            (self.folder / "out" / path).write_bytes(content)
        return read_pag(written, self.templates, folder=str(self.folder / "out"))

    def faults(self, name: str, text: str | bytes, **options: Any) -> list[str]:
        """`line:col CODE message` of every diagnostic."""
        with pytest.raises(InputError) as error:
            self.product(name, text, **options)
        return [
            f"{d.position.line}:{d.position.column} {d.code} {d.message}"
            if d.position
            else f"{d.code} {d.message}"
            for d in error.value.diagnostics
        ]


@pytest.fixture
def bring(tmp_path: Path, templates: Mapping[str, Template]) -> Importer:
    return Importer(tmp_path, templates)


def shape_of(pag: PAG) -> dict[str, tuple[str, ...]]:
    return {node.label: node.inputs for node in pag.nodes if node.inputs}


# --- LDraw ----------------------------------------------------------------------------------------


def test_the_cart_of_the_examples(
    templates: Mapping[str, Template], golden: Callable[[str, str], None]
) -> None:
    """Sub-models, steps, packed bricks, a mirrored one, direct colours."""
    made = import_product(CART, templates)
    golden("cart.pag", made.files["cart.pag"].decode())
    assert [re.sub(r"-\w{12}", "-*", name) for name in sorted(made.files)] == [
        *("bricks/cube.obj", "bricks/plate.obj", "bricks/wedge-*.obj", "bricks/wedge.obj"),
        "cart.pag",
    ]
    assert made.warnings == ()


def test_bricks_are_where_the_model_has_them(
    templates: Mapping[str, Template], tmp_path: Path, run: Terminal
) -> None:
    """Every vertex against the model's own numbers: turned by its matrix, then x, z, -y in LDU."""
    assert run("import", CART, "-o", tmp_path).status == 0
    pag = read_pag((tmp_path / "cart.pag").read_text(), templates, folder=str(tmp_path))
    wedge = np.array(
        [[-10, 0, -10], [-10, 0, 10], [-10, 24, -10], [-10, 24, 10], [10, 24, -10], [10, 24, 10]]
    )
    turn, mirror = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.diag([-1, 1, 1])
    solids = product_geometry(pag).solids
    for label, matrix, place in (("part9", turn, (0, -48, 0)), ("part10", mirror, (0, -72, 0))):
        x, y, z = (wedge @ matrix.T + place).T
        expected = np.stack([x, z, -y], axis=1) * 0.0004
        found = solids[label].corners
        assert np.array(sorted(map(tuple, np.round(found, 7) + 0.0))) == pytest.approx(
            np.array(sorted(map(tuple, np.round(expected, 7) + 0.0))), abs=1e-6
        )


def test_the_cart_runs(run: Terminal, tmp_path: Path) -> None:
    """import, check, build, run: by the command line, in both worlds."""
    pag = tmp_path / "out" / "cart.pag"
    document = run("import", CART, "-o", tmp_path / "out", "--json").json
    assert (document["pag"], document["parts"], document["labels"]) == (str(pag), 10, 15)
    assert sorted(document["files"]) == sorted(str(p) for p in (tmp_path / "out").rglob("*.*"))
    assert run("check", pag, "-q").status == 0
    assert run("run", pag, "--world", "ideal", "--units", 2, "-q").status == 0
    done = run("run", pag, "--json").json
    assert (done["products"], done["refines_net"], done["unintended_contacts"]) == (1, True, 0)


def test_bricks_face_outwards_whichever_way_round_they_are_written(bring: Importer) -> None:
    """BFC: clockwise, counterclockwise, mirrored, inverted; and a closed part without BFC."""
    tile = TILE.partition("\n")[2]
    corner = r"(\S+ \S+ \S+)"
    turned = re.sub(rf"(?m)^3 16 {corner} {corner} {corner}$", r"3 16 \1 \3 \2", tile)
    assert turned != tile
    for head, body in (("CW", turned), ("CCW", tile), ("CCW", turned), ("NOCERTIFY", turned)):
        text = f"1 4 0 0 0 {PLAIN} t.dat\n1 4 0 0 99 -1 0 0 0 1 0 0 0 1 t.dat\n0 FILE t.dat\n"
        made = bring.product("m.ldr", f"{text}0 BFC {head}\n{body}")
        meshes = [content for path, content in made.files.items() if path.endswith(".obj")]
        assert len(meshes) == 2
        for content in meshes:
            mesh = trimesh.load(trimesh.util.wrap_as_stream(content), file_type="obj")
            assert mesh.is_watertight and mesh.volume == pytest.approx(20**3 / 6 * 0.0004**3)


def test_parts_come_from_a_library(
    bring: Importer, tmp_path: Path, run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """parts/ and p/, in lower case, with sub-files and colours of LDConfig.ldr; --library or
    LDRAWDIR."""
    library = tmp_path / "ldraw"
    for folder in ("parts/s", "p"):
        (library / folder).mkdir(parents=True)
    (library / "parts" / "3001.dat").write_text(f"0 Brick\n1 16 0 0 0 {PLAIN} s\\3001s01.dat\n")
    (library / "parts" / "s" / "3001s01.dat").write_text(f"1 16 0 0 0 {PLAIN} Tetra.dat\n")
    (library / "p" / "tetra.dat").write_text(TILE.partition("\n")[2])
    (library / "LDConfig.ldr").write_text("0 !COLOUR Odd CODE 999 VALUE #FF8000 EDGE #0 ALPHA 51")
    model = tmp_path / "m.ldr"
    model.write_text(f"1 999 0 0 0 {PLAIN} 3001.DAT\n1 16 0 -24 0 {PLAIN} 3001.dat\n")
    assert run("import", model, "-o", tmp_path / "a").status == 2
    assert run("import", model, "-o", tmp_path / "b", "--library", library).status == 0
    monkeypatch.setenv("LDRAWDIR", str(library))
    assert run("import", model, "-o", tmp_path / "a").status == 0
    assert files_in(tmp_path / "a") == files_in(tmp_path / "b")
    assert set(files_in(tmp_path / "a")) == {"m.pag", "bricks/3001.obj"}
    assert "rgba = ( 1, 0.502, 0, 0.2 )" in (tmp_path / "a" / "m.pag").read_text()


def test_models_beside_the_model_are_sub_assemblies(bring: Importer) -> None:
    (bring.folder / "Left Wing.ldr").write_text(f"1 1 0 0 0 {PLAIN} a.dat\n1 1 0 9 0 {PLAIN} a.dat")
    text = f"1 2 0 0 50 {PLAIN} left wing.ldr\n0 STEP\n0 STEP\n1 4 9 9 9 {PLAIN} b.dat\n0 STEP\n"
    pag = bring.pag("plane.ldr", text.replace("left wing", "Left Wing"), boxes=True)
    assert pag.root == "plane"
    assert shape_of(pag) == {"Left-Wing": ("part1", "part2"), "plane": ("Left-Wing", "part3")}
    assert pag["part2"].parameter("box") == (0.008, 0.008, 0.0096)
    assert pag["part2"].parameter("pos") == (0, 0.02, -0.0036 - 0.0048)


def test_steps_one_by_one_or_two_by_two(bring: Importer) -> None:
    text = "".join(f"1 4 {x} 0 0 {PLAIN} a.dat\n0 STEP\n" * 1 for x in (0, 20))
    text += "".join(f"1 4 {x} 0 0 {PLAIN} a.dat\n" for x in (40, 60, 80))
    many = bring.pag("m.ldr", text, boxes=True)
    assert shape_of(many) == {
        "sub1": ("part1", "part2"),
        "m": ("sub1", "part3", "part4", "part5"),
    }
    chain = bring.pag("m.ldr", text, boxes=True, mates="chain")
    assert shape_of(chain) == {
        "sub1": ("part1", "part2"),
        "m.2": ("sub1", "part3"),
        "m.3": ("m.2", "part4"),
        "m": ("m.3", "part5"),
    }


def test_what_stands_around_a_model_is_left_out(bring: Importer) -> None:
    """Comments, editors' metas, lines, optional lines, embedded data, byte-order mark, CRLF."""
    text = (
        "\ufeff0 Title\r\n0 // hello\r\n0 MLCAD HIDE 1 x\r\n0 !LPUB ROW\r\n0 ROTSTEP 30 0 0 ABS\r\n"
        "2 24 0 0 0 1 1 1\r\n5 24 0 0 0 1 1 1 0 0 0 1 1 1\r\n0 BFC INVERTNEXT\r\n\r\n"
        f"1 4 0 0 0 {PLAIN} tile.dat\r\n1 4 30 0 0 {PLAIN} tile.dat\r\n{TILE}0 !DATA x.png\r\n"
        "0 !: iVBORw0KGgo=\r\nnot a line\r\n"
    )
    assert bring.faults("m.ldr", text) == ["19:1 Syntax there is no line type 'not'"]
    assert len(bring.pag("m.ldr", text.replace("not a line\r\n", ""))) == 3


def test_an_unknown_colour_is_a_warning(bring: Importer) -> None:
    text = f"1 4321 0 0 0 {PLAIN} tile.dat\n1 4321 30 0 0 {PLAIN} tile.dat\n3 4 0 0 0 1 1 1 2 2 2\n"
    warnings = bring.product("m.ldr", text + TILE).warnings
    assert [(w.code, w.position.line, w.position.column) for w in warnings] == [
        ("BadMesh", 1, 1),
        ("UnknownColour", 1, 3),
    ]


# --- trees ----------------------------------------------------------------------------------------


def tree_of(pag: PAG, label: str) -> dict[str, Any]:
    """A PAG as a nested document."""
    node = pag[label]
    values = ((p.name, p.value) for p in node.parameters)
    said = {name: list(v) if isinstance(v, tuple) else v for name, v in values}
    if node.inputs:
        children = [tree_of(pag, child) for child in node.inputs]
        found = {"name": label, "operation": node.operation, "children": children}
        return {**found, "parameters": said} if said else found
    place = {"at": said.pop("pos")} if "pos" in said else {}
    shape = {"part": said.pop("mesh")} if "mesh" in said else {"part": True}
    return {"name": label, **shape, **place, **said}


def plain(pag: PAG) -> dict[str, tuple[Any, ...]]:
    """The content of a PAG, in which the order of statements and parameters does not count."""
    return {
        node.label: (
            node.operation,
            node.inputs,
            {p.name: p.value for p in node.parameters if p.name != "mesh"},
        )
        for node in pag.nodes
    }


@settings(max_examples=40)
@given(pags(max_labels=14), st.booleans())
def test_a_tree_comes_back_as_it_was(
    templates: Mapping[str, Template],
    tmp_path_factory: pytest.TempPathFactory,
    pag: PAG,
    as_yaml: bool,
) -> None:
    """PAG to a nested document to PAG."""
    folder = tmp_path_factory.getbasetemp()
    document = tree_of(pag, pag.root)
    file = folder / ("tree.yaml" if as_yaml else "tree.json")
    text = yaml.safe_dump(document, allow_unicode=True) if as_yaml else json.dumps(document)
    file.write_text(text, "utf-8")
    made = import_product(file, templates)
    assert (made.pag.root, plain(made.pag)) == (pag.root, plain(pag))
    assert plain(read_pag(made.files["tree.pag"].decode(), templates)) == plain(pag)


def test_places_of_nodes_add_up(bring: Importer) -> None:
    """A part's place is in its sub-assembly, whose place is in the one above; turns too."""
    text = """
children:
- name: left
  at: [10, 0, 0]
  quat: [1, 0, 0, 1]   # a quarter turn about z
  children:
  - {part: leg, at: [2, 0, 0]}
  - {part: leg.obj, at: [0, 0, 5], quat: [1, 0, 0, -1], density: 700}
- {name: top, box: [20, 20, 2], at: [0, 0, 30]}
"""
    pag = bring.pag("stand.yaml", text, unit=0.001)
    assert shape_of(pag) == {"left": ("leg-1", "leg-2"), "stand": ("left", "top")}
    half = round(float(np.sqrt(0.5)), 9)
    assert pag["leg-1"].parameter("pos") == (0.01, 0.002, 0)
    assert pag["leg-1"].parameter("quat") == (half, 0, 0, half)
    assert pag["leg-1"].parameter("scale") == 0.001
    assert pag["leg-2"].parameter("pos") == (0.01, 0, 0.005)
    assert pag["leg-2"].parameter("quat") is None
    assert pag["leg-2"].parameter("density") == 700
    assert pag["top"].parameter("box") == (0.02, 0.02, 0.002)


def test_operations_and_their_parameters(bring: Importer) -> None:
    text = """{"name": "s", "operation": "glue", "parameters": {"dwell": 2.5}, "children": [
      {"children": ["leg.obj", {"part": "leg", "at": [1, 0, 0]}, {"name": "x y", "part": true}]}
    ]}"""
    pag = bring.pag("t.json", text)
    assert (pag.root, pag["s"].operation, pag["s"].parameter("dwell")) == ("s", "glue", 2.5)
    assert shape_of(pag) == {"s": ("sub1",), "sub1": ("leg-1", "leg-2", "x-y")}


def test_a_folder_with_one_tree(bring: Importer, run: Terminal) -> None:
    (bring.folder / "tree.json").write_text(
        '{"children": ["leg", {"part": "leg", "at": [1, 0, 0]}]}'
    )
    out = bring.folder / "made"
    assert run("import", bring.folder, "-o", out).status == 0
    assert set(files_in(out)) == {"tree.pag", "meshes/leg.obj"}
    assert run("check", out / "tree.pag", "-q").status == 0
    (bring.folder / "bill.csv").write_text("level,name\n0,a")
    done = run("import", bring.folder, "--json")
    assert done.codes == ["BadFile"]
    assert "bill.csv, tree.json" in done.err


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("m.ldr", b"0 Brick\n0 Author: M\xfcller", "2:12 Syntax byte 0xfc is not UTF-8 text"),
        ("t.json", b'{"part": "\xff"}', "1:11 Syntax byte 0xff is not UTF-8 text"),
        ("b.csv", b"level,name\n0,Sch\xe4ft", "2:6 Syntax byte 0xe4 is not UTF-8 text"),
    ],
)
def test_bytes_that_are_no_text_are_told_by_their_place(
    bring: Importer, name: str, text: bytes, found: str
) -> None:
    assert bring.faults(name, text) == [found]


# --- bills of materials ---------------------------------------------------------------------------

BILL = """level,part number,Qty,mesh,x [mm],y [mm],z [mm],supplier
0,table,,,,,,us
1,frame,1,,,,,
2,leg,1,leg.obj,-300,200,0,"Legs, Inc."
2,leg,1,leg.obj,300,200,0,
2,rail,2,,,,,
1,top,1,,,,,
"""


def test_a_bill_with_levels(bring: Importer) -> None:
    pag = bring.pag("bill.csv", BILL)
    assert shape_of(pag) == {
        "frame": ("leg-1", "leg-2", "rail-1", "rail-2"),
        "table": ("frame", "top"),
    }
    assert pag["leg-1"].parameter("pos") == (-0.3, 0.2, 0)
    assert pag["leg-1"].parameter("mesh") == "meshes/leg.obj"
    assert pag["top"].parameters == ()
    for delimiter in ";\t":
        text = BILL.replace('"Legs, Inc."', "").replace(",", delimiter).replace("-300", "-300,0")
        assert plain(bring.pag("bill.csv", text)) == plain(pag)


def test_a_bill_with_numbers(bring: Importer) -> None:
    """1, 1.1, 1.2: in any order that has a sub-assembly before its parts; copies of sub-assemblies
    have copies of all their parts."""
    text = "item,name,quantity\n1,axle,2\n2,body,1\n1.1,wheel,2\n1.2,rod,1\n"
    assert shape_of(bring.pag("cart.csv", text)) == {
        "axle-1": ("wheel-1", "wheel-2", "rod-1"),
        "axle-2": ("wheel-3", "wheel-4", "rod-2"),
        "cart": ("axle-1", "axle-2", "body"),
    }


HEADERS = {
    "English": "Level,Part Name,Qty.,Mass [g],X (cm)",
    "German": "Ebene;Bezeichnung;Stückzahl;Gewicht (g);x [cm]",
    "French": "Niveau;Désignation;Quantité;Poids / g;X cm",
    "Spanish": "Nivel;Denominación;Cantidad;Masa [G];x_[cm]",
    "two that are one word": "Niveau;Désignation;Nombre;Masse in g;x in cm",
    "and the other way": "Nivel;Nombre;Cant.;Peso [g];x[cm]",
}


@pytest.mark.parametrize("language", HEADERS)
def test_headers_of_four_languages_with_units(bring: Importer, language: str) -> None:
    text = f"{HEADERS[language]}\n0;table;;;\n1;leg;2;12,5;3\n1;top;;100;\n"
    comma = text.replace("12,5", "12.5").replace(";", ",")
    pag = bring.pag("bill.csv", "\ufeff" + (comma if "," in HEADERS[language] else text))
    assert shape_of(pag) == {"table": ("leg-1", "leg-2", "top")}
    assert [pag[n].parameter("mass") for n in ("leg-1", "leg-2", "top")] == [0.0125, 0.0125, 0.1]
    assert bring.product("bill.csv", comma if "," in HEADERS[language] else text).unused == ()


def test_densities_have_units_too(bring: Importer) -> None:
    pag = bring.pag("bill.csv", "level,name,Dichte [g/cm³]\n0,table,\n1,leg,2.7\n1,top,1\n")
    assert pag["leg"].parameter("density") == 2700.0


def test_columns_that_are_not_used_are_listed_and_titles_can_be_said(
    bring: Importer, run: Terminal, out: Path
) -> None:
    bill = bring.folder / "b.csv"
    bill.write_text("level,Zeichnung,Lieferant,Farbe\n0,table,us,\n1,leg,us,\n1,top,,red\n")
    done = run("import", bill, "-o", out, "--columns", "name=Zeichnung")
    assert done.status == 0, done.err
    assert "columns that are not used: Lieferant, Farbe" in done.out
    found = run("import", bill, "-o", out, "--columns", "name=Zeichnung", "--json").json
    assert found["unused"] == ["Lieferant", "Farbe"]


@pytest.mark.parametrize(
    ("columns", "code", "told"),
    [
        ("name=Zeichnugn", "BadValue", "did you mean 'Zeichnung'?"),
        ("nam=Zeichnung", "Usage", "the name is one of level, item, name"),
        ("name", "Usage", "name=TITLE"),
        ("name=", "Usage", "name=TITLE"),
        ("quantity=Lieferant", "MissingPart", "--columns name=TITLE"),
    ],
)
def test_titles_that_are_not_there(
    bring: Importer, run: Terminal, columns: str, code: str, told: str
) -> None:
    bill = bring.folder / "b.csv"
    bill.write_text("level,Zeichnung,Lieferant\n0,table,us\n1,leg,us\n")
    done = run("import", bill, "--columns", columns, "--json")
    assert done.status == 2 and code in done.codes
    assert any(told in str(error) for error in done.json["errors"])


def test_an_unknown_unit_is_named(bring: Importer, run: Terminal) -> None:
    bill = bring.folder / "b.csv"
    bill.write_text("level,name,Mass [stone]\n0,table,\n1,leg,1\n")
    done = run("import", bill, "--json")
    assert done.status == 2 and done.codes == ["BadValue"]
    assert "units are kg, g, mg, t, lb, oz" in str(done.json["errors"])


def test_import_warns_of_what_build_will(bring: Importer, run: Terminal, out: Path) -> None:
    """The unit in the header is that of the places, not of the meshes: parts are far apart. What
    hands can hold is not looked at yet."""
    (bring.folder / "leg.stl").write_bytes(trimesh.creation.box((10, 10, 60)).export(None, "stl"))
    bill = bring.folder / "b.csv"
    bill.write_text("level,name,mesh,x [mm]\n0,table,,\n1,leg,leg.stl,0\n1,leg,leg.stl,50\n")
    done = run("import", bill, "-o", out)
    built = run("build", out / "b.pag")
    assert "Size warning: the product is 60 m long" in done.err and "--unit mm" in done.err
    assert done.status == built.status == 0 and done.err == built.err
    found = run("import", bill, "-o", out, "--unit", "mm", "--json")
    assert found.json["warnings"] == [] and not found.err
    bill.write_text(bill.read_text().replace("50", "5e9"))
    done = run("import", bill, "-o", out, "--json")
    assert done.status == 0 and done.json["warnings"][0]["code"] == "BadValue"


# --- the manual -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "pattern", "operations", "parts"),
    [
        ("stand.yaml", r"```yaml\n(.*?)```", {"stand", "frame", "sub1"}, 4),
        ("table.csv", r"\n\n((?: {4}[^\n]*,[^\n]*\n)+)", {"table", "frame"}, 5),
    ],
)
def test_the_examples_of_the_manual(
    bring: Importer, run: Terminal, name: str, pattern: str, operations: set[str], parts: int
) -> None:
    found = re.search(pattern, (ROOT / "docs" / "importing.md").read_text(), re.S)
    assert found
    (bring.folder / "leg.stl").write_bytes(trimesh.creation.box((10, 10, 60)).export(None, "stl"))
    (bring.folder / name).write_text(re.sub(r"(?m)^ {4}(?=\w)", "", found[1]))
    out = bring.folder / "out"
    words = ("--unit", "mm", "-o", out, "--json")
    document = run("import", bring.folder / name, *words).json
    assert document["parts"] == parts
    checked = run("check", document["pag"], "--json").json
    assert {g["label"] for r in checked["gears"] for g in r["places"] if g["mode"] != "wait"} >= (
        operations
    )


# --- how deep, how large --------------------------------------------------------------------------

DEEP = 10_000


def test_nesting_has_no_end(bring: Importer) -> None:
    """Ten thousand levels, as a chain of mates; and of nodes that are their only child."""
    chain = '{"children": [{"part": true}, ' * DEEP + '{"part": true}' + "]}" * DEEP
    made = bring.product("t.json", chain).pag
    assert len(made) == 2 * DEEP + 1
    only = '{"children": [' * DEEP + '{"sphere": 1}' + "]}" * DEEP
    assert len(bring.product("t.json", only).pag) == 1
    levels = "level,name\n" + "".join(f"{i},a\n{i + 1},b\n" for i in range(DEEP))
    assert len(bring.product("t.csv", levels).pag) == 2 * DEEP - 1


def test_sub_models_nest_without_end(bring: Importer) -> None:
    model = "".join(
        f"0 FILE {i}.ldr\n1 4 0 -20 0 {PLAIN} {i + 1}.ldr\n1 4 9 0 0 {PLAIN} tile.dat\n"
        for i in range(2000)
    )
    text = f"{model}0 FILE 2000.ldr\n1 4 0 0 0 {PLAIN} tile.dat\n{TILE}"
    assert len(bring.product("m.mpd", text).pag) == 4001
    parts = "".join(f"0 FILE {i}.dat\n1 4 0 -20 0 {PLAIN} {i + 1}.dat\n" for i in range(2000))
    text = f"1 4 0 0 0 {PLAIN} 0.dat\n{parts}0 FILE 2000.dat\n1 4 0 0 0 {PLAIN} tile.dat\n{TILE}"
    assert len(bring.product("m.mpd", text).pag) == 1


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.mpd", f"0 FILE {{n}}.ldr\n1 4 0 0 0 {PLAIN} {{m}}.ldr\n1 4 0 0 9 {PLAIN} {{m}}.ldr\n"),
        ("m.mpd", f"0 FILE {{n}}.dat\n1 4 0 0 0 {PLAIN} {{m}}.dat\n1 4 0 0 9 {PLAIN} {{m}}.dat\n"),
        ("t.yaml", "- &a{m} {{children: [*a{n}, *a{n}]}}\n"),
        ("b.csv", "{n},part,10000\n"),
    ],
)  # fmt: skip
def test_what_multiplies_without_end_is_refused(bring: Importer, name: str, text: str) -> None:
    """A few lines for 2^60 parts, or triangles."""
    head = {"t": "children:\n- &a0 {part: true}\n", "b": "level,name,qty\n"}.get(name[0], "")
    lines = "".join(text.format(n=n, m=n + 1) for n in range(60))
    if ".dat" in text:
        head = f"1 4 0 0 0 {PLAIN} 0.dat\n"
    last = f"0 FILE 60{text[10:14]}\n1 4 0 0 0 {PLAIN} tile.dat\n{TILE}" if name == "m.mpd" else ""
    assert [fault.split()[1] for fault in bring.faults(name, head + lines + last)] == ["TooLarge"]


# --- what is written ------------------------------------------------------------------------------


def test_names_never_lead_out_of_the_folder(bring: Importer, run: Terminal, out: Path) -> None:
    """Names of packed bricks become plain; links of the same name are not followed."""
    name = "..\\..\\evil\\x y.dat"
    text = f"1 4 0 0 0 {PLAIN} {name}\n1 4 9 9 9 {PLAIN} sub/../tile.dat\n{TILE}".replace(
        "0 FILE tile.dat", f"0 FILE {name}"
    )
    model = bring.folder / "m.ldr"
    model.write_text(text + TILE.replace("tile", "sub/../tile").replace("20", "30"))
    before = files_in(bring.folder)
    assert run("import", model, "-o", out).status == 0
    made = {f"out/{n}" for n in ("m.pag", "bricks/evil-x-y.obj", "bricks/sub-..-tile.obj")}
    assert set(files_in(bring.folder)) - set(before) == made
    target = bring.folder / "target"
    target.write_text("mine")
    (out / "bricks" / "evil-x-y.obj").unlink()
    (out / "bricks" / "evil-x-y.obj").symlink_to(target)
    done = run("import", model, "-o", out, "--json")
    assert (done.status, done.codes) == (2, ["BadFile"])
    assert target.read_text() == "mine"


def test_equal_meshes_are_one_file_and_different_ones_two(bring: Importer) -> None:
    (bring.folder / "a").mkdir()
    (bring.folder / "b").mkdir()
    (bring.folder / "a" / "x y.obj").write_text(TETRAHEDRON)
    (bring.folder / "b" / "x_y.obj").write_text(TETRAHEDRON)
    (bring.folder / "a-x-y.obj").write_text(TETRAHEDRON.replace("1", "3", 1))
    text = '{"children": ["a/x y", {"part": "b/x_y", "at": [1, 1, 1]}, "a-x-y.obj"]}'
    files = bring.product("t.json", text).files
    assert [re.sub(r"-\w{12}\.", "-*.", name) for name in files] == [
        *("t.pag", "meshes/a-x-y.obj", "meshes/a-x-y-*.obj"),
    ]


def test_nothing_is_written_where_something_is_wrong(
    bring: Importer, run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bring.folder)
    (bring.folder / "t.json").write_text('{"children": ["leg", "nothing"]}')
    before = files_in(bring.folder)
    for words in (
        ("t.json",),
        ("nowhere.json",),
        ("t.txt",),
        ("leg.obj",),
        ("t.json", "--meshes", "nowhere"),
        ("t.json", "--library", "t.json"),
        ("t.json", "-o", "t.json"),
        ("t.json", "--unit", "furlong"),
    ):
        done = run("import", *words, "--json")
        assert (done.status, len(done.codes)) == (2, 1), words
    assert files_in(bring.folder) == before


@settings(max_examples=30)
@given(st.data())
def test_turns_are_unit_quaternions(data: st.DataObject) -> None:
    drawn = data.draw(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(map(abs, q)) > 0.1))
    unit = np.array(drawn) / np.linalg.norm(drawn)
    back = np.array(quaternion(rotation(unit)))
    assert back[0] >= 0
    assert rotation(back / np.linalg.norm(back)) == pytest.approx(rotation(unit), abs=1e-7)
