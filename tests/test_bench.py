"""The report on the benchmarks is what its kept results say."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import pytest

from tests.bench.__main__ import FOLDER, REPORT, SECTIONS, report
from tests.bench.factories import laid_out, robots_at_least

KEPT = sorted(FOLDER.glob("*.json"))


@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_a_section_is_rendered_from_what_was_kept(file: Path) -> None:
    assert file.stem in SECTIONS
    kept = json.loads(file.read_text())
    text = import_module(f"tests.bench.{file.stem}").section(kept["results"])
    assert text.startswith("## ")
    assert text in REPORT.read_text()


@pytest.mark.skipif(not KEPT, reason="nothing was measured")
def test_the_report_is_that_of_all_that_was_kept() -> None:
    assert report() == REPORT.read_text()


@pytest.mark.parametrize(("asked", "robots"), [(1, 1), (10, 11), (41, 41), (100, 101)])
def test_a_factory_has_the_robots_asked_for_or_one_more(asked: int, robots: int) -> None:
    assert len(laid_out(robots_at_least(asked)).factory.robots) == robots
