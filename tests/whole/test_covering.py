"""The list of mutants, and what kills them."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterable

from benches.covering import killers
from benches.mutants import LIST, wanted_of
from tests.paths import ROOT


def gone(tests: Iterable[str]) -> set[str]:
    """Those of some tests whose functions are not there."""
    names = {name.split("[")[0] for name in tests}
    files = {name.split("::")[0] for name in names}
    there = {
        f"{file}::{node.name}"
        for file in files
        for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    return names - there


def test_what_killed_a_mutant_is_there() -> None:
    missing = gone(name for name in killers() if "::" in name)
    assert not missing, "run `python -m benches.mutants run ROOM --write now`"


def test_a_mutant_that_changes_nothing_is_not_run() -> None:
    mutants = tomllib.loads(LIST.read_text(encoding="utf-8"))["mutant"]
    equivalent = [one for one in mutants if "equivalent" in one]
    assert all(one["equivalent"] and not one["now"] for one in equivalent)
    assert wanted_of(equivalent, []) == [] and wanted_of(mutants, ["factory/floor/mating"])
