"""A project is a PAG with all that follows from it; options travel as values with types."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace

import pytest

from factory.commands.requests import ProjectOptions
from factory.floor.layout.request import Ground
from factory.pipeline import read
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.problem.plan import Plan
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT

UNFIT = ((PAPER, "--fuse", "--world", "ideal"),)
"""Files and options that do not go together."""


@pytest.mark.parametrize("words", UNFIT, ids=lambda words: " ".join(map(str, words[1:])))
def test_options_that_do_not_go_together_are_refused_before_any_work(
    words: tuple[object, ...], run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: object) -> None:
        raise AssertionError("something was compiled")

    monkeypatch.setattr("factory.pipeline.compile_pag", work)
    done = run("run", *words, "--json")
    assert done.status == 2 and done.codes[0] in ("BadValue", "BadDemand", "Usage")


def test_no_plan_with_several_tours_gets_relays() -> None:
    project = read(PAPER).with_plan(Plan(turns=((0, 1, 2, 3, 4, 4),)))
    with pytest.raises(InputError, match="several tours"):
        project.with_ground(Ground(relay=True))
    with pytest.raises(InputError, match="several tours"):
        read(PAPER, ground=Ground(relay=True)).with_plan(project.plan)


def test_options_become_settings_and_ground() -> None:
    given = ProjectOptions(PAPER, speed=0.2, stage=True, floor="4x3", cycle=2.0)
    assert given.settings() == Settings(speed=0.2, stage=1)
    assert given.ground() == Ground((4.0, 3.0), False, 2.0)
    with pytest.raises(InputError, match="--floor takes two positive numbers"):
        replace(given, floor="4").ground()


def loose(text: str) -> Iterator[str]:
    """Parameters of functions that are dictionaries of anything."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.arg) and node.annotation is not None:
            words = ast.unparse(node.annotation)
            if words.startswith(("dict[str, Any]", "Mapping[str, Any]")):
                yield node.arg


def test_no_command_passes_a_dictionary_of_options() -> None:
    planted = "from typing import Any\ndef run(options: dict[str, Any]) -> None: ..."
    assert list(loose(planted)) == ["options"]
    for path in (ROOT / "factory" / "commands").glob("*.py"):
        assert not list(loose(path.read_text("utf-8"))), path.name
