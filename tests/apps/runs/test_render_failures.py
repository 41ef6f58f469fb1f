"""What films show of failures: robots that go back, what was undone, which stand, in words too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.engine.mjcf.replica import Replica
from factory.engine.record.failures import Failing
from factory.engine.record.subject import MonitorSubject
from factory.film.caption import TOLD, Caption, draw_notices
from factory.film.colours import AMBER, DEAD
from factory.film.gantt_panel import GanttPanel
from factory.film.history import History
from factory.film.marks import Mark, Marks
from factory.film.sheet import Rows
from factory.film.shot import moment_of
from factory.support.pictures.ink import FLASH
from factory.support.settings import Settings
from tests.failing_runs import failing, paper_layout

SIZE = (640, 400)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log")


def told(log: Log) -> History:
    history = History(recorded_subject(log.header))
    history.catch_up(log.timed_entries, np.inf)
    assert log.failures is not None
    history.failings += log.failures.found
    history.stand(log.failures.stood)
    return history


def reddish(pixels: np.ndarray, colour: tuple[int, int, int], reach: int = 40) -> np.ndarray:
    return (np.abs(pixels.astype(int) - colour) < reach).all(axis=-1)


@pytest.fixture(scope="module")
def subject():
    return MonitorSubject.of(paper_layout(), Settings())


def test_what_was_undone_is_marked_from_then_on(log: Log) -> None:
    history = told(log)
    lost = next(u for _, u in log.undone if u.reason == "lost")
    assert {"part2_s", "part2_e"} <= {*lost.transitions}
    spells = [spell for spell in history.spells[5] if spell.undone < np.inf and spell.operation]
    assert spells and all(spell.end <= spell.undone + 1e-6 for spell in spells)
    before, after = history.counts(lost.t - 1e-6), history.counts(lost.t)
    assert sum(before.values()) - sum(after.values()) == len(lost.transitions)


def test_a_run_without_failures_has_none_of_it(subject) -> None:
    history = History(subject)
    pixels = np.full((400, 640, 3), 200, np.uint8)
    draw_notices(pixels, history, 1.0, Caption(SIZE))
    assert (pixels == 200).all()
    panel = GanttPanel(SIZE, 1.0, history, Rows(history)).draw(1.0, np.zeros(6), 0.0)
    assert not reddish(panel[:, :500], AMBER, 20).any()


def test_a_caption_says_for_some_seconds_what_failed(subject) -> None:
    history, caption = History(subject), Caption(SIZE)
    history.failings.append(Failing(2.0, "lost", "sub1", "r6", "scrap", ("part2",)))
    seen = {}
    for time in (1.9, 2.0 + TOLD / 2, 2.0 + TOLD + 2):
        pixels = np.full((400, 640, 3), 120, np.uint8)
        draw_notices(pixels, history, time, caption)
        seen[time] = int((pixels != 120).any(axis=-1).sum())
    assert [bool(changed) for changed in seen.values()] == [False, True, False]


@pytest.mark.parametrize(
    ("failing", "words"),
    [
        (
            Failing(1, "misplaced", "part1", "", "scrap", ("part1",)),
            "part1 lies askew in its feeder: taken back",
        ),
        (Failing(1, "jammed", "part1", "r3", "no spare"), "r3 is dead: there is no spare"),
    ],
)
def test_a_failure_in_words(failing: Failing, words: str) -> None:
    assert str(failing) == words


def test_a_log_keeps_what_went_wrong(log: Log, tmp_path: Path) -> None:
    failures = log.failures
    assert failures is not None
    assert {one.test for one in failures.found} == {"lost", "rejected", "residual", "jammed"}
    dead = next(one for one in failures.found if one.test == "jammed")
    assert dead.until == pytest.approx(dead.t + 3.0)
    assert failures.spares == 1 and failures.stood


def marks_at(log: Log, time: float, history: History | None = None) -> list[Mark]:
    replica = Replica(model_of(log))
    moment = moment_of(log, log.row_at(time))
    replica.place(moment.shown.qpos)
    return [*Marks(replica, history or told(log)).at(moment.shown, moment.time)]


def test_what_lies_about_has_a_zone_round_it(log: Log) -> None:
    history = told(log)
    drop = next(one for one in history.failings if one.test == "lost")
    zones = [mark for mark in marks_at(log, drop.t + 1.0) if mark.colour == FLASH]
    assert len(zones) == 1 and zones[0].radius > 0.02
    cleared = drop.t + 3.0  # it lies for 2 s
    assert FLASH not in [mark.colour for mark in marks_at(log, cleared)]


def test_the_gantt_chart_has_a_dark_band_until_the_spare_comes(log: Log) -> None:
    history = told(log)
    (one,) = history.deaths()
    panel = GanttPanel(SIZE, 1.0, history, Rows(history, 300.0))
    slides = np.zeros(len(history.factory.robots))
    before, during = (
        panel.draw(t, slides, 0.0).astype(int).sum(axis=2) for t in (one.start, one.end)
    )
    assert (during < 480).mean() > (before < 480).mean() + 0.01


def test_a_robot_is_said_to_be_dead_for_as_long_as_it_is(subject) -> None:
    history, caption, seen = History(subject), Caption(SIZE), []
    history.failings.append(Failing(2.0, "jammed", "sub1", "r6", "spare", (), 30.0))
    history.stand([(1.0, ("r6",))])
    for time in (1.5, 2.5, 20.0, 30.1, 40.0):
        pixels = np.full((SIZE[1], SIZE[0], 3), 255, np.uint8)
        draw_notices(pixels, history, time, caption)
        found = (FLASH, AMBER, DEAD)
        seen.append([bool((pixels == colour).all(axis=-1).any()) for colour in found])
    told, stands, dead = zip(*seen, strict=True)
    assert told == (False, True, False, False, False)
    assert stands == (True, False, False, True, True), "what is dead does not merely stand"
    assert dead == (False, False, True, True, False)
