"""Records replayed, markings named, and the ways that lead to them."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.apps.runs.start import legal_marking
from factory.engine.record.history import firings
from factory.engine.record.replay import replay
from factory.support.errors import InputError
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.threaded import ThreadedNet
from factory.theory.plant.factory import Factory
from tests.net_values import fair_run, net_from, random_legal_marking
from tests.pag_values import factories, factory_of, paper
from tests.token_game import follower


def names(net: GearNet, events: list[int]) -> list[str]:
    """The names of transitions."""
    return [net.threaded.transitions[e].name for e in events]


@given(factories(), st.randoms(use_true_random=False), st.booleans())
def test_runs_refine_their_net(factory: Factory, rng: random.Random, elsewhere: bool) -> None:
    net = factory.net
    start = random_legal_marking(net, rng) if elsewhere else net.initial_marking
    record = fair_run(net, start, 60, rng)
    found = replay(net, names(net, record), start)
    marking = start
    for event in record:
        marking = follower(net.threaded.net, marking, (event,))
    assert (found.refines, found.index, found.reason) == (True, None, "")
    assert found.marking == marking
    assert found.events == len(record)


@given(factories(), st.randoms(use_true_random=False), st.integers(0, 2))
def test_a_record_that_was_changed_does_not(factory: Factory, rng: random.Random, how: int) -> None:
    net = factory.net
    record = names(net, fair_run(net, net.initial_marking, 40, rng))
    at = rng.randrange(len(record))
    bad = [*record[:at], record[at], *record[at:]]
    if how == 1:
        bad[at] = "nonsense"
    if how == 2:
        first = record.index(record[at])
        bad = record[:first] + record[first + 1 :] + [record[at]] * 3
    found = replay(net, bad)
    assert not found.refines
    assert found.index is not None
    assert found.events == found.index
    assert found.reason


def test_the_reasons() -> None:
    net = factory_of(paper()).net
    assert "sub1_s is not enabled: r5:part1 is not marked" in replay(net, ["sub1_s"]).reason
    assert "no transition 'sub9_s'" in replay(net, ["sub9_s"]).reason
    twice = replay(net, ["part1_s"], net.initial_marking | {0})
    assert (twice.index, twice.refines) == (-1, False)
    assert "twice" in twice.reason
    assert "leaves out r1" in replay(net, [], frozenset()).reason
    assert "not there" in replay(net, [], frozenset({99})).reason


def test_a_gear_of_one_place_never_fires() -> None:
    bare = net_from([("a", "a", 1)]).net
    net = GearNet(
        ThreadedNet(bare, ((((0, 0), (0, 0)),),)), (Gear("r1", "", (0,), (0,)),), (0,), ((0,),)
    )
    assert replay(net, ["a"]).reason == "a is not enabled: p0 is marked already"


def test_a_robot_that_is_left_behind() -> None:
    bare = net_from([("b", "a", 1), ("a", "b", 0)]).net
    moves = ((((0, 0), (1, 0)),), (((1, 0), (0, 0)),))
    gears = tuple(Gear(robot, "", (0, 1), (1, 0)) for robot in ("r1", "r2"))
    net = GearNet(ThreadedNet(bare, moves), gears, (0, 0), ((0, 1), (0,)))
    assert replay(net, ["a"]).reason == "after a the marking is not legal at p0"


@pytest.mark.parametrize(
    ("text", "column", "message", "hint"),
    [("r5:nopart, sub1", 12, "r5 is marked twice", "sub1 needs all its robots")],
)
def test_markings_that_are_not_legal(text: str, column: int, message: str, hint: str) -> None:
    with pytest.raises(InputError) as caught:
        legal_marking(factory_of(paper()).net, text)
    found = caught.value.diagnostics[0]
    assert found.code == "BadMarking"
    assert found.position is not None
    assert found.position.column == column
    assert message in found.message
    assert hint in found.hint


def test_an_operation_that_lacks_robots() -> None:
    factory = factory_of(paper())
    net = factory.net
    at = factory.by_label["sub1"].place
    odd = replace(net, initial=(*net.initial[:4], at, net.initial[5]))
    with pytest.raises(InputError, match=r"r5 is at sub1, which also needs r6, r3"):
        legal_marking(odd, "")


def test_firings_need_a_legal_marking() -> None:
    net = factory_of(paper()).net
    with pytest.raises(ValueError, match="gear of r1 exactly once"):
        firings(net, frozenset())
    assert set(firings(net, net.initial_marking).values()) == {0}
