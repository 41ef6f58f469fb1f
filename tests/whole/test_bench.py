"""The report on the benchmarks is what its kept results say. The list of mutants, and what kills
them."""

from __future__ import annotations

import ast
import json
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benches import reporting
from benches.compare import manuals
from benches.compare.__main__ import REPORT as COMPARISON
from benches.covering import chosen, killers, listed
from benches.faults.__main__ import REPORT as FAULTS
from benches.fidelity import long_runs
from benches.mutants import LIST, wanted_of
from benches.reporting import Report
from benches.speed import processes
from benches.speed.__main__ import REPORT
from tests.paths import ROOT

KEPT = [
    (report, file)
    for report in (REPORT, FAULTS, COMPARISON)
    for file in report.folder.glob("*.json")
]


@pytest.mark.parametrize(("report", "file"), KEPT, ids=lambda it: getattr(it, "stem", ""))
def test_a_section_is_rendered_from_what_was_kept(report: Report, file: Path) -> None:
    assert file.stem in report.sections
    kept = json.loads(file.read_text())
    text = report.module(file.stem).section(kept["results"])
    assert text.startswith("## ")
    assert text in report.path.read_text()


@pytest.mark.parametrize(
    "report", [REPORT, FAULTS, COMPARISON], ids=lambda report: report.path.stem
)
def test_the_report_is_that_of_all_that_was_kept(report: Report) -> None:
    assert report.text() == report.path.read_text()


def test_a_process_that_fails_ends_the_bench_with_what_it_says() -> None:
    with pytest.raises(SystemExit, match=r"status 1\nwhy"):
        processes.run([sys.executable, "-c", "raise SystemExit('why')"])


def test_a_report_says_which_sections_are_older_than_the_physics(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measured now, then a timestep later: the page says so, and is no longer what is kept."""
    report = replace(REPORT, path=tmp_path / "bench.md", sections=("states", "proving"))
    for name in report.sections:
        kept = json.loads((REPORT.folder / f"{name}.json").read_text())
        report.folder.mkdir(exist_ok=True)
        kept["physics"] = reporting.physics() if name == "states" else "former"
        (report.folder / f"{name}.json").write_text(json.dumps(kept))
    report.write()
    text = report.path.read_text()
    assert "Out of date" in text.split("## ")[0] and "From PAG" in text.split("## ")[0]
    assert "Proofs against" not in text.split("## ")[0]
    monkeypatch.setattr(reporting, "physics", lambda: "another")
    assert "Proofs against" in report.text().split("## ")[0] and report.text() != text


@pytest.mark.parametrize(
    ("case", "file", "of_it"),
    [
        ("build lamp", "out/lamp.xml", True),
        ("run stool mujoco", "printed", True),
        ("jitter", "printed", True),
        ("check lamp", "printed", False),
        ("run stool ideal", "printed", False),
    ],
)
def test_a_digest_of_the_physics_is_of_models_and_runs(
    tmp_path: Path, case: str, file: str, of_it: bool
) -> None:
    kept = json.loads(reporting.ORACLE.read_text())
    kept[case][file] = "another"
    (tmp_path / "oracle.json").write_text(json.dumps(kept))
    assert (reporting.physics(tmp_path / "oracle.json") != reporting.physics()) == of_it


@pytest.mark.slow
def test_a_manual_is_read_as_a_tree_of_parts() -> None:
    """Parts that are equal count as one kind; a step may name what is joined already."""
    chair = {"parts_ct": 5, "geometric_equivalence_relation": {"1": ["2", "3"], "0,1": ["0,2"]}}
    kinds = manuals.kinds_of(chair)
    assert kinds == [0, 1, 1, 1, 4]
    whole = frozenset({(0, 1), (1, 3), (4, 1)})
    one_leg, two = frozenset({(0, 1), (1, 1)}), frozenset({(0, 1), (1, 2)})
    assert manuals.manual([["0", "3"], "1", "2", "4"], kinds) == {one_leg, whole}
    assert manuals.manual([["0,1", "2"], "3", "4"], kinds) == {two, whole}
    assert manuals.f1({one_leg, whole}, {one_leg, whole}) == 1.0
    assert manuals.f1({one_leg, whole}, {two, whole}) == 0.5


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


def test_a_drift_is_noticed() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-3, 200)
    steady = long_runs.compare((0.05 + noise).tolist(), 5, 1e-3)
    drifting = long_runs.compare((0.05 + noise + 5e-5 * np.arange(200)).tolist(), 5, 1e-3)
    assert steady["same"] and not drifting["same"]


def test_memory_that_grows_is_noticed() -> None:
    found = {
        "figures": {},
        "made": 1,
        "units": 1,
        "trouble": None,
        "refines_net": True,
        "contacts": 0,
        "warnings": 0,
        "growth_kib_a_unit": long_runs.growth([1e5 + 20.0 * n for n in range(100)]),
        "lost": [],
    }
    assert long_runs.faults(found) == ["memory grows by 20.0 KiB a unit"]


@pytest.mark.slow
def test_hundreds_of_units_do_not_drift() -> None:
    for run in long_runs.measure()["runs"]:
        assert long_runs.faults(run) == [], run


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
