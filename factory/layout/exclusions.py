"""Why machines of a layout never meet: those that come near in two places of its coordinated net
are never in both at once.

Either a circuit of the net that carries one token goes through both places, or order places are
added for them, which one unit made alone tells. What one unit made alone marks both is a fault: a
machine stands, or holds something, where another has to pass.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from heapq import heapify, heappop, heappush
from itertools import product

from factory.layout.certificate import MILLI, Excluded, Fault, Precedence, fault
from factory.layout.coordinating import Coordinated
from factory.layout.hands.leaving import awaited_positions, gone_by
from factory.layout.layout import Layout
from factory.layout.machines import presences
from factory.layout.presence import Near, Presence, near, nearer
from factory.nets.coordinated import CoordinatedNet
from factory.nets.exclusion import Circuit, Pair, excluding, ordered
from factory.nets.marked import MarkedNet
from factory.plant.factory import Factory

ROUNDS = 4
"""So often it is looked at again, as robots go back by themselves."""


@dataclass(frozen=True)
class Exclusions:
    """What keeps the machines of a layout apart: the pairs that come near, each with its circuit,
    the order places that are needed besides, the robots (index) that go back by themselves for
    them, to an arc length [m], and the pairs for which there is none."""

    excluded: tuple[Excluded, ...] = ()
    orders: tuple[Precedence, ...] = ()
    backs: tuple[tuple[int, float], ...] = ()
    faults: tuple[Fault, ...] = field(default=())


def exclusions(layout: Layout, coordinated: Coordinated) -> Exclusions:
    """Those of a layout with the coordinated net that its hands, magazines and tray ask for."""
    awaited, backs = awaited_positions(layout), dict[int, float]()
    for _ in range(ROUNDS):
        kept = _ordered(layout, coordinated, awaited | backs)
        more = further(layout, coordinated.net, kept.orders, awaited | backs)
        if not more:
            break
        backs |= more
    return replace(kept, backs=tuple(backs.items()))


def further(
    layout: Layout,
    net: CoordinatedNet,
    orders: Iterable[Precedence],
    awaited: Mapping[int, float],
) -> dict[int, float]:
    """Where robots have to go back to by themselves for passes that something waits for [m]."""
    events, right = net.net.net.transitions, net.net.right
    passes = {events[right[place]].name: past for past, (place, _) in net.passes.items()}
    waited = (passes[order.before] for order in orders if order.before in passes)
    found = dict[int, float]()
    for past in waited:
        comes = past.after % 2 == 0 or past.axis >= len(layout.guidepaths)
        if not comes and awaited.get(past.axis, 0.0) < past.at:
            at = gone_by(layout, past.axis, past.at)
            found[past.axis] = max(at, found.get(past.axis, 0.0))
    return found


def _ordered(layout: Layout, coordinated: Coordinated, awaited: Mapping[int, float]) -> Exclusions:
    """Those where robots go back by themselves to where they are `awaited`."""
    net, factory = coordinated.net.net, layout.factory
    pairs = [*near([*presences(layout, coordinated, awaited)], layout.clearance)]
    circuits = _circuits(net, dict(enumerate(pairs)))
    needed = {
        n: pair
        for n, boxed in enumerate(pairs)
        if n not in circuits and (pair := nearer(boxed, layout.clearance)) is not None
    }
    kept, sequence, orders = net, one_unit(net, factory), list[Precedence]()
    for by_magazine, starts in ((True, {}), (False, _starts(coordinated.net, factory))):
        asked = (p for p in needed.values() if (p.one.bears or p.other.bears) == by_magazine)
        apart = (_orderable(net, sequence, pair) for pair in asked)
        wanted = [both for both in apart if both is not None]
        count, kept = len(kept.tokens), ordered(kept, sequence, wanted, starts).net
        orders += (
            _precedence(kept, place, not by_magazine) for place in range(count, len(kept.tokens))
        )
    circuits |= _circuits(kept, needed)
    excluded = tuple(_excluded(kept, pairs[n], circuit) for n, circuit in circuits.items())
    faults = (_fault(layout, net, pair) for n, pair in needed.items() if n not in circuits)
    return Exclusions(excluded, tuple(orders), (), tuple(faults))


def _precedence(net: MarkedNet, place: int, kept: bool) -> Precedence:
    """An order place of a net, by names."""
    before, start = (net.net.transitions[side[place]].name for side in (net.left, net.right))
    return Precedence(net.net.places[place].name, before, start, net.tokens[place], kept)


def _circuits(net: MarkedNet, pairs: Mapping[int, Near]) -> dict[int, Circuit]:
    """By the numbers of pairs a circuit with one token through a place of either, if there is
    one."""
    combined = [(n, both) for n, pair in pairs.items() for both in _places(pair)]
    circuits = excluding(net, [both for _, both in combined])
    found = dict[int, Circuit]()
    for (n, _), circuit in zip(combined, circuits, strict=True):
        if circuit is not None:
            found.setdefault(n, circuit)
    return found


def _places(pair: Near) -> Iterable[Pair]:
    """A place of either presence of a pair."""
    return product(pair.one.places, pair.other.places)


def one_unit(net: MarkedNet, factory: Factory) -> list[int]:
    """The transitions of a coordinated net as they fire when one period is made operation by
    operation, everything else as soon as it can."""
    when = [-1] * len(net.net.transitions)
    for step, number in enumerate(factory.order):
        when[2 * number], when[2 * number + 1] = 2 * step, 2 * step + 1
    waits = [0] * len(when)
    for tokens, after in zip(net.tokens, net.right, strict=True):
        waits[after] += not tokens
    ready = [(when[event], event) for event, many in enumerate(waits) if not many]
    heapify(ready)
    sequence = []
    while ready:
        _, event = heappop(ready)
        sequence.append(event)
        for place in net.net.postset[event]:
            after = net.right[place]
            waits[after] -= not net.tokens[place]
            if not (net.tokens[place] or waits[after]):
                heappush(ready, (when[after], after))
    return sequence


def _orderable(net: MarkedNet, sequence: Sequence[int], pair: Near) -> Pair | None:
    """Of the places of two presences two that the sequence does not mark at once: those that are
    left last and entered first, None where there are none."""
    apart = [both for both in _places(pair) if not ordered(net, sequence, [both]).overlapping]
    return apart[-1] if apart else None


def _starts(net: CoordinatedNet, factory: Factory) -> Mapping[int, int]:
    """By the transitions that come by themselves, ends of operations and passes, the start of the
    operation that leads to each."""
    starts = {o.end: o.start for o in factory.operations}
    for past, (place, _) in net.passes.items():
        starts[net.net.right[place]] = past.after - past.after % 2
    return starts


def _excluded(net: MarkedNet, pair: Near, circuit: Circuit) -> Excluded:
    both = tuple(next(p for p in side.places if p in circuit) for side in (pair.one, pair.other))
    names = [net.net.places[place].name for place in both]
    return Excluded(
        (pair.one.machine, pair.other.machine),
        (names[0], names[1]),
        pair.bodies,
        tuple(net.net.places[place].name for place in circuit),
    )


def _fault(layout: Layout, net: MarkedNet, pair: Near) -> Fault:
    """What no order keeps apart."""
    one, other = (
        f"{body} of {side.machine}, {_named(net, side)},"
        for side, body in zip((pair.one, pair.other), pair.bodies, strict=True)
    )
    message = (
        f"{one} and {other} come {pair.lacking * MILLI:.2f} mm nearer than they may; one unit made"
        " alone has both at once"
    )
    robots = pair.one.robot, pair.other.robot
    return fault(layout.factory, message, *robots, lacking=pair.lacking)


def _named(net: MarkedNet, presence: Presence) -> str:
    """When something is there, in words."""
    names = [net.net.places[place].name for place in presence.places]
    return f"in {' and '.join(names)}" if names else "which stands"


__all__ = ["Exclusions", "exclusions", "further", "one_unit"]
