"""The report on the benchmarks is what its kept results say."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benches import reporting
from benches.compare.__main__ import REPORT as COMPARISON
from benches.faults.__main__ import REPORT as FAULTS
from benches.reporting import Report
from benches.speed import large, processes
from benches.speed.__main__ import REPORT

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
        now = {"physics": reporting.physics()} if name == "states" else {}
        (report.folder / f"{name}.json").write_text(json.dumps(kept | now))
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
@pytest.mark.skipif(not large.BRICKS.is_dir(), reason="the LDraw products are not here")
def test_the_import_of_a_large_product_is_measured() -> None:
    (row,) = large.measure(quick=True)["rows"]
    assert row["command"] == "import" and row["said"]["parts"] == 1253
