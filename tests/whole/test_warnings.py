"""Warnings: a line a cause for people, all of them in the document of --json, and nothing beside
it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.commands.warnings import condensed
from factory.support.errors import Diagnostic
from tests.command_line import Terminal

OPENED, TURNED = 4, 2
LINES = [
    "BadMesh warning: 4 meshes are open: their convex hulls are used; list: -v",
    "BadMesh warning: 2 meshes were repaired: closed, or turned outwards; list: -v",
]
COMMANDS = (
    ("check",),
    ("build", "--mjcf", "OUT/m.xml"),
    ("run", "--world", "ideal"),
    ("analyze",),
    ("export", "--format", "urdf", "-o", "OUT/u"),
    ("report", "--units", 1, "-o", "OUT/r.html"),
    ("sweep", "--vary", "seed=0:2", "--world", "ideal", "-o", "OUT/s.db", "--jobs", 1),
)
FIDELITY = ("fidelity", "--units", 1, "--seeds", 1, "--jobs", 1)


def meshes(folder: Path) -> list[str]:
    """Files of boxes, all different, the first ones without a side, the others inside out."""
    for number in range(OPENED + TURNED):
        box = trimesh.creation.box((0.05, 0.05, 0.05 - 0.001 * number))
        if number < OPENED:
            box.update_faces(np.arange(len(box.faces)) < 10)
        else:
            box.invert()
        box.export(folder / f"{number}.obj")
    return [f"{number}.obj" for number in range(OPENED + TURNED)]


@pytest.fixture(scope="module")
def pag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("warned")
    parts = [
        f'p{n} = atomic ( mesh = "{name}", pos = ({0.05 * n:.2f}, 0, 0) );'
        for n, name in enumerate(meshes(folder))
    ]
    names = ", ".join(f"p{n}" for n in range(len(parts)))
    (folder / "x.pag").write_text("\n".join([f"root = x; x = mate ( {names} );", *parts]))
    return folder / "x.pag"


def words(pag: Path, folder: Path, command: Sequence[object]) -> list[object]:
    """A command about this PAG, that writes into a folder."""
    name, *options = (str(word).replace("OUT", str(folder)) for word in command)
    return [name, pag, *options]


@pytest.mark.parametrize(
    "command",
    [*COMMANDS, pytest.param(FIDELITY, marks=pytest.mark.slow)],
    ids=lambda command: command[0],
)
def test_a_cause_is_a_line_and_json_has_every_warning(
    run: Terminal, pag: Path, tmp_path: Path, command: Sequence[object]
) -> None:
    done = run(*words(pag, tmp_path, command))
    assert done.status == 0 and done.err.splitlines() == LINES
    (tmp_path / "json").mkdir()
    done = run(*words(pag, tmp_path / "json", command), "--json")
    assert done.err == ""
    found = done.json["warnings"]
    assert [w["code"] for w in found] == ["BadMesh"] * (OPENED + TURNED)
    assert [w["line"] for w in found] == [*range(2, 2 + OPENED + TURNED)]
    assert run(*words(pag, tmp_path, command), "-q").err == ""


def test_the_list_is_shown_if_asked_for(run: Terminal, pag: Path, tmp_path: Path) -> None:
    """And by a build that has been left out as well, as nothing has changed since."""
    for _ in range(2):
        done = run("build", pag, "--mjcf", tmp_path / "m.xml", "-v")
        assert done.err.count("is open (not watertight); its convex hull is used") == OPENED
        assert done.err.count("was inside out; it was repaired") == TURNED
    assert run("build", pag, "--mjcf", tmp_path / "m.xml").err.splitlines() == LINES


def test_import_counts_what_build_will_say(run: Terminal, tmp_path: Path) -> None:
    children = ", ".join(
        f'{{"part": "{name}", "at": [{0.05 * n:.2f}, 0, 0]}}'
        for n, name in enumerate(meshes(tmp_path))
    )
    (tmp_path / "t.json").write_text(f'{{"children": [{children}]}}')
    assert run("import", tmp_path / "t.json", "-o", tmp_path / "a").err.splitlines() == LINES
    done = run("import", tmp_path / "t.json", "-o", tmp_path / "b", "--json")
    assert done.err == "" and len(done.json["warnings"]) == OPENED + TURNED


def test_what_is_said_once_is_said_in_full() -> None:
    one, two = Diagnostic("A", "a is so", None, "h", "are so"), Diagnostic("B", "b")
    assert condensed([one, two, two], False) == [one, two, two]
    assert condensed([one, two, one], False) == [Diagnostic("A", "2 are so; list: -v"), two]
    assert condensed([one, two, one], True) == [one, two, one]
