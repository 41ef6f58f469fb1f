"""The pace of timed nets against brute force, linear programs, token games and runs."""

from __future__ import annotations

import json
import random
import re
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.sparse import coo_array

import factory
from factory.apps.analyze import Change, Timing, analyse
from factory.apps.analyze.analysing import least_wip
from factory.apps.analyze.firing import circuits, slacks
from factory.apps.analyze.timed import flow, reached, timed_net
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timed import duration, timed
from factory.floor.layout.layout import Layout
from factory.floor.modes.modes import robot_limits
from factory.support.errors import Diagnostic, RunError
from factory.support.settings import Settings
from factory.theory.control.mode import Limits
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from factory.theory.nets.earliest import earliest_firings
from factory.theory.nets.marked import MarkedNet
from tests.command_line import Terminal
from tests.layout_values import paper_layout, random_layout
from tests.net_values import net_from
from tests.paths import PAPER, ROOT

WORLDS = ("mujoco", "ideal")


def random_net(seed: int, size: int, extra: int, most: int = 3) -> tuple[MarkedNet, list[float]]:
    """A live marked graph: a ring with one token, and places that go on without tokens only in the
    order of the ring; its times are whole numbers."""
    rng = random.Random(seed)
    rows = [(f"t{i}", f"t{(i + 1) % size}", int(i == size - 1)) for i in range(size)]
    for _ in range(extra):
        i, j = rng.sample(range(size), 2)
        rows.append((f"t{i}", f"t{j}", rng.randint(int(i > j), most)))
    return net_from(rows), [float(rng.randint(0, 50)) for _ in rows]


def every_circuit(net: MarkedNet) -> list[tuple[int, ...]]:
    graph: nx.DiGraph = nx.DiGraph()
    for place, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
        graph.add_edge(("t", before), ("p", place))
        graph.add_edge(("p", place), ("t", after))
    return [tuple(i for kind, i in c if kind == "p") for c in nx.simple_cycles(graph)]


def ratio_of(net: MarkedNet, seconds: list[float], circuit: tuple[int, ...]) -> Fraction:
    return Fraction(sum(seconds[p] for p in circuit)) / sum(net.tokens[p] for p in circuit)


@given(st.integers(0, 10**9))
@settings(max_examples=60)
def test_ratio_and_slack_are_those_of_every_circuit(seed: int) -> None:
    net, seconds = random_net(seed, 2 + seed % 6, seed % 8)
    every = every_circuit(net)
    found = max_cycle_ratio(net, seconds)
    greatest = max(ratio_of(net, seconds, c) for c in every)
    assert found.seconds == pytest.approx(float(greatest))
    assert ratio_of(net, seconds, found.circuit) == greatest
    lacks = {
        c: greatest * sum(net.tokens[p] for p in c) - sum(seconds[p] for p in c) for c in every
    }
    for place, slack in slacks(found, range(len(seconds))).items():
        least = min(lack for c, lack in lacks.items() if place in c)
        assert slack.seconds == pytest.approx(float(least), abs=1e-6)
        assert lacks[next(c for c in every if set(c) == set(slack.circuit))] == least
    first = circuits(found, found.circuit)[0]
    assert first.seconds == 0 and ratio_of(net, seconds, first.circuit) == greatest


@pytest.mark.parametrize("seed", range(4))
def test_ratio_is_that_of_the_linear_program(seed: int) -> None:
    """The least r with dates v such that v(after) >= v(before) + seconds - r tokens."""
    net, seconds = random_net(seed, 200, 600, 2)
    size, count = len(net.net.transitions), len(seconds)
    row = np.arange(count)
    values = np.concatenate([np.ones(count), -np.ones(count), -np.array(net.tokens, float)])
    columns = np.concatenate([net.left, net.right, np.full(count, size)])
    matrix = coo_array((values, (np.tile(row, 3), columns)), shape=(count, size + 1))
    cost = np.zeros(size + 1)
    cost[-1] = 1.0
    done = linprog(cost, matrix.tocsr(), -np.array(seconds), bounds=(None, None), method="highs")
    assert max_cycle_ratio(net, seconds).seconds == pytest.approx(done.fun, rel=1e-6)


def test_the_proof_of_a_large_net() -> None:
    net, seconds = random_net(7, 10_000, 10_000)
    found = max_cycle_ratio(net, seconds)
    left, right = np.array(net.left), np.array(net.right)
    ahead = found.dates[right] - found.dates[left]
    assert (ahead >= np.array(seconds) - found.seconds * np.array(net.tokens) - 1e-5).all()
    assert float(ratio_of(net, seconds, found.circuit)) == pytest.approx(found.seconds)
    ends = [net.right[p] for p in found.circuit]
    assert ends == [net.left[p] for p in found.circuit[1:] + found.circuit[:1]]


def test_a_net_in_parts_has_the_pace_of_its_slowest() -> None:
    net = net_from([("a", "b", 0), ("b", "a", 2), ("b", "c", 0), ("c", "d", 0), ("d", "c", 1)])
    found = max_cycle_ratio(net, [4.0, 4.0, 9.0, 1.0, 2.0])
    assert (found.seconds, set(found.circuit)) == (4.0, {0, 1})
    assert slacks(found, [2, 3])[2].seconds == float("inf")
    assert slacks(found, [3])[3].seconds == pytest.approx(1.0)


def token_game(net: MarkedNet, seconds: list[float], count: int) -> list[list[float]]:
    """Dates of firings by moving tokens: each place a queue of the moments they are ready at."""
    ready = [deque([0.0] * tokens) for tokens in net.tokens]
    fired: list[list[float]] = [[] for _ in net.net.transitions]
    going = True
    while going:
        going = False
        for event, dates in enumerate(fired):
            places = net.net.preset[event]
            while len(dates) < count and all(ready[p] for p in places):
                dates.append(max(ready[p].popleft() for p in places))
                for p in net.net.postset[event]:
                    ready[p].append(dates[-1] + seconds[p])
                going = True
    return fired


@given(st.integers(0, 10**9))
@settings(max_examples=40)
def test_firings_are_those_of_the_token_game(seed: int) -> None:
    net, seconds = random_net(seed, 2 + seed % 7, seed % 9)
    dates = earliest_firings(net, seconds, 12)
    assert dates.T.tolist() == token_game(net, seconds, 12)


def layouts() -> list[Layout]:
    return [laid_out(number) for number in range(5)]


def laid_out(number: int) -> Layout:
    """The paper's example, or one of four random factories."""
    shapes = ("", "any", "chain", "balanced", "wide")
    if not number:
        return paper_layout()
    return random_layout(3 + 2 * number, number - 1, shapes[number], "medium")


@pytest.mark.parametrize("world", WORLDS)
def test_the_pace_is_the_predicted_one(world: str) -> None:
    for layout in layouts():
        timing = Timing(layout, Settings(), world, 3, 0.3)  # type: ignore[arg-type]
        for wip in (None, 1, 2):
            net = timed_net(timing, wip=wip)
            predicted = timed(timing, wip=wip).cycle
            assert net.pace == pytest.approx(predicted.seconds)
            assert max_cycle_ratio(net.net, net.seconds).seconds == pytest.approx(net.pace)


@given(st.integers(0, 10**6))
@settings(max_examples=12)
def test_named_circuits_are_all_that_matter_with_copies(seed: int) -> None:
    rng = random.Random(seed)
    timing = Timing(rng.choice(layouts()), Settings(), rng.choice(WORLDS))  # type: ignore[arg-type]
    chosen = rng.sample(range(len(timing.factory.robots)), 2)
    copies = {robot: rng.randint(2, 3) for robot in chosen}
    change = Change(copies=copies, speed={chosen[0]: rng.uniform(0.5, 3.0)})
    net = timed_net(timing, change)
    assert net.pace == pytest.approx(max_cycle_ratio(net.net, net.seconds).seconds)
    assert net.pace <= timed_net(timing, Change(speed=change.speed)).pace


def test_a_second_robot_takes_turns_with_the_first() -> None:
    """The paper's bottleneck doubled: two tokens in its gear, played as tokens."""
    timing = Timing(paper_layout(), Settings(), "ideal")
    net = timed_net(timing, Change(copies={2: 2}))
    gears = {c.name: c.seconds for c in net.named}
    assert [c.tokens for c in net.named] == [1, 1, 2, 1, 1, 1]
    others = max(seconds for name, seconds in gears.items() if name != "r3")
    assert net.pace == pytest.approx(max(gears["r3"] / 2, others))
    dates = token_game(net.net, list(net.seconds), 60)[timing.factory.dropoff.end]
    assert (dates[-1] - dates[29]) / 30 == pytest.approx(net.pace)


def test_the_first_unit_waits_for_no_cycle_and_each_other_one_for_one() -> None:
    timing = Timing(paper_layout(), Settings(), "ideal")
    first = duration(timing, 100.0, 1)
    assert first == duration(timing, 0.0, 5) < sum(timing.delays)
    assert duration(timing, 100.0, 5) == pytest.approx(first + 400.0)


def test_a_part_is_taken_by_one_copy_at_a_time() -> None:
    timing = Timing(paper_layout(), Settings(), "ideal")
    feeder = next(r for r in timing.factory.robots if r.name == "r2")
    net = timed_net(timing, Change(copies={feeder.index: 9}))
    station = next(c for c in net.named if c.name == "station part3")
    assert station.pace == timing.delays[timing.factory.by_label["part3"].index]


@pytest.mark.parametrize("number", range(5))
def test_the_shares_of_a_robot_are_its_cycle(number: int) -> None:
    timing = Timing(laid_out(number), Settings(), "ideal", 7, 0.3)
    net = timed_net(timing)
    for share in flow(timing, net, 10).shares:
        assert share.cycle == pytest.approx(net.pace)
        assert min(share.moving, share.working, share.standing, share.waiting) >= -1e-9


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_the_run_that_is_predicted_is_the_ideal_one(jitter: float) -> None:
    for layout in layouts():
        timing = Timing(layout, Settings(), "ideal", 5, jitter)
        run = Simulation(layout, RunRequest("ideal", units=6, seed=5, jitter=jitter)).run()
        found = flow(timing, timed_net(timing), 6)
        ticks = timing.settings.tick * 3 * len(layout.factory.operations)
        assert found.first == pytest.approx(run.dropoffs[0], abs=ticks, rel=0.02)
        assert found.last == pytest.approx(run.dropoffs[-1], abs=ticks, rel=0.02)


@given(st.integers(0, 30), st.floats(0.3, 0.99), st.floats(0.1, 10.0))
def test_units_are_as_many_as_it_takes(early: int, share: float, pace: float) -> None:
    """The first products come too fast, by `share` of the pace."""
    dates = np.cumsum(pace * np.where(np.arange(100) <= early, share, 1.0))
    units = reached(dates, pace)
    run = made()
    cycles = {n: replace(run, dropoffs=tuple(dates[:n])).cycle_time_s for n in range(4, 101)}
    assert all(abs(cycles[n] / pace - 1) <= 1e-3 for n in range(units, 101))
    assert units == 4 or abs(cycles[units - 1] / pace - 1) > 1e-3
    assert units <= max(4, 2 * (early + 1))


@cache
def made() -> Run:
    return Simulation(paper_layout(), RunRequest("ideal", units=1)).run()


def test_sensitivity_is_what_a_changed_run_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's bottleneck with another speed, in the ideal world."""
    slow = Settings(speed=0.2)
    timing = Timing(paper_layout(), slow, "ideal")
    pace = timed_net(timing).pace
    assert 0.05 < pace - timed_net(timing, Change(way={2: 0.5})).pace < pace
    assert timed_net(timing, Change(way={2: 1.0})).pace == pace
    predicted = pace - timed_net(timing, Change(speed={2: 2.0})).pace

    def limits(*arguments: object) -> tuple[Limits, np.ndarray]:
        unchanged, gains = robot_limits(*arguments)  # type: ignore[arg-type]
        speed = unchanged.speed.copy()
        speed[2] *= 2.0
        return Limits(speed, unchanged.acceleration), gains

    def cycle() -> float:
        request = RunRequest("ideal", units=6, settings=slow)
        measured = Simulation(timing.layout, request).run().cycle_time_s
        assert measured is not None
        return measured

    before = cycle()
    monkeypatch.setattr("factory.engine.simulation.simulation.robot_limits", limits)
    assert abs(predicted) > 0.2
    assert before - cycle() == pytest.approx(predicted, abs=0.06)


def test_what_robots_buy() -> None:
    timing = Timing(paper_layout(), Settings(speed=0.2))
    found = analyse(timing)
    assert found.bottlenecks == ("r3",)
    gains = {s.robot: s for s in found.sensitivities}
    third = gains["r3"]
    faster = timed_net(timing, Change(speed={2: 1.1})).pace
    assert 0 < third.faster == pytest.approx(found.net.pace - faster)
    assert gains["r4"].copy == gains["r4"].faster == 0 < gains["r4"].slack
    for operation, slack in zip(timing.factory.operations, found.slack, strict=True):
        grown = list(found.net.seconds)
        grown[operation.place] += slack
        assert max_cycle_ratio(found.net.net, grown).seconds == pytest.approx(found.net.pace)
        grown[operation.place] += 0.1
        assert max_cycle_ratio(found.net.net, grown).seconds > found.net.pace + 0.01


def test_slack_where_copies_are_bounded() -> None:
    timing = Timing(paper_layout())
    found = analyse(timing, wip=1)
    assert found.bottlenecks == ("wip part1", "wip part2")
    part3 = timing.factory.by_label["part3"].index
    grown = list(found.net.seconds)
    grown[part3] += found.slack[part3]
    assert max_cycle_ratio(found.net.net, grown).seconds == pytest.approx(found.net.pace)
    grown[part3] += 0.1
    assert max_cycle_ratio(found.net.net, grown).seconds > found.net.pace + 0.01


@pytest.mark.parametrize("number", range(5))
def test_the_least_bound_on_copies_keeps_the_pace(number: int) -> None:
    timing = Timing(laid_out(number))
    full, least = timed_net(timing).pace, least_wip(timing)
    assert timed_net(timing, wip=least).pace == pytest.approx(full)
    assert least == 1 or timed_net(timing, wip=least - 1).pace > full * (1 + 1e-9)


def test_a_run_against_its_prediction(run: Terminal, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    made = ("--world", "ideal", "--jitter", 0.3, "--seed", 4, "--units", 6)
    assert run("run", PAPER, *made, "--log", log, "-q").status == 0
    logged = run("analyze", PAPER, "--measured", log, "--json")
    there = run("analyze", PAPER, *made, "--run", "--json")
    assert logged.status == there.status == 0
    found, again = logged.json["measured"], there.json["measured"]
    assert found.pop("source") == str(log) and again.pop("source") == "a run on the spot"
    assert found["units"] == 6
    assert (logged.json["jitter"], logged.json["seed"], logged.json["world"]) == (0.3, 4, "ideal")
    for key in ("cycle_time_s", "last_product_s"):
        assert found[key]["measured"] == pytest.approx(again[key]["measured"], abs=0.021)
        assert abs(found[key]["error"]) < 0.02
    assert found["durations"] == again["durations"]
    assert all(abs(d["predicted"] - d["measured"]) < 0.03 for d in found["durations"])
    for busy in found["busy"]:
        assert busy["predicted"] == pytest.approx(busy["measured"], abs=0.02)


def test_a_slow_robot_shows(monkeypatch: pytest.MonkeyPatch, run: Terminal) -> None:
    def limits(*arguments: object) -> tuple[Limits, np.ndarray]:
        found, gains = robot_limits(*arguments)  # type: ignore[arg-type]
        speed = found.speed.copy()
        speed[1] *= 0.1
        return Limits(speed, found.acceleration), gains

    monkeypatch.setattr("factory.engine.simulation.simulation.robot_limits", limits)
    done = run("analyze", PAPER, "--world", "ideal", "--units", 4, "--run", "--json")
    errors = {d["label"]: d["error"] for d in done.json["measured"]["durations"]}
    assert errors["part3"] < -0.5 and errors["sub3"] < -0.5
    assert abs(errors["sub1"]) < 0.1


def test_a_run_of_one_unit(run: Terminal) -> None:
    """An operation done once is compared with its first predicted duration."""
    found = run("analyze", PAPER, "--world", "ideal", "--units", 1, "--run", "--json").json
    assert found["measured"]["cycle_time_s"]["measured"] is None
    durations = found["measured"]["durations"]
    assert all(d["count"] == 1 for d in durations)
    assert all(abs(d["predicted"] - d["measured"]) < 0.03 for d in durations)


def test_a_physical_run_is_as_predicted(run: Terminal) -> None:
    found = run("analyze", PAPER, "--units", 6, "--run", "--json").json["measured"]
    assert abs(found["cycle_time_s"]["error"]) < 0.02
    assert abs(found["last_product_s"]["error"]) < 0.02
    assert all(abs(d["error"]) < 0.03 for d in found["durations"])


def test_the_document(run: Terminal) -> None:
    found = run("analyze", PAPER, "--second", "r4", "--faster", "r3=50", "--wip", 1, "--json").json
    assert found["bottlenecks"] == ["wip part1", "wip part2"]
    assert found["cycle_time_s"] == pytest.approx(found["circuits"][0]["pace_s"], rel=1e-12)
    assert found["circuits"][0]["slack_s"] == 0
    assert found["circuits"][0]["places"][0].startswith("wip:")
    assert found["scenarios"][0]["change"] == "2 × r4, r3 50 % faster"
    assert found["least_wip"] == 2
    assert [r["robot"] for r in found["robots"]] == ["r1", "r2", "r3", "r4", "r5", "r6"]
    assert found["measured"] is None


def test_a_change_is_examined_only_if_it_is_asked_for(run: Terminal) -> None:
    (asked,) = run("analyze", PAPER, "--second", "r3", "--json").json["scenarios"]
    unasked = run("analyze", PAPER, "--json").json
    assert asked["change"] == "2 × r3" and unasked["scenarios"] == []
    (gain,) = (r["gain_second_robot_s"] for r in unasked["robots"] if r["robot"] == "r3")
    assert asked["gain_s"] == pytest.approx(gain)


def test_what_people_read(run: Terminal, golden: Callable[[str, str], None]) -> None:
    """Numbers left out: they follow the layout."""
    done = run("analyze", PAPER, "--shorter", "r3=20")
    assert done.status == 0
    golden("analyze_paper.txt", re.sub(r"(?<![a-z])\d[\d.]*", "#", done.out))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--second", "r44"), "Usage there is no robot 'r44'"),
        (("--faster", "r4"), "BadValue --faster takes a robot and percent above 0"),
        (("--faster", "r4=nan"), "BadValue faster takes"),
        (("--shorter", "r4=101"), "at most 100, not 'r4=101'"),
        (("--shorter", "x=10"), "Usage there is no robot 'x'"),
        (("--wip", "0"), "Usage"),
        (("--measured", "no.log"), "BadLog 'no.log' cannot be read"),
        (("--measured", PAPER), "is no log of factory"),
        (("--measured", "no.log", "--run"), "Usage --measured LOG and --run exclude each other"),
    ],
)
def test_what_is_refused(run: Terminal, words: tuple[str, ...], message: str) -> None:
    done = run("analyze", PAPER, *words)
    assert done.status == 2
    assert message in done.err
    assert done.out == ""


def test_a_net_has_no_pace(run: Terminal, tmp_path: Path) -> None:
    net = tmp_path / "net.pnml"
    assert run("export", PAPER, "--format", "pnml", "-o", net).status == 0
    done = run("analyze", net)
    assert done.status == 2 and "is a net in PNML, not the PAG of a product" in done.err


def test_logs_that_do_not_fit(run: Terminal, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    made = ("--world", "ideal", "--log", log, "-q")
    assert run("run", PAPER, *made, "--from", "part1,part2").status == 0
    assert (
        "did not start from the initial marking (--from)"
        in run("analyze", PAPER, "--measured", log).err
    )
    assert run("run", PAPER, *made, "--max-time", 1).status == 1
    assert "has no finished product" in run("analyze", PAPER, "--measured", log).err
    other = ROOT / "examples" / "stool.pag"
    done = run("analyze", other, "--measured", log, "--json")
    assert (done.status, done.codes) == (2, ["BadLog"])
    assert "is the log of another factory" in json.dumps(done.json)


def test_a_net_that_is_not_proved_is_not_analysed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(net: object) -> None:
        assert net is paper_layout().factory.net
        raise RunError(Diagnostic("Deadlock", "it stops", None, ""))

    monkeypatch.setattr("factory.theory.nets.verify.proved", refused)
    with pytest.raises(RunError, match="it stops"):
        factory.analyze(paper_layout())
