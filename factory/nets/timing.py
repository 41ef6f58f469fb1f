"""Cycle times: of a gear net by its gears, of any live marked graph by its critical circuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from factory.errors import did_you_mean
from factory.factory import Factory
from factory.nets.gears import GearNet
from factory.nets.marked import NONE, MarkedNet, marked, token_free

Delays = Mapping[str, float] | Sequence[float]
"""Seconds that a token stays on a place: by the place's name (an operation's is its label), or by
the numbers of the first places, which are the operations. A place left out takes no time."""


@dataclass(frozen=True, slots=True)
class CycleTime:
    """The mean time between two products [s], and the robot that allows no less."""

    seconds: float
    bottleneck: str


@dataclass(frozen=True, slots=True)
class CriticalCircuit:
    """The greatest quotient of delays [s] and tokens over circuits, and one circuit's places."""

    seconds: float
    places: tuple[int, ...]


def cycle_time(subject: Factory | GearNet, delays: Delays) -> CycleTime:
    """The maximum over robots of the summed delays of its gear, which carries one token.

    Holds since the simple circuits of a gear net are its gears. The first robot that attains it is
    the bottleneck. Raises ValueError where a delay is negative or names no place.
    """
    net = subject.net if isinstance(subject, Factory) else subject
    seconds = _seconds(marked(net), delays)
    sums = [sum(seconds[p] for p in gear.places) for gear in net.gears]
    slowest = max(range(len(sums)), key=sums.__getitem__)
    return CycleTime(sums[slowest], net.gears[slowest].robot)


def _seconds(net: MarkedNet, delays: Delays) -> list[float]:
    seconds = [0.0] * len(net.tokens)
    if isinstance(delays, Mapping):
        for name, delay in delays.items():
            if name not in net.net.place_index:
                hint = did_you_mean(name, list(net.net.place_index), "places")
                raise ValueError(f"no place is called '{name}': {hint}")
            seconds[net.net.place_index[name]] = float(delay)
    elif len(delays) > len(seconds):
        raise ValueError(f"{len(delays)} delays for {len(seconds)} places")
    else:
        seconds[: len(delays)] = map(float, delays)
    if any(not delay >= 0 for delay in seconds):
        raise ValueError("delays must be numbers, and not negative")
    return seconds


def marked_graph_cycle_time(net: GearNet | MarkedNet, delays: Delays) -> CriticalCircuit:
    """The maximum cycle ratio: circuits with more than r seconds per token are sought for a
    growing r (Lawler 1976), each by Bellman and Ford, until there is none.

    Raises ValueError where the net is no marked graph, has no circuit or is not live.
    """
    subject = marked(net)
    seconds = _seconds(subject, delays)
    if not subject.is_marked_graph or token_free(subject).stuck:
        raise ValueError("only a live marked graph has a cycle time")
    best = CriticalCircuit(-1.0, ())
    while True:
        circuit = _circuit_above(subject, seconds, best.seconds)
        tokens = sum(subject.tokens[p] for p in circuit)
        ratio = sum(seconds[p] for p in circuit) / tokens if circuit else best.seconds
        if ratio <= best.seconds:
            break
        best = CriticalCircuit(ratio, circuit)
    if not best.places:
        raise ValueError("the net has no circuit")
    return best


def _circuit_above(net: MarkedNet, seconds: Sequence[float], ratio: float) -> tuple[int, ...]:
    """The places of a circuit with more than `ratio` seconds per token, () where there is none."""
    tolerance = 1e-9 * (1.0 + abs(ratio))
    value = [0.0] * len(net.net.transitions)
    entry = [NONE] * len(value)
    edges = [
        (p, before, after, seconds[p] - ratio * net.tokens[p])
        for p, (before, after) in enumerate(zip(net.left, net.right, strict=True))
        if before != NONE and after != NONE
    ]
    changed = NONE
    for _ in range(len(value) + 1):
        changed = NONE
        for place, before, after, weight in edges:
            if value[before] + weight > value[after] + tolerance:
                value[after], entry[after] = value[before] + weight, place
                changed = after
        if changed == NONE:
            return ()
    return _around(net, entry, changed)


def _around(net: MarkedNet, entry: Sequence[int], event: int) -> tuple[int, ...]:
    """The circuit that the entries run into, backwards from an event."""
    for _ in entry:
        event = net.left[entry[event]]
    places, here = list[int](), event
    while not places or here != event:
        places.append(entry[here])
        here = net.left[entry[here]]
    return tuple(reversed(places))
