"""Pools of parts and cycle times, against brute force and against each other."""

from __future__ import annotations

import random
import re
from fractions import Fraction

import mujoco
import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import factory
from factory.apps.foreign_nets.behaviour import analyse
from factory.engine.mjcf import loading, model
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import cycle_time
from factory.engine.timing.pool import part_pool, with_wip
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.plant.factory import Factory
from tests.examples import without_hands
from tests.net_values import net_from
from tests.pag_values import factories, factory_of, paper, random_pag


def most_inside(factory: Factory, net: MarkedNet) -> dict[str, int]:
    """The most copies of each part ever inside, over every reachable marking."""
    events = len(net.net.transitions)
    start = (net.tokens, (0,) * events)
    seen, todo = {net.tokens: start[1]}, [start]
    most = {part.label: 0 for part in factory.leaves}
    while todo:
        tokens, fired = todo.pop()
        for part in factory.leaves:
            inside = fired[part.start] - fired[factory.dropoff.end]
            most[part.label] = max(most[part.label], inside)
        for event in range(events):
            if all(tokens[p] for p in net.net.preset[event]):
                after = list(tokens)
                for p in net.net.preset[event]:
                    after[p] -= 1
                for p in net.net.postset[event]:
                    after[p] += 1
                if tuple(after) not in seen:
                    counts = tuple(n + (i == event) for i, n in enumerate(fired))
                    seen[tuple(after)] = counts
                    todo.append((tuple(after), counts))
    return most


def test_the_papers_pools() -> None:
    factory = factory_of(paper())
    assert dict(part_pool(factory)) == {"part1": 3, "part2": 3, "part3": 2}
    assert dict(part_pool(factory, 2)) == {"part1": 2, "part2": 2, "part3": 2}
    assert most_inside(factory, marked(factory.net)) == dict(part_pool(factory))


@given(factories(8))
@settings(max_examples=15)
def test_pools_are_attained(factory: Factory) -> None:
    if len(factory.robots) <= 6:
        assert most_inside(factory, marked(factory.net)) == dict(part_pool(factory))


@given(factories(), st.integers(1, 4))
def test_wip_bounds_the_pool_and_keeps_the_net_live(factory: Factory, wip: int) -> None:
    net = with_wip(factory, wip)
    found = analyse(net)
    assert (found.live, found.reversible) == (True, True)
    free, bound = part_pool(factory), part_pool(factory, wip)
    assert {label: min(n, wip) for label, n in free.items()} == dict(bound)


def test_wip_bounds_what_is_inside() -> None:
    factory = factory_of(paper())
    assert most_inside(factory, with_wip(factory, 2)) == {"part1": 2, "part2": 2, "part3": 2}


@pytest.mark.parametrize("wip", [0, -1])
def test_wip_below_one_is_refused(wip: int) -> None:
    with pytest.raises(InputError, match="BadValue"):
        part_pool(factory_of(paper()), wip)


def test_a_part_alone() -> None:
    assert dict(part_pool(factory_of(random_pag(1, 0)))) == {"p0": 1}


def test_pools_of_a_long_chain() -> None:
    factory = factory_of(random_pag(4_001, 0, "chain"))
    pool = part_pool(factory)
    assert len(pool) == len(factory.leaves)
    assert max(pool.values()) > 1_000


def test_the_papers_cycle_time() -> None:
    factory = factory_of(paper())
    delays = {"sub3": 2.0, "sub2": 4.0, "sub1": 3.0, "part1": 1.0, "part2": 1.0, "dropoff": 1.0}
    found = cycle_time(factory, delays)
    assert (found.seconds, found.bottleneck) == (9.0, "r3")
    assert cycle_time(factory.net, [2.0, 0.5, 4.0, 3.0, 1.0, 1.0, 1.0]) == found
    assert cycle_time(factory, {"r4:nopart": 90.0}).bottleneck == "r4"
    assert cycle_time(factory, {}).bottleneck == "r1"


@pytest.mark.parametrize(
    "delays", [{"sub9": 1.0}, {"sub1": -1.0}, {"sub1": float("nan")}, [1.0] * 20]
)
def test_delays_are_checked(delays: dict[str, float] | list[float]) -> None:
    with pytest.raises(ValueError, match=r"delays|did you mean"):
        cycle_time(factory_of(paper()), delays)


@given(factories(30), st.data())
@settings(max_examples=50)
def test_the_cycle_time_is_the_maximum_cycle_ratio(factory: Factory, data: st.DataObject) -> None:
    count = len(factory.net.threaded.places)
    delays = data.draw(st.lists(st.integers(0, 50), min_size=count, max_size=count))
    seconds = [float(d) for d in delays]
    found = max_cycle_ratio(marked(factory.net), seconds)
    assert found.seconds == pytest.approx(cycle_time(factory.net, seconds).seconds)
    gears = {frozenset(gear.places) for gear in factory.net.gears}
    assert frozenset(found.circuit) in gears


@given(st.integers(0, 10**9))
@settings(max_examples=60)
def test_the_maximum_cycle_ratio_is_that_of_every_circuit(seed: int) -> None:
    rng = random.Random(seed)
    size = rng.randint(2, 5)
    names = [f"t{i}" for i in range(size)]
    rows = [(a, b, 1) for a, b in zip(names, names[1:] + names[:1], strict=True)]
    for _ in range(rng.randint(0, 5)):
        a, b = rng.sample(names, 2)
        rows.append((a, b, rng.randint(1, 3)))
    net = net_from(rows)
    delays = [rng.randint(0, 20) for _ in rows]
    graph: nx.DiGraph = nx.DiGraph()
    for i in range(len(rows)):
        graph.add_edge(("t", net.net.places[i].left[0]), ("p", i))
        graph.add_edge(("p", i), ("t", net.net.places[i].right[0]))
    ratios = [
        Fraction(sum(delays[i] for kind, i in c if kind == "p"))
        / sum(net.tokens[i] for kind, i in c if kind == "p")
        for c in nx.simple_cycles(graph)
    ]
    found = max_cycle_ratio(net, [float(d) for d in delays])
    assert found.seconds == pytest.approx(float(max(ratios)))


def test_wip_can_slow_a_factory_down() -> None:
    factory = factory_of(paper())
    delays = [1.0] * len(factory.operations)

    def seconds(net: MarkedNet) -> float:
        idle = [0.0] * (len(net.tokens) - len(delays))
        return max_cycle_ratio(net, [*delays, *idle]).seconds

    assert seconds(with_wip(factory, 1)) == 5.0 > seconds(marked(factory.net))
    assert seconds(with_wip(factory, 3)) == seconds(marked(factory.net))


@pytest.mark.parametrize(
    "rows",
    [
        [("a", "b", 0), ("b", "a", 0)],
        [("a", "b", 1)],
        [("a c", "b", 1), ("b", "a c", 0)],
    ],
)
def test_only_live_marked_graphs_have_a_cycle_time(rows: list[tuple[str, str, int]]) -> None:
    with pytest.raises(ValueError, match=r"live marked graph|no circuit"):
        max_cycle_ratio(net_from(rows), [0.0] * len(rows))


def test_a_pool_too_large_for_the_engine_bounds_the_units_inside(monkeypatch) -> None:
    layout = without_hands("lamp")
    pool = part_pool(layout.factory)
    whole = physical_model(layout)
    assert whole.wip is None and whole.bodies == sum(pool.values()) + len(pool)
    monkeypatch.setattr(model, "MOST_BODIES", whole.bodies - 1)
    fewer = physical_model(layout)
    assert fewer.wip == max(pool.values()) - 1 and fewer.bodies < whole.bodies
    monkeypatch.setattr(model, "MOST_BODIES", 1)
    assert physical_model(layout).wip == 1
    assert physical_model(layout, wip=3).wip == 3
    made = Simulation(layout, RunRequest(units=4))
    assert made.request.wip == 1 and made.run(max_time=1.0).physics.wip_chosen == 1
    asked = Simulation(layout, RunRequest(units=4, wip=2))
    assert asked.request.wip == 2 and asked.run(max_time=1.0).physics.wip_chosen is None


def test_the_engine_has_memory_for_all_pairs_of_bodies(monkeypatch) -> None:
    """Of a model whose pairs take most of it: the engine ends in an error where it is too small."""
    monkeypatch.setattr(model, "ARENA", 1)
    mates = (f"n{k} = mate(n{2 * k}, n{2 * k + 1});\n" for k in range(1, 64))
    parts = (f"n{k} = atomic();\n" for k in range(64, 128))
    pag = read_pag("".join(["root = n1;\n", *mates, *parts]), all_templates())
    made = physical_model(factory.lay_out(factory.compile(pag)), 1)
    bodies = made.xml.count("<body ") + 1
    memory = int(re.search(r'memory="(\d+)M"', made.xml)[1])
    assert memory == 1 + 4 * bodies * (bodies - 1) // 2**20 > 1
    m = loading.load(made)
    mujoco.mj_step(m, mujoco.MjData(m))
