"""Parallel stations: the branch of a slow robot is there several times, and serves in turn."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from factory.apps.few_robots.parallel import in_parallel
from factory.apps.few_robots.sharing import with_branches
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import CycleTime
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.durations import Pace
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project, read
from factory.support.errors import InputError
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG, Parameter
from tests.command_line import Terminal
from tests.fold_values import branched, plain, simulated_cycle, table_of
from tests.slow import slow_but
from tests.state_space import explored

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


def replicated(k: int, label: str = "sub2") -> Factory:
    """Its factory with so many branches."""
    return branched(plain(slow()), (label, k))


def truth(factory: Factory, limit: int = 150_000) -> tuple[bool, bool, bool]:
    """Live, safe and reversible, by every marking."""
    found = explored(MarkedNet.of(factory.net), limit)
    assert found is not None
    return found.behaviour


def test_one_branch_changes_nothing() -> None:
    factory = plain(slow())
    assert in_parallel(factory, (("sub2", 1),)) is factory.plan


@pytest.mark.parametrize("k", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_parallel_branches_are_live_safe_and_reversible(k: int) -> None:
    """By the proof, and by every marking."""
    factory = replicated(k)
    verdict = verify(factory.net)
    assert verdict.holds and verdict.gear_train and not verdict.faults
    assert truth(factory) == (True, True, True)


def delays(factory: Factory) -> list[float]:
    """A second for each operation, and what it takes there."""
    return [1.0 + operation.dwell for operation in factory.operations]


@pytest.mark.parametrize("k", slow_but([1, 3], [1, 2, 3, 4, 5, 6]))
def test_theorem_4(k: int) -> None:
    """The cycle time is the greater of that of the rest and that of the branch, divided by k."""
    factory = replicated(k)
    rest, branch = 3.0, 1.0 + 1.0 + 11.0 + 1.0
    found = CycleTime.of(factory, delays(factory))
    assert found.seconds == pytest.approx(max(rest, branch / k))
    seconds = [*delays(factory), *[0.0] * (len(factory.net.threaded.places))]
    seconds = seconds[: len(factory.net.threaded.places)]
    token_game = simulated_cycle(factory.net, seconds) / k
    assert token_game == pytest.approx(found.seconds)


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


@cache
def project(k: int) -> Project:
    """That product with so many branches."""
    made = Project(slow(), all_templates(), load_catalogue())
    return with_branches(made, [("sub2", k)])


def test_the_floor_and_the_bound_are_those_of_one_unit() -> None:
    layout = project(3).layout
    pace = Pace.of(project(3).settings)
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, pace)
    assert 10.0 / 3 < bound < pace.cycle_of(layout) < 5.0


def test_a_part_in_the_wrong_branch_is_found() -> None:
    """A weld that takes a part of another unit."""
    made = project(2)
    request = RunRequest("mujoco", 2, settings=made.settings)
    simulation = Simulation(made.layout, request)
    parts = simulation.physical.parts
    welds, one, other = parts.holdings.weld, (2, "part1"), (3, "part1@2")
    welds[one], welds[other] = welds[other], welds[one]
    run = watched(simulation, max_time=15.0, every_tick=True)
    assert not run.succeeded and not run.refines_net


TEXT = """root = sub3;
sub3 = insert ( part3, sub2 ); sub2 = weld ( sub1, dwell = 2 ); sub1 = insert ( part1, part2 );
part1 = atomic(); part2 = atomic(); part3 = atomic()
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """That product in a file."""
    path = tmp_path / "slow.pag"
    path.write_text(TEXT)
    return path


def test_the_option_and_the_table_say_the_same(run: Terminal, file: Path) -> None:
    one = run("check", file, "--json").json
    two = run("check", file, "--parallel", "sub2=2", "--json").json
    assert (one["robots"], two["robots"]) == (4, 7)
    assert two["live"] and two["safe"] and two["reversible"]
    file.with_name("factory.toml").write_text("[parallel]\nsub2 = 2\n")
    assert run("check", file, "--json").json == two
    assert run("check", file, "--parallel", "sub2=1", "--json").json == one


@pytest.mark.parametrize(
    ("name", "label"), [("paper", "sub2"), pytest.param("truck", "log2", marks=pytest.mark.slow)]
)
def test_a_unit_waits_for_none_that_comes_after_it(name: str, label: str) -> None:
    """Units are made one after the other in the order by which machines are kept apart: the last
    unit that is asked for does not wait for a part of a unit that nobody asks for."""
    layout = with_branches(read(f"examples/{name}.pag"), [(label, 2)]).layout
    turns = [layout.factory.operations[number].turn for number in layout.factory.order]
    assert turns == sorted(turns)
    assert watched(Simulation(layout, RunRequest("ideal", units=1)), max_time=120.0).succeeded
