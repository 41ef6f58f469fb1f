"""What `check` does not do twice, and what it does not do at all: counted, not timed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any
from xml.sax import saxutils

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Lark
from rich.cells import cell_len

from factory.apps.drawing import markup
from factory.commands import places
from factory.floor.geometry import meshes
from factory.floor.layout import embedding, kept_layouts
from factory.floor.layout.kept_layouts import MANY, kept_or
from factory.floor.layout.saved import LayoutTable
from factory.floor.mating.finder import Finder
from factory.pipeline import read as read_project
from factory.support import console as console_module
from factory.support.cache import content, digest, load, store
from factory.support.files import user_cache
from factory.support.tables import table_of
from factory.theory.lang import pag_syntax
from factory.theory.lang.recovery import open_grammar
from tests.command_line import Terminal
from tests.paths import PAPER

TWO = """root = s; s = mate ( a, b );
a = atomic ( mesh = "a.stl" ); b = atomic ( mesh = "b.stl", pos = (0, 0, 0.1){more} )"""

BOXES = """root = s; s = mate ( a, b );
a = atomic ( box = (0.1, 0.1, 0.1) ); b = atomic ( box = (0.1, 0.1, 0.1), pos = (0, 0, 0.1) )"""

ASIDE = ("factory.apps.foreign_nets", "networkx")
"""What the main road, of nets that were compiled, does without."""

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


def written(folder: Path, more: str = "", text: str = TWO) -> Path:
    path = folder / "two.pag"
    path.write_text(text.replace("{more}", more))
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


def test_a_mesh_that_changed_is_measured_again(
    run: Terminal, file: Path, work: dict[str, int]
) -> None:
    run("check", file)
    trimesh.creation.box((0.1, 0.1, 0.1)).export(file.parent / "b.stl")
    run("check", file)
    assert work["measured"] == 3


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


@pytest.mark.parametrize(
    ("words", "without"),
    [
        (["--version"], ("numpy", "lark", *ENGINES)),
        (["--help"], ("numpy", "lark", *ENGINES)),
        (["check", "examples/paper.pag"], ("numpy", "rich", *ENGINES, *ASIDE)),
        (["build", "examples/paper.pag", "-o", "out"], (*UNUSED, *ASIDE)),
        (["run", "examples/paper.pag", "--units", "1"], (*UNUSED, *ASIDE)),
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


def test_a_layout_is_searched_once(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is read back is what was found, to the last bit; what is damaged is found again."""

    def laid(path: Path) -> tuple[object, ...]:
        project = read_project(path)
        layout = project.layout
        return (
            table_of(LayoutTable.of(layout)),
            layout.certificate,
            layout.floor,
            project.hands.travels,
        )

    labels = [f"p{n}" for n in range(MANY)]
    parts = "".join(f"{label} = atomic ( mass = 1 );\n" for label in labels)
    text = f"root = s; s = mate ( {', '.join(labels)} );\n{parts}"
    file = written(tmp_path, text=text)
    monkeypatch.setattr(kept_layouts, "kept_or", kept_or)
    found, searched = laid(file), embedding.drafted
    monkeypatch.setattr(embedding, "drafted", None)
    assert laid(file) == found
    with pytest.raises(TypeError):
        laid(written(tmp_path, text=text.replace("mass = 1", "mass = 2", 1)))
    written(tmp_path, text=text)
    (entry,) = (cache / "layouts").iterdir()
    entry.write_bytes(entry.read_bytes()[:-1] + b" ")
    with pytest.raises(TypeError):
        laid(file)
    monkeypatch.setattr(embedding, "drafted", searched)
    assert laid(file) == found


@dataclass(frozen=True)
class Pair:
    """A value with two fields that are compared, and one that is not."""

    one: object
    other: object
    note: str = field(default="", compare=False)


def test_what_differs_has_another_digest() -> None:
    two, three = np.arange(2), np.arange(3)
    differing = [
        *(Pair(1, 2), Pair(2, 2), Pair(1, 3), Pair(Pair(1, 2), 3), Pair(1, 1.0), Pair(1, True)),
        *("a", 1, 1.0, True, None, two, three, two.astype(float), two.reshape(1, 2)),
        *((), ("a",), ("a", 1), (("a", 1),), ("a", (1,)), (two,), (three,)),
        *({}, {"a": 1}, {"a": 2}, {"a": (1,)}, frozenset({"a"}), frozenset({"a", "b"})),
    ]
    assert len({digest(content(value)) for value in differing}) == len(differing)
    assert content(Pair(1, two)) == content(Pair(1, np.arange(2), "noted"))
    assert content(["a", {1, 2}]) == content(("a", frozenset({2, 1})))


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


def test_a_net_from_elsewhere_needs_its_room(tmp_path: Path, cache: Path) -> None:
    net = tmp_path / "paper.pnml"
    assert not imported("export", PAPER, "--format", "pnml", "-o", net, cache=cache) & {*ASIDE}
    assert imported("check", net, cache=cache) >= {*ASIDE}


def test_no_library_reports_what_the_end_of_the_process_takes() -> None:
    """Volumes that are in a cycle of references are no leak."""
    code = (
        "from manifold3d import Manifold; kept = [Manifold.cube()]; kept.append(kept)\n"
        "from factory.commands import main; main(['--version'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout
