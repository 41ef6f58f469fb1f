"""Importing LDraw models, trees and bills of materials: products, and the errors of bad files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from factory.apps.importing import Options, import_product
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from factory.theory.problem.pag import PAG
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.paths import ROOT, files_in

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
    assert shape_of(many) == {"sub1": ("part1", "part2"), "m": ("sub1", "part3", "part4", "part5")}
    chain = bring.pag("m.ldr", text, boxes=True, mates="chain")
    assert shape_of(chain) == {
        "sub1": ("part1", "part2"),
        "m.2": ("sub1", "part3"),
        "m.3": ("m.2", "part4"),
        "m": ("m.3", "part5"),
    }


def test_an_unknown_colour_is_a_warning(bring: Importer) -> None:
    text = f"1 4321 0 0 0 {PLAIN} tile.dat\n1 4321 30 0 0 {PLAIN} tile.dat\n3 4 0 0 0 1 1 1 2 2 2\n"
    warnings = bring.product("m.ldr", text + TILE).warnings
    assert [(w.code, w.position.line, w.position.column) for w in warnings] == [
        ("BadMesh", 1, 1),
        ("UnknownColour", 1, 3),
    ]


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
    [("m.ldr", b"0 Brick\n0 Author: M\xfcller", "2:12 Syntax byte 0xfc is not UTF-8 text")],
)
def test_bytes_that_are_no_text_are_told_by_their_place(
    bring: Importer, name: str, text: bytes, found: str
) -> None:
    assert bring.faults(name, text) == [found]


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
    [("name=Zeichnugn", "BadValue", "did you mean 'Zeichnung'?"), ("name=", "Usage", "name=TITLE")],
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


@pytest.mark.parametrize(
    ("name", "pattern", "operations", "parts"),
    [("table.csv", r"\n\n((?: {4}[^\n]*,[^\n]*\n)+)", {"table", "frame"}, 5)],
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


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.mpd", f"0 FILE {{n}}.ldr\n1 4 0 0 0 {PLAIN} {{m}}.ldr\n1 4 0 0 9 {PLAIN} {{m}}.ldr\n"),
        ("m.mpd", f"0 FILE {{n}}.dat\n1 4 0 0 0 {PLAIN} {{m}}.dat\n1 4 0 0 9 {PLAIN} {{m}}.dat\n"),
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
