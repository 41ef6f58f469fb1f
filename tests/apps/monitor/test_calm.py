"""The monitor on runs in which something failed: states between failures, and what was undone."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.calm import spells
from factory.apps.monitor.record import recorded_subject, verdict_on, watch_log
from factory.theory.nets.undone import Undone
from tests.failing_runs import CAMPAIGN, failing

SECOND = Campaign(
    (
        Deviation("misplaced", label="part2", unit=2, metres=4e-3),
        *(Deviation("bad_joint", label="sub1", unit=3, metres=2e-3) for _ in range(3)),
        Deviation("down", robot="r2", unit=5),
    ),
    clear=2.0,
)


@pytest.fixture(scope="module", params=[CAMPAIGN, SECOND], ids=["drops", "scraps"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log", units=8, campaign=request.param)


def test_spells_have_no_failure(log: Log) -> None:
    assert log.failures is not None
    factory = recorded_subject(log.header).factory
    found, last = [*spells(log, factory, model_of(log))], 0.0
    for begin, end in found:
        assert last <= begin < end
        assert not any(begin <= one.t <= end for one in log.failures.found)
        assert not any(begin <= undone.t <= end for _, undone in log.undone)
        last = end


@pytest.mark.parametrize("change", ["more", "less", "other"])
def test_an_undo_that_is_not_the_least_is_caught(log: Log, change: str) -> None:
    """By the replay of the record, whatever the states say."""
    after, undone = log.undone[0]
    names = undone.transitions
    planted = {
        "more": (*names, "part3_s"),
        "less": names[1:],
        "other": ("part3_s", "part3_e", *names[2:]),
    }[change]
    wrong = replace(undone, transitions=planted)
    assert isinstance(wrong, Undone)
    bad = replace(log, undone=((after, wrong), *log.undone[1:]))
    report, subject = watch_log(bad)
    assert not verdict_on(bad, subject.factory, report).succeeded
