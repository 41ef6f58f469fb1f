"""Definitions 3.1 to 3.6 as values, and the counts of the compiled net. Places that are never
marked together, and order places, against every marking of small nets. The coordinated net: what
waits in a laid-out factory is proved live, keeps to the compiled net, predicts what is measured,
and is what runs."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.engine.record.state import Event, State
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import Timing
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.theory.nets import exclusion
from factory.theory.nets.coordinated import CoordinatedNet
from factory.theory.nets.exclusion import ORDER, _Arc, _Paths, excluding, ordered
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.nets.threaded import ThreadedNet, Threads
from factory.theory.plant.factory import Factory
from tests.examples import with_hands
from tests.net_values import net_from
from tests.pag_values import factory_of, paper
from tests.random_products import random_product
from tests.slow import slow_but
from tests.state_space import explored
from tests.token_game import dates, enabled, follower

_T = (Transition("a"), Transition("b"))
_RING = PetriNet(_T, (Place("p", (0,), (1,)), Place("q", (1,), (0,))))


def test_an_event_needs_its_preset_and_an_empty_postset() -> None:
    assert enabled(_RING, frozenset({1})) == (0,)
    assert enabled(_RING, frozenset({0})) == (1,)
    assert enabled(_RING, frozenset({0, 1})) == ()
    assert follower(_RING, frozenset({1}), (0,)) == frozenset({0})


def threads_of(factory: Factory, marked: frozenset[int]) -> Threads:
    starts = [operation.start for operation in factory.operations]
    return Threads(factory.net.threaded, factory.net.threads_of(marked), starts)


def test_what_may_not_fire_does_not() -> None:
    factory = factory_of(paper())
    by_label = factory.by_label
    threads = threads_of(factory, factory.net.initial_marking)
    before, start = dict(threads.robots), by_label["part1"].start
    for events, words in (
        ((by_label["part1"].end,), "not all are enabled"),
        ((start, by_label["sub1"].start), "not all are enabled"),
        ((start, start), "not a detached set"),
    ):
        with pytest.raises(AssertionError, match=words):
            threads.fire(events)
        assert threads.robots == before
    threads.fire((start,))
    with pytest.raises(AssertionError, match="not all are enabled"):
        threads.fire((start,))


def test_a_robot_that_is_not_where_its_token_is_does_not_fire() -> None:
    """Elsewhere, nowhere, or where another is already."""
    net = ThreadedNet(_RING, ((((1, 0), (0, 0)),), (((0, 0), (1, 0)),)))
    threads = Threads(net, {(0, 0): 0, (1, 0): 1}, (1,))
    threads.marked[:] = bytes([1, 0])
    with pytest.raises(AssertionError, match="not legal"):
        threads.fire((1,))


MARKINGS = 3_000
"""Nets with more markings are not explored."""


def geared(rng: random.Random) -> tuple[MarkedNet, list[int]]:
    """A live marked graph of gears that share transitions, each with one token, some of them as
    they are after some firings, and a sequence that fires each transition once."""
    events = rng.randint(2, 7)
    order = [*range(events)]
    rng.shuffle(order)
    gears = [sorted(rng.sample(range(events), rng.randint(2, events))) for _ in range(4)]
    for lonely in {*range(events)} - {at for gear in gears for at in gear}:
        gears.append(sorted({lonely, rng.choice([at for at in range(events) if at != lonely])}))
    edges = [
        (order[a], order[b], int(a > b))
        for gear in gears
        for a, b in zip(gear, gear[1:] + gear[:1], strict=True)
    ]
    places = tuple(Place(f"p{n}", (a,), (b,)) for n, (a, b, _) in enumerate(edges))
    net = PetriNet(tuple(Transition(f"t{n}") for n in range(events)), places)
    return MarkedNet(net, tuple(tokens for _, _, tokens in edges)), order


def together(net: MarkedNet) -> set[tuple[int, int]] | None:
    """The pairs of places that some reachable marking marks both; None where there are too many
    markings."""
    truth = explored(net, MARKINGS)
    if truth is None:
        return None
    at_once = {tuple(p for p, tokens in enumerate(m) if tokens) for m in truth.markings}
    return {pair for marking in at_once for pair in combinations(marking, 2)}


def check_circuit(net: MarkedNet, circuit: tuple[int, ...], pair: tuple[int, int]) -> None:
    """It is a circuit of the net, goes through both places and has one token."""
    assert {*pair} <= {*circuit}
    for before, after in zip(circuit, circuit[1:] + circuit[:1], strict=True):
        assert net.right[before] == net.left[after]
    assert sum(net.tokens[place] for place in circuit) == 1


@given(st.randoms(use_true_random=False))
@settings(max_examples=150)
def test_excluded_where_never_marked_together(rng: random.Random) -> None:
    net, _ = geared(rng)
    pairs = [*combinations(range(len(net.net.places)), 2)]
    marked = together(net)
    if marked is None:
        return
    circuits = excluding(net, pairs)
    for pair, circuit in zip(pairs, circuits, strict=True):
        assert (circuit is None) == (pair in marked)
        if circuit is not None:
            check_circuit(net, circuit, pair)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exclusion, "BLOCK", 2)
        assert excluding(net, pairs) == circuits


@given(st.randoms(use_true_random=False))
@settings(max_examples=150)
def test_ordered_places_are_never_marked_together(rng: random.Random) -> None:
    """And the net stays live, safe and reversible; what is left over the sequence marks itself; no
    order place could be left out."""
    net, sequence = geared(rng)
    every = [*combinations(range(len(net.net.places)), 2)]
    pairs = rng.choices(every, k=rng.randint(1, len(every)))
    result = ordered(net, sequence, pairs, earlier(net, sequence, rng))
    assert {*result.places} == {*pairs} - marked_by(net, sequence)
    for circuit, pair in zip(excluding(result.net, result.places), result.places, strict=True):
        assert circuit is not None
        check_circuit(result.net, circuit, pair)
    truth = explored(result.net, MARKINGS)
    if truth is not None:
        assert truth.behaviour == (True, True, True)
        assert not {*result.places} & (together(result.net) or set())
    for place in range(len(net.net.places), len(result.net.net.places)):
        assert result.net.net.places[place].mode == ORDER
        fewer = without(result.net, place)
        assert None in excluding(fewer, result.places)


def earlier(net: MarkedNet, sequence: list[int], rng: random.Random) -> dict[int, int]:
    """For some transitions one before each, with a place without token in between."""
    empty = [p for p, tokens in enumerate(net.tokens) if not tokens]
    before = {net.right[p]: net.left[p] for p in empty}
    return {event: before[event] for event in sequence if event in before and rng.random() < 0.5}


def marked_by(net: MarkedNet, sequence: list[int]) -> set[tuple[int, int]]:
    """The pairs that a firing sequence marks both."""
    tokens, pairs = list(net.tokens), set[tuple[int, int]]()
    for event in sequence:
        pairs.update(combinations((p for p, count in enumerate(tokens) if count), 2))
        for place in net.net.preset[event]:
            tokens[place] -= 1
        for place in net.net.postset[event]:
            tokens[place] += 1
    assert tuple(tokens) == net.tokens
    return pairs


def without(net: MarkedNet, place: int) -> MarkedNet:
    """The net without a place, which has no token from now on and nothing to do with any other."""
    places = list(net.net.places)
    places[place] = replace(places[place], left=(), right=())
    return MarkedNet(replace(net.net, places=tuple(places)), net.tokens)


def test_what_can_not_be_asked_is_refused() -> None:
    net = net_from([("a", "b", 1), ("b", "a", 0), ("b", "a", 0)])
    assert excluding(net, [(0, 1), (1, 2)]) == [(0, 1), None]
    assert not ordered(net, [1, 0], [(1, 2)]).places
    with pytest.raises(ValueError, match="sequence"):
        ordered(net, [0, 1], [])
    with pytest.raises(ValueError, match="marked graph"):
        excluding(net_from([("a c", "b", 1), ("b", "a", 0), ("b", "c", 0)]), [(0, 1)])


@pytest.mark.parametrize(("tokens", "is_implied"), [(0, False), (1, True)])
def test_an_arc_is_implied_by_a_path_with_no_more_tokens(tokens: int, is_implied: bool) -> None:
    """The path over the place without a token, though another one with a token goes beside it."""
    ends, marked = ((0, 1), (0, 1), (1, 2), (2, 0)), (0, 1, 1, 1)
    places = tuple(Place(f"p{n}", (a,), (b,)) for n, (a, b) in enumerate(ends))
    net = MarkedNet(PetriNet(tuple(map(Transition, "abc")), places), marked)
    assert _Paths(net).implies(_Arc(0, 2, tokens, 0)) == is_implied


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
    net, compiled = coordinated(layout), MarkedNet.of(layout.factory.net)
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
    made = Timed.of(Timing(layout))
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
