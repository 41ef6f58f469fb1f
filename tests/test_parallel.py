"""Parallel stations: the branch of a slow robot is there several times, and serves in turn."""

from __future__ import annotations

import json
import random
from dataclasses import replace

import pytest

from factory.compiler.parallel import in_parallel
from factory.export.certificate.check import check_certificate
from factory.export.certificate.writer import certificate
from factory.foreign_nets.explore import explore
from factory.nets.marked import marked
from factory.nets.verify import verify
from factory.plant.factory import Factory
from factory.plant.programs import program_of, write_program
from factory.problem.pag import PAG, Parameter
from factory.support.errors import InputError
from factory.timing.cycle_time import cycle_time
from factory.timing.pool import part_pool
from tests.fold_values import plain, random_fold, simulated_cycle, swapped, table_of
from tests.pag_values import paper

DWELL = 10.0

SLOW = (
    ("sub3", "insert", ("part3", "sub2")),
    ("sub2", "weld", ("sub1",)),
    ("sub1", "insert", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part3", "atomic", ()),
)
"""The paper's example with inserts: what is slow, a weld, is on a branch that is inserted."""


def slow() -> PAG:
    """That product, with a weld of 10 s."""
    found = table_of(SLOW)
    weld = found["sub2"]
    parameters = (Parameter("dwell", DWELL),)
    nodes = (replace(n, parameters=parameters) if n is weld else n for n in found.nodes)
    return replace(found, nodes=tuple(nodes))


def beside() -> PAG:
    """The same with a further part, which one robot brings to each unit."""
    top = (("sub4", "insert", ("sub3", "part4")), ("part4", "atomic", ()))
    return table_of((top[0], *SLOW, top[1]))


def replicated(k: int, label: str = "sub2") -> Factory:
    """Its factory with so many branches."""
    return in_parallel(plain(slow()), ((label, k),))


def truth(factory: Factory, limit: int = 150_000) -> tuple[bool, bool, bool]:
    """Live, safe and reversible, by every marking."""
    found = explore(marked(factory.net), limit)
    assert found.complete
    live = found.deadlock is None and found.starved is None
    return live, found.unsafe is None, found.one_way is None


# --- the net -------------------------------------------------------------------------------------


def test_one_branch_changes_nothing() -> None:
    factory = plain(slow())
    assert in_parallel(factory, (("sub2", 1),)) is factory


@pytest.mark.parametrize("k", [2, 3])
def test_parallel_branches_are_live_safe_and_reversible(k: int) -> None:
    """By the proof, and by every marking."""
    factory = replicated(k)
    verdict = verify(factory.net)
    assert verdict.holds and verdict.gear_train and not verdict.faults
    assert truth(factory) == (True, True, True)


def test_robots_and_stations() -> None:
    """The branch has three robots and is there three times; all others are there once."""
    factory = replicated(3)
    assert (len(plain(slow()).robots), len(factory.robots)) == (4, 10)
    assert factory.period == 3 and factory.products == ("sub3", "sub3@2", "sub3@3")
    assert [len(tours) for tours in factory.tours] == [3] + [1] * 9
    brought = [factory.by_label[label] for label in factory.products]
    assert [o.robots for o in brought] == [(0, 1), (0, 2), (0, 3)]
    assert {o.written for o in brought} == {"sub3"}


def delays(factory: Factory) -> list[float]:
    """A second for each operation, and what it takes there."""
    return [1.0 + operation.dwell for operation in factory.operations]


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5, 6])
def test_theorem_4(k: int) -> None:
    """The cycle time is the greater of that of the rest and that of the branch, divided by k."""
    factory = replicated(k)
    rest, branch = 3.0, 1.0 + 1.0 + 11.0 + 1.0
    found = cycle_time(factory, delays(factory))
    assert found.seconds == pytest.approx(max(rest, branch / k))
    seconds = [*delays(factory), *[0.0] * (len(factory.net.threaded.places))]
    seconds = seconds[: len(factory.net.threaded.places)]
    token_game = simulated_cycle(factory.net, seconds) / k
    assert token_game == pytest.approx(found.seconds)


@pytest.mark.parametrize("seed", range(40))
def test_random_branches(seed: int) -> None:
    """Branches of random products, of folds too, one within another: live, and of the period that
    their numbers give; Theorem 4 by the token game."""
    rng = random.Random(seed)
    factory = random_fold(seed, 14)
    labels = [
        o.before[o.robots.index(tour.index)]
        for tour in factory.robots[1:]
        for o in [factory.operations[tour.operations[-1]]]
        if o.before[o.template.carrier - 1] != "nopart" and len(o.robots) == 2
    ]
    labels = [label for label in labels if label != "nopart"]
    chosen = [(label, rng.randint(1, 3)) for label in rng.sample(labels, min(2, len(labels)))]
    try:
        found = in_parallel(factory, chosen)
    except InputError as error:
        assert "one robot brings" in str(error) or "room for one" in str(error)
        return
    verdict = verify(found.net)
    assert verdict.holds and not verdict.faults
    assert len(found.making) == found.period * len(factory.making)
    times = [rng.uniform(0.5, 3.0) for _ in factory.operations]
    number = {o.label: n for n, o in enumerate(factory.operations)}
    seconds = [times[number[o.written]] for o in found.operations]
    unit = cycle_time(found, seconds).seconds
    assert unit <= cycle_time(factory, times).seconds + 1e-9
    places = len(found.net.threaded.places)
    game = simulated_cycle(found.net, [*seconds, *[0.0] * (places - len(seconds))])
    assert game / found.period == pytest.approx(unit, rel=1e-2)


def test_a_station_out_of_turn_is_refused() -> None:
    """Two units of the output robot's program exchanged: dead, with a circuit that says so."""
    factory = in_parallel(plain(beside()), (("sub2", 3),))
    assert verify(factory.net).holds
    for one, other in ((0, 1), (1, 2), (0, 2)):
        verdict = verify(swapped(factory, 0, one, other))
        assert verdict.gear_train and not verdict.live
        assert "carries no token" in str(verdict.faults[0])


def test_copies_inside() -> None:
    """As many as without, and one more for each further branch."""
    pool = part_pool(replicated(3))
    assert sum(n for label, n in pool.items() if label.startswith("part1")) == 6


def test_programs_of_a_period() -> None:
    factory = replicated(2)
    output, first, second = (write_program(program_of(factory, robot)) for robot in (0, 1, 2))
    assert "If state_1 = nopart ∧ next_1 = part3@2\n" in output
    assert "Run ẋ_1 = π_1 ∘ insert(x_1, x_3) Until state_1 = sub3@2\n" in output
    assert "next_1 := part3\n" in output
    assert "Run ẋ_2 = wait Until state_1 = part3\n" in first
    assert "Run ẋ_3 = wait Until state_1 = part3@2\n" in second


@pytest.mark.parametrize("k", [2, 3])
def test_the_certificate_is_checked_by_the_other_program(k: int) -> None:
    net = replicated(k).net
    document = json.loads(json.dumps(certificate(net, verify(net))))
    assert check_certificate(document) == []


@pytest.mark.parametrize(
    ("label", "words", "hint"),
    [
        ("sub3", "is made by the output robot", "mate"),
        ("sub1", "it becomes 'sub2' on its robot", "name 'sub2'"),
        ("sub9", "there is no label 'sub9'", "did you mean"),
    ],
)
def test_what_has_no_branch_of_its_own(label: str, words: str, hint: str) -> None:
    with pytest.raises(InputError) as error:
        replicated(2, label)
    (diagnostic,) = error.value.diagnostics
    assert diagnostic.code == "Parallel" and words in diagnostic.message
    assert hint in diagnostic.hint


def test_a_mate_has_one_junction() -> None:
    with pytest.raises(InputError, match="room for one"):
        in_parallel(plain(paper()), (("sub2", 2),))
