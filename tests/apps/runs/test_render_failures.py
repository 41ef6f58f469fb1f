"""What films show of failures: robots that go back, what was undone, which stand, in words too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.apps.recovery.undo import marking_after, undo
from factory.engine.mjcf.replica import Replica
from factory.engine.record.failures import Death, Failing, deaths
from factory.engine.record.subject import MonitorSubject
from factory.film.caption import TOLD, Caption, draw_notices
from factory.film.gantt_panel import GanttPanel
from factory.film.history import History
from factory.film.ink import AMBER, DEAD, FLASH, Ink
from factory.film.marks import Mark, Marks
from factory.film.net_panel import NetPanel
from factory.film.sheet import Rows
from factory.film.shot import moment_of
from factory.support.settings import Settings
from factory.theory.nets.undone import Undone
from tests.failing_runs import failing, paper_layout
from tests.token_game import enabled, follower

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


def marking(history: History, time: float) -> frozenset[int]:
    gears = history.factory.net.gears
    return frozenset(g.places[history.at(r, time).step] for r, g in enumerate(gears))


def reddish(pixels: np.ndarray, colour: tuple[int, int, int], reach: int = 40) -> np.ndarray:
    return (np.abs(pixels.astype(int) - colour) < reach).all(axis=-1)


# Robots go back.


def test_tokens_are_where_the_log_has_its_marking(log: Log) -> None:
    history, panel = told(log), None
    assert history.undone
    panel = NetPanel(SIZE, 1.0, history, Rows(history))
    for row in range(0, len(log), 5):
        time = float(log.time[row])
        marked = frozenset(log.marking[row].tolist())
        assert marking(history, time) == marked
        gears = history.factory.net.gears
        active = dict(panel._active(time, log.qpos[row]))
        for robot, gear in enumerate(gears):
            place = int(panel.target(robot, time, active)) % len(gear.places)
            assert gear.places[place] in marked or history.at(robot, time).operation


def test_an_undo_left_out_would_be_noticed(log: Log) -> None:
    history = History(recorded_subject(log.header))
    firings = [entry for entry in log.timed_entries if not isinstance(entry[1], Undone)]
    history.catch_up(firings, np.inf)
    shown = [marking(history, t) for t in log.time.tolist()]
    assert shown != [frozenset(log.marking[row].tolist()) for row in range(len(log))]


@pytest.fixture(scope="module")
def subject():
    return MonitorSubject.of(paper_layout(), Settings())


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_after_any_undo_it_is_at_the_marking_of_the_counts(subject, data) -> None:
    factory = subject.factory
    net, history, fired = factory.net, History(subject), [0] * len(factory.net.threaded.transitions)
    now, time = net.initial_marking, 0.0
    for _ in range(data.draw(st.integers(1, 40))):
        time += 0.1
        done = [event for event, times in enumerate(fired) if times]
        if done and data.draw(st.integers(0, 4)) == 0:
            asked = data.draw(st.sampled_from(done))
            after = undo(net, fired, (asked,), factory.joins)
            what = time, "sub1", "lost"
            history.add(time, Undone.between(net, what, (asked,), fired, after))
            fired, now = [*after], marking_after(net, after)
        else:
            event = data.draw(st.sampled_from(sorted(enabled(net.threaded.net, now))))
            history.add(time, net.threaded.transitions[event].name)
            now = follower(net.threaded.net, now, [event])
            fired[event] += 1
        assert marking(history, time + 0.05) == now
        assert [history.counts(time + 0.05)[event] for event in range(len(fired))] == fired


def test_what_was_undone_is_marked_from_then_on(log: Log) -> None:
    history = told(log)
    lost = next(u for _, u in log.undone if u.reason == "lost")
    assert {"part2_s", "part2_e"} <= {*lost.transitions}
    spells = [spell for spell in history.spells[5] if spell.undone < np.inf and spell.operation]
    assert spells and all(spell.end <= spell.undone + 1e-6 for spell in spells)
    before, after = history.counts(lost.t - 1e-6), history.counts(lost.t)
    assert sum(before.values()) - sum(after.values()) == len(lost.transitions)


# What is drawn.


def test_the_gantt_hatches_what_was_undone_and_marks_robots_that_stand(log: Log) -> None:
    history = told(log)
    panel = GanttPanel(SIZE, 1.0, history, Rows(history))
    lost = next(one for one in history.failings if one.test == "lost")
    x = np.zeros(6)
    before, after = panel.draw(lost.t - 0.02, x, 0.0), panel.draw(lost.t + 0.3, x, 0.0)
    y = round(panel.sheet.height(panel.rows.shown[5]))
    row = slice(y - 8, y + 8)
    body = slice(round(panel.left), round(panel.right) - 4)
    hatched = reddish(after[row, body], FLASH)
    assert reddish(before[row, body], FLASH).sum() == 0 < 100 < hatched.sum()
    assert 5 in history.stands(lost.t + 0.3) and not history.stands(lost.t - 0.02)
    gutters = (drawn[row, : round(panel.left)] for drawn in (before, after))
    was, now = (int(reddish(gutter, (230, 190, 110), 45).sum()) for gutter in gutters)
    assert was == 0 and now > 100


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
        (Failing(1, "lost", "sub1", "r6", "scrap", ("part2",)), "r6 lost part2: made again"),
        (
            Failing(1, "rejected", "part1", "", "scrap", ("part1",)),
            "part1 is no good: taken back",
        ),
        (
            Failing(1, "misplaced", "part1", "", "scrap", ("part1",)),
            "part1 lies askew in its feeder: taken back",
        ),
        (Failing(1, "residual", "sub1", "", "again"), "sub1 does not fit: done again"),
        (
            Failing(1, "residual", "sub1", "", "scrap", ("part1", "part2")),
            "sub1 does not fit: part1, part2 made again",
        ),
        (
            Failing(1, "rejected", "look", "", "scrap", ("sub1",)),
            "look is rejected: sub1 made again",
        ),
        (
            Failing(1, "jammed", "part1", "r3", "spare", (), 31.0),
            "r3 is dead: a spare comes in 30 s",
        ),
        (Failing(1, "jammed", "part1", "r3", "no spare"), "r3 is dead: there is no spare"),
    ],
)
def test_a_failure_in_words(failing: Failing, words: str) -> None:
    assert str(failing) == words


def test_hatching_has_an_edge_and_stripes() -> None:
    pixels = np.zeros((40, 80, 3), np.uint8)
    Ink(pixels).hatched(10, 10, 70, 30, (200, 200, 200), 6.0)
    inside = pixels[12:28, 12:68, 0] > 100
    assert (pixels[10, 12:68, 0] > 150).all() and 0.1 < inside.mean() < 0.7
    assert not pixels[:9].any() and not pixels[32:].any()
    assert len({row.tobytes() for row in inside}) > 2  # the stripes rise


# What a log keeps.


def test_a_log_keeps_what_went_wrong(log: Log, tmp_path: Path) -> None:
    failures = log.failures
    assert failures is not None
    assert {one.test for one in failures.found} == {"lost", "rejected", "residual", "jammed"}
    dead = next(one for one in failures.found if one.test == "jammed")
    assert dead.until == pytest.approx(dead.t + 3.0)
    assert failures.spares == 1 and failures.stood


# Marks on the floor.


def marks_at(log: Log, time: float, history: History | None = None) -> list[Mark]:
    replica = Replica(model_of(log))
    moment = moment_of(log, log.row_at(time))
    replica.place(moment.shown.qpos)
    return [*Marks(replica, history or told(log)).at(moment.shown, moment.time)]


def test_robots_that_stand_are_marked_where_they_are(log: Log) -> None:
    assert log.failures is not None
    history, slid = told(log), 0
    for (start, names), (end, _) in zip(log.failures.stood, log.failures.stood[1:], strict=False):
        time = (start + end) / 2
        found = [mark for mark in marks_at(log, time) if mark.colour in (AMBER, DEAD)]
        assert len(found) == len(history.stands(time) | history.dead(time)) >= len(names)
        slid += len(found)
    assert slid


def test_a_dead_robot_is_dark_until_it_is_replaced(log: Log) -> None:
    history = told(log)
    death = next(one for one in history.failings if one.test == "jammed")
    assert death.until is not None
    for time, count in ((death.t - 0.1, 0), (death.t + 0.1, 1), (death.until + 0.1, 0)):
        assert [mark.colour for mark in marks_at(log, time)].count(DEAD) == count


def test_what_lies_about_has_a_zone_round_it(log: Log) -> None:
    history = told(log)
    drop = next(one for one in history.failings if one.test == "lost")
    zones = [mark for mark in marks_at(log, drop.t + 1.0) if mark.colour == FLASH]
    assert len(zones) == 1 and zones[0].radius > 0.02
    cleared = drop.t + 3.0  # it lies for 2 s
    assert FLASH not in [mark.colour for mark in marks_at(log, cleared)]


def test_a_run_in_which_nothing_failed_has_no_marks(log: Log) -> None:
    fresh = History(recorded_subject(log.header))
    assert not marks_at(log, 3.0, fresh)


# Robots that are replaced.


def test_a_death_ends_when_a_spare_takes_the_robots_place() -> None:
    spare = Failing(1.0, "jammed", "a", "r1", "spare", (), 11.0)
    alone = Failing(3.0, "jammed", "a", "r5", "no spare")
    other = Failing(4.0, "lost", "a", "r1", "scrap", ("a",))
    found = deaths([spare, alone, other])
    assert found == [Death("r1", 1.0, 11.0), Death("r5", 3.0, np.inf)]
    assert found[0].then == "a spare is in the place of r1"


def test_a_history_tells_which_robots_were_replaced(log: Log) -> None:
    history = told(log)
    death = next(one for one in history.failings if one.test == "jammed")
    assert history.deaths() == [Death("r2", death.t, death.until)]


def test_the_gantt_chart_has_a_dark_band_until_the_spare_comes(log: Log) -> None:
    history = told(log)
    (one,) = history.deaths()
    panel = GanttPanel(SIZE, 1.0, history, Rows(history, 300.0))
    slides = np.zeros(len(history.factory.robots))
    before, during = (
        panel.draw(t, slides, 0.0).astype(int).sum(axis=2) for t in (one.start, one.end)
    )
    assert (during < 480).mean() > (before < 480).mean() + 0.01


def test_a_spare_is_told_of_when_it_comes(log: Log) -> None:
    history, caption = told(log), Caption(SIZE)
    (death,) = history.deaths()
    dark = []
    for time in (death.end - 0.05, death.end + 0.05):
        pixels = np.full((SIZE[1], SIZE[0], 3), 255, np.uint8)
        draw_notices(pixels, history, time, caption)
        dark.append(reddish(pixels, DEAD, 8).any())
    assert dark == [False, True]


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
