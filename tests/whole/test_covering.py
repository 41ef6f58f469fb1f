"""The tool that says which tests bring nothing of their own."""

from __future__ import annotations

import numpy as np

from benches.covering import chosen, listed


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
