"""Bins: clear of all regions, and what is scrap falls into them for real."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.apps.deviations import Deviation
from factory.commands.summaries import say_failures
from factory.engine.record.failures import Failures
from tests.apps.recovery.test_recovery import assert_recovered, run_with

SLIPS = tuple(Deviation("bad_joint", label="sub1", unit=2, metres=2e-3) for _ in range(3))
"""Done again twice, then the inputs are scrapped."""


def test_scrap_falls_into_its_bin() -> None:
    run, failures = run_with(*SLIPS, jitter=0.3)
    assert_recovered(run, failures, {"bad_joint": 3})
    assert failures.found[-1].scrapped == ("part1", "part2")
    assert (failures.binned, failures.spilled) == (2, ())


@pytest.mark.parametrize(("spilled", "words"), [((), "scrap in bins: 3\n")])
def test_bins_are_told_in_words(
    capsys: pytest.CaptureFixture[str], spilled: tuple[str, ...], words: str
) -> None:
    say_failures(replace(Failures(), binned=3, spilled=spilled), False)
    assert words in "".join(capsys.readouterr())
