"""Every figure of fidelity against known values, and against planted faults."""

from __future__ import annotations

import json
from pathlib import Path

from factory.apps.fidelity import QUANTITIES
from tests.command_line import Terminal
from tests.paths import PAPER


def test_the_command_prints_figures(run: Terminal, out: Path) -> None:
    words = (PAPER, "--seeds", 1, "--jobs", 1)
    done = run("fidelity", *words, "--json", "-o", out / "figures.json")
    assert done.status == 0
    assert done.json["passed"] is True
    assert done.json["figures"]["handoffs"]["worst"] == 44
    assert {**json.loads((out / "figures.json").read_text()), "warnings": []} == done.json
    told = run("fidelity", *words, "--units", 1, "-v")
    assert told.status == 0
    assert "handoff_gap_max_mm" in told.out
    assert "all runs passed" in told.out
    for key, quantity in QUANTITIES.items():
        assert f"{key} [{quantity.unit}]: {quantity.definition}" in told.out


def test_a_run_that_fails_gives_status_1(run: Terminal) -> None:
    done = run("fidelity", PAPER, "--seeds", 1, "--jobs", 1, "--units", 1, "--max-time", 1)
    assert done.status == 1
    assert "Timeout" in done.err
    assert "SOME RUN FAILED" in done.out


def test_what_cannot_be_written_is_refused_before_anything_runs(run: Terminal, out: Path) -> None:
    done = run("fidelity", PAPER, "-o", out, "--json")
    assert done.status == 2
    assert done.codes == ["BadFile"]
    assert run("fidelity", PAPER, "--seeds", 0).status == 2
