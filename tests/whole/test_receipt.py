"""A build is left out if and only if nothing has changed since the one before."""

from __future__ import annotations

from pathlib import Path

import pytest

from factory.apps.exports.binary import beside
from factory.support.extensions import extensions
from tests.command_line import Terminal
from tests.paths import PAPER
from tests.plug_in import write_package


def lines(run: Terminal, *words: object) -> str:
    done = run("build", *words)
    assert done.status == 0, done.err
    return done.out


def again(text: str) -> bool:
    return "up to date" in text


def test_a_package_that_changed_is_built_with(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """One that is installed: its operation, its law, its robot type."""
    write_package(tmp_path, installed=True, name="gluing2")
    monkeypatch.syspath_prepend(tmp_path)
    request.addfinalizer(extensions.cache_clear)
    assert not again(lines(run, PAPER, "-o", tmp_path / "x"))
    for name in ("dab.op", "laws.py", "dabber.xml", "catalogue.toml"):
        assert again(lines(run, PAPER, "-o", tmp_path / "x"))
        (file,) = (tmp_path / "gluing2").rglob(name)
        file.write_text(file.read_text() + "\n")
        assert not again(lines(run, PAPER, "-o", tmp_path / "x")), name


def test_no_binary_lies_beside_a_device_or_upon_the_mjcf(tmp_path: Path) -> None:
    assert beside(Path("/dev/null")) is None
    assert beside(tmp_path) is None
    assert beside(tmp_path / "m.xml") == tmp_path / "m.mjb"
    assert beside(tmp_path / "m.mjb") == tmp_path / "m.mjb.mjb"
