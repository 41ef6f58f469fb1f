"""The source distribution holds what its Makefile, its pages and its tests need."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.paths import ROOT

MADE = {"renders", "dist", "build"}
"""Folders that are made by what is called, or only written to; so are those with a full stop in
front."""


def included() -> set[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return {*project["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]}


def mentioned(makefile: str) -> set[str]:
    """The first folder, or the file, of each path of the checkout that a Makefile's recipes name;
    modules that it runs count as theirs."""
    recipes = "\n".join(line for line in makefile.splitlines() if line.startswith("\t"))
    recipes = re.sub(r"@echo .*", "", recipes)
    words = re.findall(r"(?<![\w./-])[\w.]+(?:/[\w./-]+)?", recipes)
    words += [word.replace(".", "/") for word in re.findall(r"-m ([\w.]+)", recipes)]
    tops = {word.partition("/")[0] for word in words}
    return there(tops)


def there(names: set[str]) -> set[str]:
    """Those that are in the checkout, and not made there."""
    return {n for n in names if (ROOT / n).exists() and n[0] != "." and n not in MADE}


def test_what_the_makefile_calls_is_in_it() -> None:
    named = mentioned((ROOT / "Makefile").read_text("utf-8"))
    assert {"tools", "examples", "benches", "docs", "factory", "tests"} <= named
    assert named <= included()


def test_a_folder_that_is_not_in_it_is_found() -> None:
    assert mentioned("x:\n\t@mjcf/thing $(A)\n\tpython -m templates.x\n") == {"mjcf", "templates"}


@pytest.mark.parametrize("name", sorted(included()))
def test_what_is_in_it_is_there(name: str) -> None:
    assert (ROOT / name).exists()


def test_what_tests_read_is_in_it() -> None:
    """Folders of the checkout, as tests name them: `ROOT / "folder"`."""
    texts = (path.read_text("utf-8") for path in Path(ROOT, "tests").rglob("*.py"))
    named = {name for text in texts for name in re.findall(r'ROOT / "([\w.]+)"', text)}
    assert {"docs", "examples"} <= named
    assert there(named) <= included() | {"pyproject.toml"}
