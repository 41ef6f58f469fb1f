"""Robots whose deputies took over are gone: in what a record tells, in pictures, on the pages."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from factory.compiler.deputies import deputies
from factory.compiler.taking_over import Takeover
from factory.mjcf.replica import Replica
from factory.nets.undo import tokens_after
from factory.nets.undone import Undone
from factory.record.failures import Death, Failing, deaths, gone
from factory.record.log import Log
from factory.record.log.model import model_of
from factory.record.monitor.record import recorded_subject
from factory.rendering.caption import Caption, draw_notices
from factory.rendering.history import History
from factory.rendering.ink import DEAD
from factory.rendering.marks import LeftOut
from factory.rendering.net_panel import NetPanel
from factory.rendering.sheet import Rows
from factory.show.report.failures import failures_data
from factory.show.report.recording import recording_of
from factory.simulation.recovery import Campaign, WorldFault
from factory.support.engine import mujoco
from tests.failing_runs import failing
from tests.pag_values import catalogue
from tests.test_deputies import made, randoms, seeds
from tests.test_takeovers import laid_out
from tests.token_game import enabled, follower

DEAD_R4 = Campaign((WorldFault("dead", robot="r4", at=7.0),), swap=4.0)


def exchanged(t: float, dead: str, deputy: str) -> Undone:
    """An entry in which a deputy takes over."""
    return Undone(t, "sub", "jammed", (), (), True, (dead, deputy))


# --- what a record tells --------------------------------------------------------------------------


def test_who_is_gone_follows_from_the_entries_and_a_time() -> None:
    lost = Undone(3.0, "sub", "lost", ("a_e",), ("a_e",))
    entries = ["a_s", lost, exchanged(5.0, "r4", "r3"), "a_s", exchanged(9.0, "r3", "r2")]
    found = [gone(entries, time) for time in (4.9, 5.0, 9.0)]
    assert found == [{}, {"r4": "r3"}, {"r4": "r3", "r3": "r2"}] and found[-1] == gone(entries)


def test_a_death_ends_when_something_takes_the_robots_place() -> None:
    """A deputy that is only announced has not taken over."""
    spare = Failing(1.0, "jammed", "a", "r1", "spare", (), 11.0)
    deputy = Failing(2.0, "jammed", "a", "r4", "deputy", (), 12.0, "r3")
    alone = Failing(3.0, "jammed", "a", "r5", "no spare")
    other = Failing(4.0, "lost", "a", "r1", "scrap", ("a",))
    found = [spare, deputy, alone, other]
    ends = [one.end for one in deaths(found, [])]
    assert ends == [11.0, np.inf, np.inf]
    after = deaths(found, ["a_s", exchanged(12.5, "r4", "r3"), exchanged(20.0, "r3", "r4")])
    assert after[1] == Death("r4", 2.0, 12.5, "r3")
    assert after[1].then == "r4 is gone: r3 does its tours"
    assert after[0].then == "a spare is in the place of r1"


@settings(max_examples=150)
@given(seeds, randoms)
def test_a_deputy_leads_to_markings_of_the_net_of_before(seed: int, rng: random.Random) -> None:
    """So pages and films go on with the net that they draw: each gear keeps its token."""
    _, _, before = made(seed, rng, 20)
    pairs = [(dead, row[0]) for dead, row in enumerate(deputies(before, catalogue())) if row]
    for dead, deputy in pairs[:2]:
        net = Takeover(before, dead, deputy).after.net
        marking, fired = net.initial_marking, [0] * len(net.threaded.transitions)
        for _ in range(80):
            event = rng.choice(sorted(enabled(net.threaded.net, marking)))
            marking, fired[event] = follower(net.threaded.net, marking, [event]), fired[event] + 1
            tokens = tokens_after(before.net, fired)
            assert {*tokens} <= {0, 1}
            assert all(sum(tokens[p] for p in gear.places) == 1 for gear in before.net.gears)


# --- a run in the engine --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log in which robot r4 dies and r2 takes over."""
    path = tmp_path_factory.mktemp("gone") / "log"
    failing(path, units=8, campaign=DEAD_R4, layout=laid_out())
    return path


@pytest.fixture(scope="module")
def log(file: Path) -> Log:
    from factory.record.log import read_log

    return read_log(file)


@pytest.fixture(scope="module")
def history(log: Log) -> History:
    assert log.failures is not None
    told = History(recorded_subject(log.header))
    told.failings += log.failures.found
    told.stand(log.failures.stood)
    told.catch_up(log.timed_entries, np.inf)
    return told


def test_the_history_tells_who_is_gone(log: Log, history: History) -> None:
    (change,) = (undone for _, undone in log.undone if undone.robots)
    assert change.robots == ("r4", "r2") and change.t < log.time[-1] - 3.0
    dead = history.index["r4"]
    assert [history.gone(change.t + d) for d in (-0.01, 0.0)] == [{*()}, {dead}]
    assert [history.dead(change.t + d) for d in (-0.01, 0.01)] == [{dead}, {*()}]
    (death,) = history.deaths()
    assert (death.end, death.deputy) == (change.t, "r2")


def test_tours_are_shown_with_the_robot_that_does_them(log: Log, history: History) -> None:
    (change,) = history.exchanges
    dead, deputy = (history.index[name] for name in change.robots)
    late = change.t + 0.1
    assert not [spell for _, spell in history.done(dead, late) if spell.start > change.t]
    tours = {tour for tour, spell in history.done(deputy, late) if spell.operation}
    assert tours == {dead, deputy}
    early = {tour for tour, spell in history.done(deputy, 0.0) if spell.end < change.t - 0.1}
    assert early == {deputy}
    busy = sorted(
        (spell.start, spell.end) for _, spell in history.done(deputy, late) if spell.operation
    )
    assert all(one[1] <= then[0] + 1e-6 for one, then in pairwise(busy))


def test_tokens_go_on_with_the_deputy(log: Log, history: History) -> None:
    """An operation of a robot that is gone is done where its deputy is."""
    (change,), net = history.exchanges, NetPanel((900, 700), 1.0, history, Rows(history))
    dead = history.index["r4"]
    slides = [model_of(log).joint(f"r{n + 1}/slide").qposadr[0] for n in range(4)]
    ends = []
    for spell in history.since(dead, change.t + 1.0):
        if spell.operation and spell.end < log.time[-1]:
            row = log.row_at(spell.end - 0.005)
            active = dict(net._active(float(log.time[row]), log.qpos[row][slides]))
            number = history.factory.robots[dead].operations[spell.step // 2]
            ends.append(active[number][0])
    assert len(ends) > 3 and min(ends) > 0.95


def drawn(replica: Replica) -> set[str]:
    """The geoms that a picture of a replica has, by name; no GL is needed to know."""
    m, scene = replica.m, mujoco.MjvScene(replica.m, maxgeom=replica.m.ngeom + 10)
    every, free = mujoco.mjtCatBit.mjCAT_ALL.value, mujoco.MjvCamera()
    mujoco.mjv_updateScene(m, replica.d, mujoco.MjvOption(), None, free, every, scene)
    kind = mujoco.mjtObj.mjOBJ_GEOM.value
    return {m.geom(g.objid).name for g in scene.geoms[: scene.ngeom] if g.objtype == kind}


def test_pictures_leave_out_who_is_gone_but_for_its_rail(log: Log, history: History) -> None:
    replica = Replica(model_of(log))
    left_out, (change,) = LeftOut(replica, history), history.exchanges
    left_out.at(change.t - 0.1)
    before = drawn(replica)
    left_out.at(change.t)
    missing = before - drawn(replica)
    assert "r4/carriage" in missing and {name.partition("/")[0] for name in missing} == {"r4"}
    stays = {name for name in before - missing if name.startswith("r4/")}
    assert stays == {"r4/rail", "r4/buffer/A", "r4/buffer/B"}
    left_out.at(0.0)
    assert drawn(replica) == before, "a film may be asked for an earlier time"


def test_a_caption_says_that_a_deputy_took_over(history: History) -> None:
    (death,), seen = history.deaths(), []
    for time in (death.start - 0.1, death.end - 0.1, death.end + 0.1, death.end + 9.0):
        pixels = np.full((400, 640, 3), 255, np.uint8)
        draw_notices(pixels, history, time, Caption((640, 400)))
        seen.append(bool((pixels == DEAD).all(axis=-1).any()))
    assert seen == [False, False, True, False], "until then it is told that a deputy comes"


def test_the_page_of_the_report_is_told(file: Path, history: History) -> None:
    data, (change,) = failures_data(recording_of(file, laid_out())), history.exchanges
    dead, deputy = (history.index[name] for name in change.robots)
    assert data["gone"] == [[dead, round(change.t, 4), deputy]]
    ((robot, _, end, then),) = data["dead"]
    assert (robot, end, then) == (dead, round(change.t, 4), ", then r4 is gone: r2 does its tours")
