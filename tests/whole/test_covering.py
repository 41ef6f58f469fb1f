"""The list of tests that `make test` leaves out."""

from __future__ import annotations

import ast

import numpy as np

from benches.covering import COVERED, chosen, listed
from tests.paths import ROOT


def test_what_is_left_out_is_there() -> None:
    names = {name.split("[")[0] for name in COVERED.read_text(encoding="utf-8").splitlines()}
    files = {name.split("::")[0] for name in names}
    there = {
        f"{file}::{node.name}"
        for file in files
        for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert not names - there, "run `python -m benches.covering choose`, or take them off the list"


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
