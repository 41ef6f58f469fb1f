"""Exports of runs and factories with failures: what is undone is said, and nothing else changes."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.exporting import Subject, exporters
from factory.exporting.events import rows
from factory.exporting.pnml import write_pnml
from factory.foreign_nets.pnml_reader import read_pnml
from factory.nets.marked import marked
from factory.nets.undo import marking_after, undo
from factory.plant.factory import Factory
from factory.plant.failing_transitions import failing_transitions
from factory.plant.material import joins_of
from factory.record.log import Log
from tests.command_line import PAPER, Terminal
from tests.failing_runs import failing
from tests.simulation_values import layout_of
from tests.state_space import explored
from tests.token_game import enabled, follower


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log")


# --- events ---------------------------------------------------------------------------------------


def test_what_is_undone_is_a_row_of_its_own(log: Log) -> None:
    """Rows less those that are undone are what lasts; a unit is counted again after that."""
    count, undone = Counter[str](), 0
    for row in rows(log):
        if row.kind.endswith(" undone"):
            assert row.unit == count[row.transition]
            count[row.transition] -= 1
            undone += 1
        else:
            count[row.transition] += 1
            assert row.unit == count[row.transition]
    assert undone == sum(len(entry.transitions) for _, entry in log.undone) > 0
    assert +count == Counter(name for _, name in log.lasting)
    times = [row.time_s for row in rows(log)]
    assert times == sorted(times)


def test_csv_says_so(log: Log) -> None:
    text = exporters()["csv"].export(Subject(Path("log"), log))
    assert isinstance(text, str)
    kinds = Counter(row["kind"] for row in csv.DictReader(io.StringIO(text)))
    assert kinds.keys() == {"start", "end", "start undone", "end undone"}


# --- the net --------------------------------------------------------------------------------------


FACTORIES: dict[str, Factory] = {name: layout_of(name).factory for name in ("paper", "truck")}


@settings(max_examples=60, deadline=None)
@given(st.sampled_from([*FACTORIES]), st.integers(0, 2**32 - 1), st.integers(1, 80))
def test_failing_transitions_are_undos(name: str, seed: int, steps: int) -> None:
    """Wherever one is enabled, it leads to where the undo leads that it stands for."""
    factory = FACTORIES[name]
    net, joins = factory.net, joins_of(factory)
    marking, fired = net.initial_marking, [1] * len(net.threaded.transitions)
    draw = Random(seed)
    for _ in range(steps):
        event = draw.choice(sorted(enabled(net.threaded.net, marking)))
        marking = follower(net.threaded.net, marking, [event])
        fired[event] += 1
    for failure in failing_transitions(factory):
        if failure.takes not in marking:
            continue
        after = frozenset(marking - {failure.takes} | {*failure.gives})
        assert after == marking_after(net, undo(net, fired, failure.asked, joins))
        assert len(after) == len(marking) - 1 + len(failure.gives)


def test_the_net_with_failures_is_read_back(run: Terminal) -> None:
    """Another program finds it live, safe and reversible, with the same places."""
    plain = run("export", PAPER, "--format", "pnml").out
    net = FACTORIES["paper"].net
    assert plain == write_pnml(net).rstrip("\n") + "\n" and ":again" not in plain
    text = run("export", PAPER, "--format", "pnml", "--of", "failures").out
    found = read_pnml(text)
    subject = marked(found)
    names = [t.name for t in subject.net.transitions]
    extra = names[len(net.threaded.transitions) :]
    assert extra == [one.name for one in failing_transitions(FACTORIES["paper"])]
    assert {"sub1:again", "part1:scrap", "part1:refused", "part1:scrap/sub1"} <= {*extra}
    assert [p.name for p in subject.net.places] == [p.name for p in net.threaded.places]
    assert subject.tokens == marked(net).tokens
    truth = explored(subject)
    assert truth is not None and truth.behaviour == (True, True, True)


def test_a_net_from_elsewhere_has_no_failures(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "net.pnml"
    run("export", PAPER, "--format", "pnml", "-o", file)
    assert run("export", file, "--format", "pnml", "--of", "failures", "--json").codes == ["Usage"]
