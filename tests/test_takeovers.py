"""A deputy takes the tours of a dead robot in a run: without a spare, to the last unit."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from benches.faults.takeovers import PAPER as INSERTS
from benches.faults.takeovers import interval_after
from factory.compiler import taking_over
from factory.compiler.deputies import chosen_pairs, deputies, rounds_of, standing_by
from factory.compiler.taking_over import crew_with, nets_after
from factory.layout.clearance import certify
from factory.layout.layout import Layout
from factory.layout.request import Ground
from factory.layout.standby import deputies_in, laid_out_for, part_of
from factory.nets.replay import replay
from factory.nets.undone import Undone
from factory.nets.verify import verify
from factory.pipeline import read
from factory.record.log import read_log
from factory.record.monitor.record import verdict_on
from factory.simulation.recovery import Campaign, WorldFault, recover
from factory.simulation.request import RunRequest
from factory.simulation.run import Run, entries_of
from factory.simulation.simulation import Simulation
from factory.support.errors import Diagnostic, RunError
from tests.command_line import ROOT, Terminal
from tests.fold_values import swapped
from tests.good_runs import assert_good
from tests.layout_values import without_gone
from tests.pag_values import catalogue
from tests.test_deputies import made, randoms, seeds

TIMES = 6.0, 7.0, 8.0
"""From when on a robot dies as it begins its next operation [s]: some cycles after the start."""


@pytest.fixture
def pag(tmp_path: Path) -> Path:
    """The paper's example with inserts, in which two robots are each other's deputies."""
    file = tmp_path / "inserts.pag"
    file.write_text(INSERTS)
    return file


@cache
def laid_out(with_deputies: bool = True) -> Layout:
    """Its layout; robot 1 brings part3, robot 3 part2."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        file = Path(folder) / "inserts.pag"
        file.write_text(INSERTS)
        return read(file, ground=Ground(deputies=with_deputies)).layout


def run_of(robot: str, at: float, units: int = 12, **asked: Any) -> Run:
    """A run in which a robot dies and no spare is there."""
    simulation = Simulation(laid_out(), RunRequest("ideal", units, recovers=True, **asked))
    recover(simulation, Campaign((WorldFault("dead", robot=robot, at=at),), swap=4.0))
    return simulation.run(max_time=150.0)


# --- what is laid out -----------------------------------------------------------------------------


@settings(max_examples=40)
@given(seeds, randoms)
def test_robots_and_deputies_in_turn_are_live(seed: int, rng: random.Random) -> None:
    """Each robot that has deputies has one of them, and rests in one turn, in which that one does
    its tours."""
    _, _, folded = made(seed, rng, 9)
    rows = deputies(folded, catalogue())
    pairs = chosen_pairs(rows)
    assert {robot for robot, _ in pairs} == {robot for robot, row in enumerate(rows) if row}
    assert all(deputy in rows[robot] for robot, deputy in pairs)
    turns = rounds_of(pairs)
    assert sorted(pair for turn in turns for pair in turn.items()) == sorted(pairs)
    assert all(not turn.keys() & {*turn.values()} for turn in turns)
    whole = standing_by(folded, pairs)
    assert whole.period == 1 + len(turns) and verify(whole.net).holds
    for o in whole.operations:
        moved = ({}, *turns)[o.turn]
        own = folded.by_label[o.written].robots
        assert o.robots == tuple(moved.get(robot, robot) for robot in own)


def test_the_layout_is_certified_for_either() -> None:
    """So are the factory as it is and that of each deputy, which are parts of it."""
    layout = laid_out()
    assert deputies_in(layout) == {1: 3, 3: 1}
    assert certify(layout).holds and layout.standby is not None
    assert {*layout.payloads} == {o.label for o in layout.factory.making}
    for dead, deputy in deputies_in(layout).items():
        crew = crew_with(layout.factory, dead, deputy)
        part = part_of(layout, crew)
        assert part is not None and certify(part).holds
        assert {*part.magazine(deputy)} == {"part2", "part3"} and not part.magazine(dead)
        assert part_of(laid_out(False), crew) is None
    strange = crew_with(layout.factory, 2, 1)
    assert part_of(layout, strange) is None, "no such tour is laid out"


def test_what_cannot_be_laid_out_is_no_deputy() -> None:
    """As many as go together are found, and what forbids all is said."""

    def lay_out(pairs: Sequence[tuple[int, int]]) -> Any:
        if (5, 6) in pairs or {(1, 2), (3, 4)} <= {*pairs}:
            raise RunError(Diagnostic("Layout", "no room", None))
        return pairs

    found: Any = laid_out_for([(1, 2), (2, 1), (3, 4), (4, 3), (5, 6)], lay_out)
    assert found == ((1, 2), (2, 1), (4, 3))

    def never(pairs: Sequence[tuple[int, int]]) -> Any:
        raise RunError(Diagnostic("Layout", "no room", None))

    with pytest.raises(RunError, match="no room"):
        laid_out_for([(1, 2)], never)


# --- runs -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", TIMES)
@pytest.mark.parametrize(("dead", "deputy"), [("r2", "r4"), ("r4", "r2")])
def test_all_units_are_made(dead: str, deputy: str, at: float) -> None:
    """From then on at the pace of the factory that N' is of, which has a robot fewer."""
    run = run_of(dead, at)
    assert (run.products, run.trouble, run.refines_net) == (12, None, True)
    (change,) = run.exchanges
    assert (change.dead, change.deputy) == (dead, deputy)
    assert interval_after(run) == pytest.approx(change.cycle_time, rel=0.03)
    entries = [*entries_of(run.events)]
    factory = laid_out().factory
    nets = [*nets_after(factory, entries)]
    assert [net == change.net for net in nets] == [True]
    assert not replay(factory.net, entries, None, factory.joins, ()).refines
    busy = dict(zip((r.name for r in factory.robots), run.busy, strict=True))
    assert busy[dead] < change.t < run.sim_time_s


@pytest.mark.parametrize("seed", range(3))
def test_robots_that_differ(seed: int) -> None:
    run = run_of("r4", 7.0, seed=seed, jitter=0.3)
    assert run.succeeded and len(run.exchanges) == 1


def test_the_deputy_dies_too() -> None:
    """Then nothing is left that could bring the parts, and the run says so."""
    simulation = Simulation(laid_out(), RunRequest("ideal", 12, recovers=True))
    both = tuple(WorldFault("dead", robot=r, at=t) for r, t in (("r2", 6.0), ("r4", 25.0)))
    recover(simulation, Campaign(both, swap=4.0))
    run = simulation.run(max_time=300.0)
    assert len(run.exchanges) == 1 and 0 < run.products < 12 and run.refines_net
    assert run.trouble is not None
    assert run.trouble.message == "r4 is dead, and there is no spare"


def test_a_deputy_that_is_dead_takes_nothing_over() -> None:
    """It is found dead, too, before it has taken over."""
    simulation = Simulation(laid_out(), RunRequest("ideal", 12, recovers=True))
    both = tuple(WorldFault("dead", robot=r, at=t) for r, t in (("r2", 6.0), ("r4", 7.0)))
    recovery = recover(simulation, Campaign(both, swap=40.0))
    run = simulation.run(max_time=300.0)
    assert [one.deputy for one in recovery.found if one.is_death] == ["r2", ""]
    assert not run.exchanges and run.trouble is not None


def test_spares_come_first() -> None:
    simulation = Simulation(laid_out(), RunRequest("ideal", 6, recovers=True))
    fault = WorldFault("dead", robot="r2", at=6.0)
    recover(simulation, Campaign((fault,), spares=1, swap=4.0))
    run = simulation.run(max_time=150.0)
    assert run.succeeded and not run.exchanges


# --- planted faults -------------------------------------------------------------------------------


def test_an_order_that_is_not_live_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """N' is proved before it is used."""
    made_by = taking_over.without_gone

    def wrong(factory: Any) -> Any:
        found = made_by(factory)
        deputy = next(r for r in range(len(found.robots)) if len(found.tours[r]) > 1)
        return replace(found, net=swapped(found, deputy, 0, 1))

    monkeypatch.setattr(taking_over, "without_gone", wrong)
    with pytest.raises(RunError) as caught:
        run_of("r4", 7.0)
    assert {one.code for one in caught.value.diagnostics} == {"NotProved"}


@pytest.mark.parametrize("times", [-1, 1])
def test_other_counts_are_refused(times: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The record says what was undone: once too often, or once too little."""
    run = run_of("r4", 7.0)
    factory, entries = laid_out().factory, [*entries_of(run.events)]
    nets = [*nets_after(factory, entries)]
    at = next(n for n, e in enumerate(entries) if isinstance(e, Undone) and e.exchanged)
    entry = entries[at]
    assert isinstance(entry, Undone)
    assert entry.transitions
    names = (*entry.transitions, "part2_e") if times > 0 else entry.transitions[1:]
    entries[at] = replace(entry, transitions=names)
    verdict = replay(factory.net, entries, None, factory.joins, nets)
    assert not verdict.refines and verdict.index == at and "takes back" in verdict.reason


# --- the command ----------------------------------------------------------------------------------


def test_end_to_end(pag: Path, run: Terminal, tmp_path: Path) -> None:
    """Printed, in JSON, and in a log, from which the nets follow."""
    faults, log = tmp_path / "faults.toml", tmp_path / "run.log"
    faults.write_text('[[fault]]\nkind = "dead"\nrobot = "r4"\nat = 7\n')
    words = ("run", pag, "--world", "ideal", "--units", 8, "--faults", faults, "--swap", 4)
    done = run(*words, "--deputies", "--log", log, "--json")
    assert done.status == 0, done.err
    (change,) = done.json["exchanges"]
    assert (change["dead"], change["deputy"]) == ("r4", "r2") and done.json["refines_net"]
    assert [one["deputy"] for one in done.json["failures"]["failures"]] == ["r2"]
    undone = [e for e in done.json["events"] if e.get("exchanged")]
    assert [e["robots"] for e in undone] == [["r4", "r2"]]
    assert change["fired"].keys() == {t.name for t in laid_out().factory.net.threaded.transitions}
    kept = read_log(log)
    assert verdict_on(kept, laid_out().factory, None).refines
    assert len(kept.header["layout"]["standby"]) > 1
    told = run(*words, "--deputies", "-v")
    assert "r4 is dead: r2 takes over the tours of r4 (deputy) in 4 s" in told.out
    assert "r2 takes over the tours of r4 (deputy); predicted from then on: " in told.out
    without = run(*words)
    assert without.status == 1 and "r4 is dead, and there is no spare" in without.err


def test_check_lists_those_laid_out(pag: Path, run: Terminal) -> None:
    assert run("check", pag, "--deputies", "--json").json["deputies"] == {
        "r1": [],
        "r2": ["r4"],
        "r3": [],
        "r4": ["r2"],
    }


@pytest.mark.parametrize(
    ("more", "code"),
    [
        (("--relay",), "BadValue"),
        (("--cycle", 3), "BadValue"),
    ],
)
def test_what_does_not_go_with_it(
    more: tuple[object, ...], code: str, pag: Path, run: Terminal
) -> None:
    done = run("run", pag, "--deputies", *more, "--json")
    assert done.status == 2 and done.codes == [code]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["truck", "chest"])
def test_products(name: str) -> None:
    """All robots with deputies of an example, in layouts that are certified; what is left when one
    is gone holds in MuJoCo from its beginning, too."""
    layout = read(ROOT / "examples" / f"{name}.pag", ground=Ground(deputies=True)).layout
    assert certify(layout).holds
    for dead, deputy in deputies_in(layout).items():
        part = part_of(layout, crew_with(layout.factory, dead, deputy))
        assert part is not None and certify(part).holds
    assert part is not None
    assert_good(Simulation(without_gone(part), RunRequest("mujoco", 2)).run())
