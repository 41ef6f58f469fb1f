"""What `check` does not do twice, and what it does not do at all: counted, not timed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from xml.sax import saxutils

import numpy as np
import pytest
import rich.table
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Lark
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.text import Text
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from factory.apps.drawing import markup
from factory.commands import places
from factory.floor.geometry import meshes
from factory.floor.geometry.pieces import BOX_FACES, box_piece, is_box
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.overlaps import Finder
from factory.pipeline import all_templates
from factory.support import console as console_module
from factory.support.cache import load, store
from factory.support.errors import one_line
from factory.support.files import user_cache
from factory.theory.lang import load_pag, pag_syntax
from factory.theory.lang.recovery import open_grammar
from factory.theory.nets.components import strong_components
from tests.command_line import Terminal

TWO = """root = s; s = mate ( a, b );
a = atomic ( mesh = "a.stl" ); b = atomic ( mesh = "b.stl", pos = (0, 0, 0.1){more} )"""

BOXES = """root = s; s = mate ( a, b );
a = atomic ( box = (0.1, 0.1, 0.1) ); b = atomic ( box = (0.1, 0.1, 0.1), pos = (0, 0, 0.1) )"""

ENGINES = ("trimesh", "scipy", "mujoco", "networkx", "PIL")

UNUSED = ("trimesh", "scipy", "networkx", "PIL", "glfw", "rich", "http", "unittest")
"""What a run of boxes that is not filmed does without."""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return user_cache()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two cones as meshes."""
    trimesh.creation.cone(0.05, 0.1, sections=30).export(tmp_path / "a.stl")
    trimesh.creation.cone(0.05, 0.1, sections=20).export(tmp_path / "b.stl")
    return written(tmp_path)


def written(folder: Path, more: str = "") -> Path:
    path = folder / "two.pag"
    path.write_text(TWO.replace("{more}", more))
    return path


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How many meshes are measured, and products searched for overlaps."""
    found = {"measured": 0, "searched": 0}

    def counted(name: str, function: Any) -> Any:
        def call(*given: Any) -> Any:
            found[name] += 1
            return function(*given)

        return call

    measured = counted("measured", meshes.measured)
    monkeypatch.setattr("factory.floor.geometry.product.measured", measured)
    monkeypatch.setattr(Finder, "_search", counted("searched", Finder._search))
    return found


def imported(*words: object, cache: Path) -> set[str]:
    """The packages that a command loads, in a process of its own, and the modules of this one."""
    code = "import sys; from factory.commands import run_command; run_command(sys.argv[1:]);"
    code += "found = {n for name in sys.modules for n in (name, name.partition('.')[0])};"
    code += "print(*found, file=sys.stderr)"
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache.parent)}
    command = [sys.executable, "-c", code, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    return set(done.stderr.split())


# --- nothing new --------------------------------------------------------------------------------


def test_the_tables_of_a_grammar_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def read() -> Any:
        parser = open_grammar("pag.lark", ["start", "unlawful"], pag_syntax._Builder())
        return parser.parse("root = s; s = mate ( a, b ); a = atomic ( mass = 1 )", start="start")

    first = read()
    monkeypatch.setattr(Lark, "__init__", None)
    assert read() == first


def test_a_second_check_measures_no_mesh_and_seeks_no_overlap(
    run: Terminal, file: Path, work: dict[str, int]
) -> None:
    first = run("check", file, "--json").json
    once = dict(work)
    assert once["measured"] == 2 and once["searched"] >= 2
    assert run("check", file, "--json").json == first
    assert work == once


def test_the_same_mesh_in_two_files_is_measured_once(
    run: Terminal, file: Path, work: dict[str, int]
) -> None:
    shutil.copy(file.parent / "a.stl", file.parent / "b.stl")
    run("check", file)
    assert work["measured"] == 1


@pytest.mark.parametrize("more", [", scale = 0.5", ", quat = (1, 1, 0, 0)"])
def test_what_is_new_is_computed(
    run: Terminal, file: Path, work: dict[str, int], more: str
) -> None:
    run("check", file)
    before = dict(work)
    run("check", written(file.parent, more))
    assert work["measured"] - before["measured"] == ("scale" in more)
    assert work["searched"] > before["searched"]


def test_a_mesh_that_changed_is_measured_again(
    run: Terminal, file: Path, work: dict[str, int]
) -> None:
    run("check", file)
    trimesh.creation.box((0.1, 0.1, 0.1)).export(file.parent / "b.stl")
    run("check", file)
    assert work["measured"] == 3


def test_another_version_measures_again(
    run: Terminal, file: Path, work: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    run("check", file)
    monkeypatch.setattr("factory.floor.geometry.product.program", lambda *given: "another")
    run("check", file)
    assert work["measured"] == 4


def test_what_is_kept_is_what_was_found(file: Path) -> None:
    found = [product_geometry(load_pag(file, all_templates())).solids["b"] for _ in range(2)]
    for one, other in zip(*(json.loads(json.dumps(listed(s))) for s in found), strict=True):
        assert one == other


def listed(solid: Any) -> list[Any]:
    assert solid.mesh is not None
    arrays = (solid.centre, solid.inertia, solid.corners, solid.mesh.vertices, solid.mesh.faces)
    return [solid.mesh.name, solid.mass, *(a.tolist() for a in (*arrays, *solid.pieces))]


# --- the cache ----------------------------------------------------------------------------------


@pytest.mark.parametrize("folder", ["meshes", "overlaps"])
def test_a_damaged_entry_is_made_again(
    run: Terminal, file: Path, work: dict[str, int], cache: Path, folder: str
) -> None:
    first = run("check", file, "--json").json
    entries = {path: path.read_bytes() for path in (cache / folder).iterdir()}
    assert entries
    for damage in (empty, rubbish, cut_off, flipped):
        for path, whole in entries.items():
            path.write_bytes(damage(whole))
        before = dict(work)
        assert run("check", file, "--json").json == first
        assert work != before
        assert {path: path.read_bytes() for path in entries} == entries


def empty(_: bytes) -> bytes:
    return b""


def rubbish(_: bytes) -> bytes:
    return b"rubbish"


def cut_off(whole: bytes) -> bytes:
    return whole[:-40]


def flipped(whole: bytes) -> bytes:
    """One bit in the middle."""
    at = len(whole) // 2
    return whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]


def test_a_cache_that_cannot_be_written_is_no_error(run: Terminal, file: Path) -> None:
    (file.parent / "cache").write_text("a file where the folder should be")
    assert run("check", file).status == 0


def test_the_oldest_entries_go_where_they_are_too_many(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("factory.support.cache.MOST", 30_000)
    for number, name in enumerate("abc"):
        store("some", name, bytes(8000))
        os.utime(cache / "some" / f"{name}.entry", (number, number))
    assert load("some", "a") == bytes(8000)  # so it is no longer the oldest
    store("some", "d", bytes(8000))
    assert sorted(path.stem for path in (cache / "some").iterdir()) == ["a", "c", "d"]


# --- what is loaded -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "without"),
    [
        (["--version"], ("numpy", "lark", *ENGINES)),
        (["--help"], ("numpy", "lark", *ENGINES)),
        (["check", "examples/paper.pag"], ("numpy", "rich", *ENGINES)),
        (["build", "examples/paper.pag", "-o", "out"], UNUSED),
        (["run", "examples/paper.pag", "--units", "1"], UNUSED),
    ],
    ids=["version", "help", "check", "build", "run"],
)
def test_a_command_loads_what_it_needs(
    words: list[str], without: tuple[str, ...], cache: Path, tmp_path: Path
) -> None:
    words = [str(tmp_path / word) if word == "out" else word for word in words]
    found = imported(*words, cache=cache)
    assert "click" in found and not found & set(without)


@pytest.mark.parametrize(
    ("words", "command"),
    [
        (["check", "examples/paper.pag"], "factory.commands.check"),
        (["report", "--help"], "factory.apps.report.command_line.report"),
    ],
    ids=["check", "report"],
)
def test_only_the_command_that_is_called_is_loaded(
    words: list[str], command: str, cache: Path
) -> None:
    found = imported(*words, cache=cache)
    assert found & {place.partition(":")[0] for place in places().values()} == {command}
    assert "factory.apps.report" not in found


def test_boxes_are_checked_without_libraries_of_meshes(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "boxes.pag").write_text(BOXES)
    found = imported("check", tmp_path / "boxes.pag", cache=cache)
    assert "numpy" in found and not found & set(ENGINES)
    kept = [folder.name for folder in cache.iterdir()]
    assert kept == ["grammars"]  # what is computed at once is not kept


def test_meshes_that_are_known_are_checked_without_libraries(file: Path, cache: Path) -> None:
    """But for the edges of their bodies, which hands touch: SciPy finds those."""
    assert {"trimesh", "scipy"} <= imported("check", file, cache=cache)
    assert imported("check", file, cache=cache) & set(ENGINES) <= {"scipy"}


# --- what is done without a library does what the library does -----------------------------------

CELLS = st.text("ab cé漢[\t\x1b-", min_size=1, max_size=12).map(lambda t: f"x{t}y")


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 5).flatmap(lambda n: st.lists(st.tuples(*[CELLS] * n), min_size=1)))
def test_a_table_that_is_no_wider_than_its_room_is_that_of_rich(rows: list[Any]) -> None:
    columns = tuple(f"column {n}" for n in range(len(rows[0])))
    made = rich.table.Table(title="T", box=SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for column in columns:
        made.add_column(column)
    for row in rows:
        made.add_row(*(Text(one_line(cell)) for cell in row))
    console = Console(width=console_module.WIDTH, highlight=False)
    with console.capture() as expected:
        console.print(made)
    assert printed_table("T", columns, rows) == expected.get()


def printed_table(*table: Any) -> str:
    with redirect_stdout(StringIO()) as out:
        console_module.table(*table)
    return out.getvalue()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 150), min_size=1, max_size=6), st.sampled_from("a漢"))
def test_a_wide_table_is_folded_and_loses_nothing(sizes: list[int], letter: str) -> None:
    cells = tuple("b" + letter * size for size in sizes)
    lines = printed_table("", ("c",) * len(cells), [cells]).splitlines()
    assert all(cell_len(line) <= console_module.WIDTH for line in lines)
    assert Counter("".join(lines[3:]).replace(" ", "")) == Counter("".join(cells))


@given(st.text(st.sampled_from("<>&\"'\n\r\tab"), max_size=8))
def test_markup_is_that_of_the_standard_library(text: str) -> None:
    assert markup.escape(text) == saxutils.escape(text)
    assert markup.quoteattr(text) == saxutils.quoteattr(text)


@given(st.integers(1, 12), st.data())
def test_strong_components_are_those_of_scipy(size: int, data: st.DataObject) -> None:
    node = st.integers(0, size - 1)
    edges = data.draw(st.lists(st.tuples(node, node), max_size=24))
    before, after = np.array(edges, np.intp).reshape(-1, 2).T
    links = csr_array((np.ones(len(edges)), (before, after)), (size, size))
    expected = connected_components(links, connection="strong")[1]
    found = strong_components(size, before, after)
    assert ((found[:, None] == found) == (expected[:, None] == expected)).all()


@given(st.integers(0, 2**32 - 1))
def test_the_faces_of_a_box_are_those_of_its_hull(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half, turn = rng.uniform(1e-4, 1.0, 3), Rotation.random(rng=rng).as_matrix()
    corners = box_piece(half) @ turn.T + rng.uniform(-9, 9, 3)
    assert is_box(corners)
    a, b, c = corners[BOX_FACES].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    heights = ((corners[:, None] - a) * normals).sum(axis=2)
    assert (np.minimum(heights.max(axis=0), -heights.min(axis=0)) < 1e-9).all()
    area = np.linalg.norm(normals, axis=1).sum() / 2
    assert area == pytest.approx(ConvexHull(corners).area)
    moved = corners + 1e-6 * np.eye(8)[rng.integers(8)][:, None]
    assert not is_box(moved) and not is_box(corners[[1, 0, *range(2, 8)]])
    assert not is_box(corners[:7]) and not is_box(corners * [1, 1, 0])
