"""Failures: what they cost, and the pace with them, against undisturbed nets and planted faults."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import factory as factory_package
from factory.nets.marked import marked
from factory.nets.undo import times_undone, tokens_after, undo
from factory.plant.factory import Factory, Operation
from factory.plant.material import joins_of
from factory.simulation.recovery.faults import CLEAR
from factory.study.analysis import Timing
from factory.study.analysis.failing import failing_net, failing_pace
from factory.study.analysis.firing import earliest_firings
from factory.study.analysis.timed import timed_net
from factory.timing import failing
from factory.timing.failing import (
    SCRAPS,
    Chance,
    FailingNet,
    Mishap,
    Rates,
    asked_by,
    checked,
    drawn,
    failing_run,
)
from tests.command_line import PAPER, ROOT, Terminal
from tests.fold_values import random_fold
from tests.layout_values import paper_layout

WELD = (ROOT / "templates" / "weld.op").read_text()


@cache
def timing(world: str) -> Timing:
    return Timing(paper_layout(), world=world)  # type: ignore[arg-type]


def plain_net(factory: Factory, seconds: float = 1.0) -> FailingNet:
    """The net of a factory whose operations take so long each."""
    net, count = marked(factory.net), len(factory.operations)
    delays = [seconds] * count + [0.0] * (len(net.tokens) - count)
    return FailingNet(factory, net, delays, [seconds] * count)


@cache
def shipped() -> Factory:
    """The paper's example with the shipped templates."""
    return factory_package.compile(factory_package.load_pag(PAPER))


def never(operation: Operation, ended: int) -> Mishap | None:
    return None


def always(label: str, mishap: Mishap) -> Chance:
    return lambda operation, ended: mishap if operation.label == label else None


# The Monte Carlo run


@pytest.mark.parametrize("world", ["mujoco", "ideal"])
def test_without_failures_dates_and_pace_are_the_predicted_ones(world: str) -> None:
    here = timing(world)
    net = timed_net(here)
    dates = earliest_firings(net.net, net.seconds, 40, net.first, net.ready)
    found = failing_run(failing_net(here, net), never, 40)
    assert list(found.dates) == list(dates[:, here.factory.dropoffs[0].end])
    without = failing_pace(here, net, Rates())
    assert (without.cycle, without.loss, without.made) == (net.pace, 0.0, 2000)


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_without_failures_folds_fire_as_early_as_they_can(seed: int) -> None:
    subject = plain_net(random_fold(seed))
    dates = earliest_firings(subject.net, subject.seconds, 6)
    last = subject.factory.dropoffs[-1]
    assert failing_run(subject, never, 6).dates == tuple(dates[:, last.end])


def test_the_pace_gets_worse_with_each_rate_and_all_is_made() -> None:
    here = timing("mujoco")
    net = timed_net(here)
    for rates in (
        [Rates(redo=share) for share in (0.0, 0.02, 0.05, 0.1, 0.3)],
        [Rates(lose=share) for share in (0.0, 0.01, 0.03, 0.1)],
    ):
        found = [failing_pace(here, net, rate) for rate in rates]
        assert all(one.made == one.units == 2000 for one in found)
        cycles = [one.cycle or 0.0 for one in found]
        assert cycles == sorted(cycles)
        assert cycles[-1] > 1.05 * cycles[0]


def test_the_prototypes_figures() -> None:
    """5 % redone and 1 % lost: +8 % with six robots, where robots need no time to go back."""
    here = timing("ideal")
    subject = failing_net(here, timed_net(here))
    quick = FailingNet(subject.factory, subject.net, subject.seconds, [0.0] * 7)
    paces = []
    for rates in (Rates(), Rates(0.05, 0.01)):
        dates = failing_run(quick, drawn(rates, 1), 2000).dates
        paces.append((dates[-1] - dates[199]) / 1800)
    assert len(dates) == 2000
    assert paces[1] / paces[0] == pytest.approx(1.08, abs=0.02)


def test_one_repetition_of_the_slowest_costs_that_and_the_way_back() -> None:
    here = timing("ideal")
    net = timed_net(here)
    subject = failing_net(here, net)
    weld = here.factory.by_label["sub2"]

    def once(operation: Operation, ended: int) -> Mishap | None:
        due = operation.index == weld.index and ended == 10 and not seen
        return seen.append(1) or Mishap() if due else None  # type: ignore[func-returns-value]

    seen: list[int] = []
    later = failing_run(subject, once, 30).dates[-1] - failing_run(subject, never, 30).dates[-1]
    assert later == pytest.approx(net.seconds[weld.place] + subject.back[weld.index])


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_folds_make_all_their_units_whatever_fails(seed: int) -> None:
    found = failing_run(plain_net(random_fold(seed)), drawn(Rates(0.1, 0.05), seed), 40)
    assert len(found.dates) == 40
    assert not found.stopped
    assert list(found.dates) == sorted(found.dates)


def test_the_same_seed_gives_the_same_run() -> None:
    subject = plain_net(random_fold(3))
    first, again, other = (
        failing_run(subject, drawn(Rates(0.1, 0.05), seed), 40).dates for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other


# What templates say


def test_again_is_bounded_and_scraps_on_end_stop_the_line() -> None:
    subject = plain_net(shipped())
    weld = subject.factory.by_label["sub2"].index
    found = failing_run(subject, always("sub2", Mishap()), 3)
    assert (found.stopped, found.dates) == ("sub2", ())
    assert found.scrapped == {weld: SCRAPS - 1}
    assert found.redone == {weld: 2 * SCRAPS}
    unsaid = failing_run(subject, always("dropoff", Mishap()), 3)
    assert (unsaid.stopped, sum(unsaid.redone.values())) == ("dropoff", SCRAPS - 1)
    lost = failing_run(subject, always("part1", Mishap(("part1",))), 3)
    assert (lost.stopped, sum(lost.scrapped.values())) == ("part1", SCRAPS - 1)


@pytest.mark.parametrize("rates", [(-0.1, 0.0), (0.0, -0.1), (0.6, 0.4), (float("nan"), 0.0)])
def test_rates_are_shares(rates: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="shares"):
        Rates(*rates)


# Planted faults


def test_an_undo_that_undoes_too_little_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    def short(net: object, fired: list[int], asked: dict[int, int], rules: object) -> list[int]:
        return [count - asked.get(event, 0) for event, count in enumerate(fired)]

    subject = plain_net(shipped())
    monkeypatch.setattr(failing, "undo", short)
    with pytest.raises(ValueError, match="the undo leaves -1 tokens on"):
        failing_run(subject, always("sub2", Mishap(("sub1",))), 3)


def test_an_undo_without_the_material_rule_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    def careless(net: object, fired: list[int], asked: dict[int, int], rules: object) -> object:
        return undo(subject.net, fired, asked, {})

    subject = plain_net(shipped())
    monkeypatch.setattr(failing, "undo", careless)
    with pytest.raises(ValueError, match=r"the undo keeps .*, of which the product is gone"):
        failing_run(subject, always("sub2", Mishap(("sub1",))), 3)


@given(st.integers(0, 10_000), st.data())
@settings(max_examples=20)
def test_undos_pass_the_check_and_nothing_less_does(seed: int, data: st.DataObject) -> None:
    factory = random_fold(seed)
    net, rules = marked(factory.net), joins_of(factory)
    operation = data.draw(st.sampled_from(factory.operations))
    base = [20 for _ in net.net.transitions]
    lost = operation.inputs[:1]
    asked = asked_by(factory, operation, lost)
    left = undo(net, base, asked, rules)
    checked(net, base, left, rules)
    assert min(tokens_after(net, left)) >= 0
    for event in times_undone(base, left).keys() - asked.keys():
        less = [count + (number == event) for number, count in enumerate(left)]
        with pytest.raises(ValueError, match="the undo"):
            checked(net, base, less, rules)


# The command line


def test_check_says_what_failures_cost(run: Terminal) -> None:
    found = run("check", PAPER, "--failures", "--json").json["failures"]
    assert found["costed"]
    assert found["bound"] == {"retries": 12, "scraps": 20, "attempts": 100}
    tests = {(test["operation"], test["test"]): test for test in found["tests"]}
    weld, part = tests["sub2", "residual"], tests["part1", "lost"]
    assert weld["responses"] == ["again 2", "scrap"]
    assert (weld["limit"], weld["retries"]) == (5e-4, 2)
    assert weld["again"]["parts"] == 0
    assert weld["again"]["undone"] == weld["again"]["undone_at_most"] == 1
    assert weld["again"]["later_s"] > 1.0
    assert weld["scrap"]["lost"] == "sub1"
    assert weld["scrap"]["parts"] == 2
    assert 7 <= weld["scrap"]["undone"] <= weld["scrap"]["undone_at_most"]
    assert (part["again"], part["scrap"]["parts"]) == (None, 1)
    dropoff = tests["dropoff", "lost"]
    assert dropoff["scrap"]["parts"] == 3
    assert dropoff["scrap"]["undone_at_most"] == max(
        test["scrap"]["undone_at_most"] for test in found["tests"]
    )


def test_check_tells_people_when_asked(run: Terminal) -> None:
    assert "failure" not in run("check", PAPER).out
    out = run("check", PAPER, "--failures").out
    assert "residual > 0.0005 : again 2 then scrap" in out
    assert "retries: at most 12 a unit without a scrap, and 100 attempts on end" in out


def test_large_factories_have_costs_when_asked(run: Terminal) -> None:
    file = ROOT / "examples" / "truck.pag"
    silent = run("check", file, "--json").json["failures"]
    assert not silent["costed"]
    assert {test["scrap"] for test in silent["tests"]} == {None}
    asked = run("check", file, "--failures", "--json").json["failures"]
    assert asked["costed"]
    assert asked["bound"] == silent["bound"]
    assert all(test["scrap"] for test in asked["tests"])


def test_a_period_of_several_units_has_the_bound_of_one(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "slow.pag"
    parts = "part1 = atomic(); part2 = atomic(); part3 = atomic()"
    joins = "sub2 = weld ( sub1, dwell = 2 ); sub1 = insert ( part1, part2 );"
    file.write_text(f"root = sub3; sub3 = insert ( part3, sub2 ); {joins} {parts}")
    words = ("check", file, "--no-hands", "--failures", "--json")
    one = run(*words).json["failures"]
    three = run(*words, "--parallel", "sub2=3").json["failures"]
    assert three["bound"] == one["bound"]
    assert len(three["tests"]) == 3 * len(one["tests"])
    last = three["tests"][-1]
    assert (last["operation"], last["scrap"]["lost"]) == ("dropoff@3", "sub3@3")


def test_a_template_of_ones_own(run: Terminal, tmp_path: Path) -> None:
    usual = "again 2 then scrap, jammed : again 2 then scrap, lost : scrap"
    text = WELD.replace(usual, "again 7, rejected : stop")
    (tmp_path / "weld.op").write_text(text)
    found = run("check", PAPER, "--templates", tmp_path, "--json").json["failures"]
    tests = {test["test"]: test for test in found["tests"] if test["operation"] == "sub2"}
    assert list(tests) == ["residual", "rejected"]
    assert tests["residual"]["responses"] == ["again 7", "stop"]
    assert tests["rejected"]["scrap"] is None
    assert found["bound"]["attempts"] == 160
    (tmp_path / "weld.op").write_text(WELD.replace("again 2", "again 0", 1))
    done = run("check", PAPER, "--templates", tmp_path)
    assert done.status == 2
    assert "BadFailure 'again 0' is no number of times" in done.err


def test_analyze_foresees_the_pace_with_failures(run: Terminal) -> None:
    words = ("analyze", PAPER, "--redo", "0.05", "--lose", "0.01")
    standing = run(*words, "--json").json["failing"]
    found = run(*words, "--clear", "0", "--json").json
    rate = found["failing"]
    assert (rate["made"], rate["units"], rate["stopped"]) == (2000, 2000, None)
    assert rate["cycle_time_s"] == pytest.approx(found["cycle_time_s"] * (1 + rate["loss"]))
    assert 0.05 < rate["loss"] < 0.2
    assert sum(one["redone"] for one in rate["operations"]) > 500
    assert (rate["clear_s"], standing["clear_s"]) == (0.0, CLEAR)
    assert standing["loss"] > 2 * rate["loss"]
    assert "1 % lost at each operation, which lies for 10 s: cycle time" in run(*words).out
    assert "1 % lost at each operation: cycle time" in run(*words, "--world", "ideal").out
    assert "failing" not in run("analyze", PAPER, "--json").json


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--redo", "0.4", "--lose", "0.2"), "more than 0.5 together"),
        (("--redo", "2"), "0.5"),
        (("--redo", "0.1", "--clear", "5"), "--clear says how long what is lost lies"),
    ],
)
def test_rates_that_are_too_much(run: Terminal, words: tuple[str, ...], message: str) -> None:
    done = run("analyze", PAPER, *words)
    assert done.status == 2
    assert message in done.err


def test_templates_are_listed_with_their_failures(run: Terminal) -> None:
    found = {t["name"]: t for t in run("templates", "--json").json["templates"]}
    assert found["relay"]["failures"] == [{"test": "lost", "limit": None, "responses": ["scrap"]}]
    assert found["inspect"]["failures"][0]["test"] == "rejected"
    assert "failure" not in found["relay"]["text"]
