"""The coordinated net: what waits in a laid-out factory is proved live, keeps to the compiled net,
predicts what is measured, and is what runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from factory.engine.record.state import Event, State
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timed import timed
from factory.engine.timing.timing import Timing
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.theory.nets.coordinated import CoordinatedNet
from factory.theory.nets.marked import MarkedNet, marked
from tests.examples import with_hands
from tests.random_products import random_product
from tests.slow import slow_but
from tests.token_game import dates

HANDS = ("lamp", "stool", "truck", "chair")


def fired(net: MarkedNet, events: list[int]) -> list[int]:
    """The tokens after a sequence of transitions, each of which has to be enabled."""
    tokens = list(net.tokens)
    for event in events:
        name = net.net.transitions[event].name
        assert all(tokens[p] for p in net.net.preset[event]), f"{name} is not enabled"
        for p in net.net.preset[event]:
            tokens[p] -= 1
        for p in net.net.postset[event]:
            tokens[p] += 1
    return tokens


def one_unit_alone(layout: Layout, net: CoordinatedNet) -> list[int]:
    """σ: each transition once, passes and strokes as soon as they can come."""
    compiled, graph = len(layout.factory.net.threaded.transitions), net.net
    tokens, sequence = list(graph.tokens), list[int]()
    todo = [e for n in layout.factory.order for e in (2 * n, 2 * n + 1)]
    extra = {*range(compiled, len(graph.net.transitions))}
    while todo or extra:
        ready = (e for e in sorted(extra) if all(tokens[p] for p in graph.net.preset[e]))
        event = next(ready, -1)
        if event < 0:
            event = todo.pop(0)
        extra.discard(event)
        sequence.append(event)
        for p in graph.net.preset[event]:
            tokens[p] -= 1
        for p in graph.net.postset[event]:
            tokens[p] += 1
    return sequence


def product_of(seed: int, folder: Path) -> Layout:
    file = folder / "p.pag"
    file.write_text(random_product(seed))
    return read(file).layout


@pytest.mark.parametrize("seed", slow_but([0, 1], range(6)))
def test_it_is_the_compiled_net_with_more_that_restricts_it(seed: int, tmp_path: Path) -> None:
    layout = product_of(1200 + seed, tmp_path)
    net, compiled = coordinated(layout), marked(layout.factory.net)
    assert net.net.net.places[: len(compiled.tokens)] == compiled.net.places
    assert net.net.tokens[: len(compiled.tokens)] == compiled.tokens
    assert net.net.is_marked_graph and not net.deadlock


@pytest.mark.parametrize("name", slow_but(["stool"], HANDS))
def test_one_unit_can_be_made_alone_and_everything_is_as_before(name: str) -> None:
    """Σ stays possible, whatever waits were added, and leads back to where it began."""
    layout = with_hands(name)
    net = coordinated(layout)
    assert fired(net.net, one_unit_alone(layout, net)) == list(net.net.tokens)


@pytest.mark.parametrize("name", slow_but(["lamp"], ["lamp", "truck"]))
def test_the_cycle_time_is_the_cycle_ratio(name: str) -> None:
    """Against the dates of a token game in which everything comes as soon as it can."""
    layout = with_hands(name)
    made = timed(Timing(layout))
    times = dates(made.net, list(made.seconds), 60)
    end = layout.factory.dropoff.end
    measured = (times[end][-1] - times[end][29]) / 30
    assert made.pace == pytest.approx(measured, rel=1e-6)


@pytest.mark.parametrize("distributed", slow_but([False], [False, True]))
def test_what_runs_is_what_was_proved(distributed: bool) -> None:
    """Each operation of a run starts when the hands that it waits for are past, by positions alone;
    without the orders some do not."""
    layout = with_hands("truck")
    orders = coordinated(layout).orders
    assert late(layout, RunRequest(units=2, jitter=0.3, distributed=distributed), True) == []
    assert {order.start for order in orders} > set()
    assert late(layout, RunRequest(units=2, jitter=0.3, distributed=distributed), False)


def late(layout: Layout, request: RunRequest, kept: bool) -> list[str]:
    """The starts that came while a hand that was to be away was not: since its last delivery its
    robot has been short of the point all the time."""
    simulation = Simulation(layout, request)
    orders = coordinated(layout).orders
    if not kept:
        simulation.supervisor.ordering = Ordering()
    transitions = layout.factory.net.threaded.transitions
    number = {transition.name: n for n, transition in enumerate(transitions)}
    seen, away, early = 0, set[Any](), list[str]()

    def look(state: State) -> None:
        nonlocal seen
        x = simulation.world.sense()[0]
        events = [number[e.transition] for e in state.events[seen:] if isinstance(e, Event)]
        seen = len(state.events)
        for order in orders:
            if order.start in events and order.past in away:
                early.append(transitions[order.start].name)
        away.difference_update(p for p in [*away] if p.holds(float(x[p.axis]) + 0.002))
        away.update(o.past for o in orders if o.past.after in events)

    simulation.run([look])
    return early
