"""Mixes on demand: every word is made in its order, units that nobody ordered are skipped (Theorem
10), and machines at rest are in nobody's way."""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.recovery import recover
from factory.apps.runs.demand_file import demand_of, read_demand
from factory.apps.runs.watched import watched
from factory.engine.simulation.mujoco.supply import Supply
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.demand import Demand, Word
from factory.floor.layout import resting
from factory.floor.layout.layout import Layout
from factory.floor.layout.presence import STILL
from factory.floor.layout.resting import on_demand
from factory.pipeline import Project, read
from factory.support.errors import InputError
from factory.theory.compiler.mixing import even
from factory.theory.lang.pag_reader import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.threaded import Threads
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from tests.command_line import Terminal
from tests.mix_values import LITTLE, mixed_factory, random_family
from tests.pag_values import TEMPLATES


@cache
def little() -> Project:
    """The little family: a, a, b."""
    templates = all_templates()
    pag = read_pag(LITTLE, templates, "little.pag")
    return Project(pag, templates, read("examples/paper.pag").catalogue)


def ordered(word: Sequence[str]) -> Demand:
    return Demand(tuple((product, 0.0) for product in word))


def simulated(word: Sequence[str], world: str = "mujoco", **asked: object) -> Simulation:
    """A run of the little family, about to make a word."""
    values = {"world": world, "units": len(word), "demand": ordered(word), **asked}
    return Simulation(little().layout, RunRequest(**values))  # type: ignore[arg-type]


def test_a_word_is_a_subsequence_of_the_units_of_the_net() -> None:
    word = Word(("a", "a", "b"), ordered("bbab"), 4)
    assert [word.makes(unit) for unit in range(3)] == [False, False, True]
    assert word.makes(12) is None  # four are ordered
    assert word.units == [2, 5, 6, 8]
    assert word.products(0, 4) == [*"bbab"]
    assert word.counts(0, 4) == {"a": 1, "b": 3}
    assert [word.nth(2, count) for count in range(3)] == [0, 1, 2]
    assert [word.before(0, periods) for periods in range(4)] == [0, 0, 0, 1]
    assert word.later(2).units == [0, 2]
    assert word.upcoming(0) == 6 == word.upcoming(3)


def test_a_letter_is_fixed_when_there_is_room_and_an_order() -> None:
    word = Word(("a", "b"), Demand((("b", 0.0), ("a", 5.0))), 2, wip=1)
    assert word.makes(1)
    assert word.makes(2) is None  # one is inside
    assert not word.is_late
    word.made = 1
    assert word.makes(2) is None  # nothing is ordered
    assert word.is_late
    word.now = 5.0
    assert word.makes(2)


def test_changes_stand_until_the_next() -> None:
    word = Word(("a", "b"), Demand(changes=(("a", 0), ("b", 2), ("a", 4))), 6, wip=2)
    for made in range(7):
        word.made = made
        word.makes(99)
    assert word.products(0, 6) == [*"aaabba"]
    with pytest.raises(ValueError, match="the first is at 0"):
        Demand(changes=(("a", 1),))


def test_only_orders_that_are_made_excuse_a_standstill() -> None:
    word = Word(("a", "b"), Demand((("b", 0.0), ("a", 5.0))), 2)
    assert [word.are_made(1, since) for since in (4.0, 5.0)] == [True, False]
    assert word.are_made(2, 9.0)
    assert not Word(("a", "b"), Demand(changes=(("a", 0),)), 2).are_made(1, 4.0)
    assert not Word(("a", "b")).are_made(1, 4.0)


def without_a_stop(factory: Factory, word: Word, rng: random.Random) -> int:
    """Fire the net at random, skipping as a run does, until its units are made. Gives the greatest
    number of units by which a letter was fixed ahead of its dropoff."""
    net, starts = factory.net, [o.start for o in factory.operations]
    threads = Threads(net.threaded, net.threads_of(net.initial_marking), starts)
    fired, busy, ahead = [0] * len(starts), list[Operation](), 0
    while word.made < word.most:
        possible = sorted(factory.operations[event // 2].index for event in threads.possible)
        known = {n: word.makes(factory.unit(factory.operations[n], fired[n])) for n in possible}
        ahead = max(ahead, len(word.units) - word.made - 1)
        chosen = [("start", factory.operations[n]) for n, made in known.items() if made is not None]
        chosen += [("end", operation) for operation in busy]
        assert chosen, f"stopped after {word.made} of {word.most} units"
        what, o = rng.choice(chosen)
        if what == "end" or not known[o.index]:
            if what == "end":
                busy.remove(o)
                word.made += factory.drops(o.index)
            else:
                threads.fire((o.start,))
            threads.fire((o.end,))
            fired[o.index] += 1
        else:
            threads.fire((o.start,))
            busy.append(o)
    return ahead


@pytest.mark.parametrize("wip", [1, 2, 4, None])
@pytest.mark.parametrize("seed", [2, 3])
def test_no_word_stops_the_net(seed: int, wip: int | None) -> None:
    """Theorem 10 and its corollary: a letter is fixed at most wip - 1 units ahead."""
    pag, rng = random_family(seed), random.Random(seed)
    if pag is None or pag.mix is None:
        return
    factory = mixed_factory(pag, even(pag.mix))
    asked = rng.choices(pag.products, k=40)
    word = Word(factory.sequence, ordered(asked), len(asked), wip)
    ahead = without_a_stop(factory, word, rng)
    assert word.products(0, 40) == asked
    assert wip is None or ahead <= wip - 1


def test_the_sequence_can_be_given(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "little.pag"
    file.write_text(LITTLE)
    assert run("check", file, "--order", "b,a,b", "--json").json["sequence"] == ["b", "a", "b"]
    for words in ("a,c", "a,a", ",".join("ab" * 31)):
        refused = run("check", file, "--order", words, "--json")
        assert (refused.status, refused.codes) == (2, ["BadMix"])


def test_an_order_that_does_not_come_in_time_is_named() -> None:
    demand = Demand((("b", 0.0), ("a", 60.0)))
    run = Simulation(little().layout, RunRequest(units=2, demand=demand)).run(max_time=20.0)
    assert run.trouble is not None and run.trouble.code == "Timeout"
    assert run.trouble.message.endswith("; order 2, a, is placed at 60 s only")


FAULTS = (
    Deviation("drop", label="x", unit=2),
    Deviation("drop", label="base", unit=4),
    Deviation("bad_part", label="z", unit=3),
    Deviation("no_part", label="base", unit=5, seconds=2.0),
)


def test_what_is_lost_is_made_again_for_its_unit() -> None:
    simulation = simulated("babab", "ideal", recovers=True, wip=3)
    recovery = recover(simulation, Campaign(FAULTS))
    run = simulation.run()
    assert run.succeeded, run.verdict
    assert recovery.report().struck["drop"] == 2
    assert (recovery.report().missed, recovery.report().false_alarms) == (0, 0)
    assert run.word == tuple("babab")


def failed(simulation: Simulation) -> set[str]:
    run: Run = watched(simulation, max_time=80.0)
    assert not run.succeeded
    codes = {run.trouble.code} if run.trouble else set[str]()
    return codes | {v.code for v in run.monitor.violations} if run.monitor else codes


def test_a_feeder_that_follows_another_word_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """It shows the part of a product that is not ordered, and nobody takes it."""
    monkeypatch.setattr(Supply, "skips", lambda self, label: False)
    assert "Stalled" in failed(simulated("bab"))


def test_a_robot_that_rests_in_the_way_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = little().layout
    assert on_demand(layout).certificate is not None
    rests = resting._rests

    def inwards(made: Layout, robots: object, robot: int, step: int) -> object:
        found = rests(made, robots, robot, step)  # type: ignore[arg-type]
        return (((0.0, 0.0), STILL[1]),) if robot > 1 else found

    monkeypatch.setattr(resting, "_rests", inwards)
    with pytest.raises(InputError) as caught:
        on_demand(layout)
    assert {fault.code for fault in caught.value.diagnostics} == {"Layout"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("part,time\na,0", "the columns are 'part,time'"),
        ("product,time\na,\u0661", "'\u0661' is no time [s] from 0 on"),
        ("product,time\na,5\nb,1", "1 comes after 5: orders are in the order of time"),
        ("product,time\na", "1 values, where there are 2 columns"),
        ("product,time\n", "there is no order"),
        ("product,made\na,2", "nothing is asked for before 2 products are made; begin at 0"),
    ],
)
def test_wrong_demands_are_refused_in_words(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "orders.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_demand(path, read_pag(LITTLE, TEMPLATES))
    (fault,) = caught.value.diagnostics
    assert fault.code == "BadDemand"
    assert fault.message.startswith(message)
    assert fault.position is not None


def test_demands_are_read_and_drawn(tmp_path: Path) -> None:
    pag, path = read_pag(LITTLE, TEMPLATES), tmp_path / "orders.csv"
    path.write_text("product\nb\na\n")
    assert read_demand(path, pag) == ordered("ba")
    path.write_text("product,made\na,0\nb,4\n")
    assert read_demand(path, pag) == Demand(changes=(("a", 0), ("b", 4)))
    drawn = demand_of("7", pag, 300)
    assert drawn == demand_of("7", pag, 300) != demand_of("8", pag, 300)
    assert 170 < [product for product, _ in drawn.orders].count("a") < 230
    with pytest.raises(InputError, match="is for a mix"):
        demand_of("7", read_pag("root = x; x = atomic()", TEMPLATES), 3)
