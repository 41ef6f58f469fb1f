"""The monitor on runs in which something failed: states between failures, and what was undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.calm import spells
from factory.apps.monitor.record import recorded_subject, verdict_on, watch_log
from factory.apps.recovery import Campaign, WorldFault
from factory.theory.nets.undone import Undone
from tests.failing_runs import CAMPAIGN, failing

SECOND = Campaign(
    (
        WorldFault("misplaced", label="part2", unit=2, metres=4e-3),
        *(WorldFault("bad_joint", label="sub1", unit=3, metres=2e-3) for _ in range(3)),
        WorldFault("down", robot="r2", unit=5),
    ),
    clear=2.0,
)


@pytest.fixture(scope="module", params=[CAMPAIGN, SECOND], ids=["drops", "scraps"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log", units=8, campaign=request.param)


def test_states_between_failures_are_judged(log: Log) -> None:
    report, subject = watch_log(log)
    assert report.violations == () and verdict_on(log, subject.factory, report).succeeded
    assert report.calm_s is not None and 1.0 < report.calm_s < log.time[-1]
    assert len(report.seen) > 10
    assert report.as_json()["judged_s"] == round(report.calm_s, 6)
    for firing in report.seen:  # counted as in the whole run
        times = [t for t, name in log.events if name == firing.transition]
        (t,) = (t for t in times if firing.earliest - 1e-6 <= t <= firing.latest + 1e-6)
        undone = [name for _, u in log.undone if u.t < t for name in u.transitions]
        assert firing.unit == times.index(t) - undone.count(firing.transition)


def test_spells_have_no_failure(log: Log) -> None:
    assert log.failures is not None
    factory = recorded_subject(log.header).factory
    found, last = [*spells(log, factory, model_of(log))], 0.0
    for begin, end in found:
        assert last <= begin < end
        assert not any(begin <= one.t <= end for one in log.failures.found)
        assert not any(begin <= undone.t <= end for _, undone in log.undone)
        last = end


def longest(log: Log) -> tuple[int, int]:
    """The rows of the longest spell."""
    factory = recorded_subject(log.header).factory
    begin, end = max(spells(log, factory, model_of(log)), key=lambda span: span[1] - span[0])
    return log.row_at(begin), log.row_at(end)


def test_a_robot_that_is_elsewhere_is_blamed(log: Log) -> None:
    """Planted: for half a second a part is away from the hand that holds it."""
    first, last = longest(log)
    qpos, middle = np.array(log.qpos), (first + last) // 2
    m = model_of(log)
    held = log.active[middle]
    body = next(b for b in held[:, 2].tolist() if m.body(b).name == "part/part3#1")
    address = m.jnt_qposadr[m.body_jntadr[body]]
    qpos[middle : middle + 50, address + 2] += 0.05
    report, _ = watch_log(replace(log, qpos=qpos))
    assert "Dropped" in {violation.code for violation in report.violations}


def test_a_firing_that_is_not_recorded_is_blamed(log: Log) -> None:
    first, last = longest(log)
    begin, end = float(log.time[first]), float(log.time[last - 1])
    ends = [n for n, (t, name) in enumerate(log.events) if begin < t < end and name == "part3_e"]
    kept = np.delete(np.arange(len(log.fired)), ends[0])
    undone = tuple((after - (after > ends[0]), one) for after, one in log.undone)
    bad = replace(log, fired=log.fired[kept], fired_t=log.fired_t[kept], undone=undone)
    report, _ = watch_log(bad)
    assert "Record" in {violation.code for violation in report.violations}


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
