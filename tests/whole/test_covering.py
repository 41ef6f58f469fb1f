"""The list of tests that `make test` leaves out."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterable

import numpy as np

from benches.covering import COVERED, chosen, killers, listed
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


def test_what_is_left_out_is_there() -> None:
    missing = gone(COVERED.read_text(encoding="utf-8").splitlines())
    assert not missing, "run `python -m benches.covering choose`, or take them off the list"


def test_what_killed_a_mutant_is_there() -> None:
    missing = gone(name for name in killers() if "::" in name)
    assert not missing, "run `python -m benches.mutants run ROOM --write now`"


def test_a_mutant_that_changes_nothing_is_not_run() -> None:
    mutants = tomllib.loads(LIST.read_text(encoding="utf-8"))["mutant"]
    equivalent = [one for one in mutants if "equivalent" in one]
    assert all(one["equivalent"] and not one["now"] for one in equivalent)
    assert wanted_of(equivalent, []) == [] and wanted_of(mutants, ["factory/floor/mating"])


def test_what_takes_most_new_branches_for_its_time_is_chosen() -> None:
    taken = {
        name: np.packbits(np.array(bits, bool))
        for name, bits in {
            "wide": [1] * 20 + [0] * 4,
            "inside": [1] * 10 + [0] * 14,
            "own": [0] * 18 + [1] * 6,
            "dear": [0] * 23 + [1],
        }.items()
    }
    cost = {"wide": 2.0, "inside": 1.5, "own": 0.5, "dear": 0.15}
    assert chosen(taken, cost) == {"wide", "own"}
    assert chosen({name: taken[name] for name in ("inside", "dear")}, cost) == {"inside", "dear"}
    assert chosen({"dear": taken["dear"]}, {"dear": 0.3}) == set()


def test_a_function_is_listed_once_where_none_of_its_cases_is_kept() -> None:
    out = {"a.py::one[1]", "a.py::one[2]", "a.py::two[1]"}
    assert listed(out, {"a.py::two[2]"}) == ["a.py::one", "a.py::two[1]"]
