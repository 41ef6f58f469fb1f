"""Warnings: a line a cause for people, all of them in the document of --json, and nothing beside
it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.command_line import Terminal

OPENED, TURNED = 4, 2
LINES = [
    "BadMesh warning: 4 meshes are open: their convex hulls are used; list: -v",
    "BadMesh warning: 2 meshes were repaired: closed, or turned outwards; list: -v",
]


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


def test_the_list_is_shown_if_asked_for(run: Terminal, pag: Path, tmp_path: Path) -> None:
    """And by a build that has been left out as well, as nothing has changed since."""
    for _ in range(2):
        done = run("build", pag, "--mjcf", tmp_path / "m.xml", "-v")
        assert done.err.count("is open (not watertight); its convex hull is used") == OPENED
        assert done.err.count("was inside out; it was repaired") == TURNED
    assert run("build", pag, "--mjcf", tmp_path / "m.xml").err.splitlines() == LINES
