"""The report on the benchmarks is what its kept results say."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.bench.__main__ import REPORT
from tests.bench.factories import laid_out, robots_at_least

KEPT = sorted(REPORT.folder.glob("*.json"))


@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_a_section_is_rendered_from_what_was_kept(file: Path) -> None:
    assert file.stem in REPORT.sections
    kept = json.loads(file.read_text())
    text = REPORT.module(file.stem).section(kept["results"])
    assert text.startswith("## ")
    assert text in REPORT.path.read_text()


@pytest.mark.skipif(not KEPT, reason="nothing was measured")
def test_the_report_is_that_of_all_that_was_kept() -> None:
    assert REPORT.text() == REPORT.path.read_text()


@pytest.mark.parametrize(("asked", "robots"), [(1, 1), (10, 11), (41, 41), (100, 101)])
def test_a_factory_has_the_robots_asked_for_or_one_more(asked: int, robots: int) -> None:
    assert len(laid_out(robots_at_least(asked)).factory.robots) == robots
