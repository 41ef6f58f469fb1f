"""Pools of parts and cycle times, against brute force and against each other."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.engine.mjcf import model
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.pool import part_pool
from factory.support.errors import InputError
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from factory.theory.nets.marked import MarkedNet
from factory.theory.plant.factory import Factory
from tests.examples import without_hands
from tests.net_values import net_from
from tests.pag_values import factories, factory_of, paper


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
    assert most_inside(factory, MarkedNet.of(factory.net)) == dict(part_pool(factory))


def test_wip_below_one_is_refused() -> None:
    with pytest.raises(InputError, match="BadValue"):
        part_pool(factory_of(paper()), -1)


def test_the_papers_cycle_time() -> None:
    factory = factory_of(paper())
    delays = {"sub3": 2.0, "sub2": 4.0, "sub1": 3.0, "part1": 1.0, "part2": 1.0, "dropoff": 1.0}
    found = CycleTime.of(factory, delays)
    assert (found.seconds, found.bottleneck) == (9.0, "r3")
    assert CycleTime.of(factory.net, [2.0, 0.5, 4.0, 3.0, 1.0, 1.0, 1.0]) == found
    assert CycleTime.of(factory, {"r4:nopart": 90.0}).bottleneck == "r4"
    assert CycleTime.of(factory, {}).bottleneck == "r1"


@pytest.mark.parametrize("delays", [{"sub9": 1.0}, {"sub1": -1.0}, [1.0] * 20])
def test_delays_are_checked(delays: dict[str, float] | list[float]) -> None:
    with pytest.raises(ValueError, match=r"delays|did you mean"):
        CycleTime.of(factory_of(paper()), delays)


@given(factories(30), st.data())
@settings(max_examples=50)
def test_the_cycle_time_is_the_maximum_cycle_ratio(factory: Factory, data: st.DataObject) -> None:
    count = len(factory.net.threaded.places)
    delays = data.draw(st.lists(st.integers(0, 50), min_size=count, max_size=count))
    seconds = [float(d) for d in delays]
    found = max_cycle_ratio(MarkedNet.of(factory.net), seconds)
    assert found.seconds == pytest.approx(CycleTime.of(factory.net, seconds).seconds)
    gears = {frozenset(gear.places) for gear in factory.net.gears}
    assert frozenset(found.circuit) in gears


def test_only_live_marked_graphs_have_a_cycle_time() -> None:
    rows = [("a", "b", 1)]
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
