"""A build is left out if and only if nothing has changed since the one before."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import Terminal

MESHED = """root = a;
a = mate(b, c);
b = atomic(mesh = "wing.stl", pos = (0, 0, 0.05));
c = atomic(box = (0.1, 0.1, 0.05), pos = (0, 0, 0.2))
"""


def lines(run: Terminal, *words: object) -> str:
    done = run("build", *words)
    assert done.status == 0, done.err
    return done.out


def again(text: str) -> bool:
    return "up to date" in text


@pytest.fixture
def product(tmp_path: Path) -> Path:
    """A product with a mesh of its own."""
    import trimesh

    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "wing.stl")
    (tmp_path / "p.pag").write_text(MESHED)
    return tmp_path / "p.pag"


def test_another_factory_toml_is_another_build(run: Terminal, product: Path) -> None:
    """Whatever it says: branches, lines, arms."""
    mjcf = product.parent / "m.xml"
    lines(run, product, "--mjcf", mjcf)
    (product.parent / "factory.toml").write_text("[parallel]\nb = 2\n")
    assert not again(lines(run, product, "--mjcf", mjcf))
    (product.parent / "factory.toml").unlink()
    assert not again(lines(run, product, "--mjcf", mjcf))
