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

from factory.control.mode import ROUNDING
from factory.layout.certificate import MILLI, Certificate, Excluded, Fault, Precedence, fault
from factory.layout.coordinating import Coordinated, with_machines
from factory.layout.hands.leaving import SPARE, before_next, farther, gone_by, homes
from factory.layout.hands.limbs import rises_first
from factory.layout.layout import Layout
from factory.layout.machines import presences
from factory.layout.presence import Near, Presence, near, nearer, nearest
from factory.nets.coordinated import CoordinatedNet, Past
from factory.nets.exclusion import Circuit, Pair, excluding, ordered
from factory.nets.marked import MarkedNet
from factory.nets.verdict import listing
from factory.plant.factory import Factory

ROUNDS = 8
"""So often it is looked at again, as ways home are cut."""

BISECTIONS = 12
"""Halvings of a way home until where it is clear is known."""


@dataclass(frozen=True)
class Exclusions:
    """What keeps the machines of a layout apart: the pairs that come near, each with its circuit;
    the passes on ways home, and the order places, that are needed for that; the robots (index) that
    go back by themselves to an arc length [m]; and the pairs for which there is none."""

    excluded: tuple[Excluded, ...] = ()
    orders: tuple[Precedence, ...] = ()
    passes: tuple[Past, ...] = ()
    backs: tuple[tuple[int, float], ...] = ()
    faults: tuple[Fault, ...] = field(default=())


def coordinated(layout: Layout) -> Coordinated:
    """The coordinated net of a layout, with what keeps its machines apart."""
    known = kept(layout)
    return with_machines(layout, known.passes, [order for order in known.orders if order.kept])


def awaited_positions(layout: Layout) -> dict[int, float]:
    """Where robots go by themselves as soon as they have let go, by index, arc lengths [m]."""
    return dict(kept(layout).backs) if layout.hands else {}


def goes_early(layout: Layout) -> list[tuple[int, int]]:
    """The operations (index) ahead of which robots go where they are awaited, whatever else."""
    return [(tour[0], r) for r in awaited_positions(layout) for tour in layout.factory.tours[r]]


def crowded(layout: Layout, certificate: Certificate) -> dict[int, float]:
    """How far robots are to go at the least, from where they deliver, so that hands that hold from
    above get out of the way before they come to where the next part comes down [m]."""
    more = ((robot, at - before_next(layout, robot)) for robot, at in certificate.backs)
    return {robot: farther(layout, robot, by) for robot, by in more if by > ROUNDING}


def kept(layout: Layout) -> Exclusions:
    """What keeps the machines of a layout apart: by its certificate, if that is of its factory."""
    certificate = layout.certificate
    if certificate is not None and certificate.is_of(layout.factory):
        c = certificate
        return Exclusions(c.excluded, c.orders, c.passes, c.backs)
    known: Exclusions | None = layout.__dict__.get("kept")
    if known is None:
        known = layout.__dict__["kept"] = exclusions(layout)
    return known


def exclusions(layout: Layout) -> Exclusions:
    """The same, found: ways home are cut where they are clear of what comes near, until nothing
    new is found; what the net does not exclude then is ordered."""
    backs, passes = homes(layout), dict[Past, None]()
    for further in range(ROUNDS, -1, -1):
        made = with_machines(layout, passes)
        if made.net.deadlock:
            return Exclusions(faults=(_stuck(layout, made.net),))
        pairs = [*near([*presences(layout, made, backs)], layout.clearance)]
        circuits = _circuits(made.net.net, dict(enumerate(pairs)))
        needed = {
            n: pair
            for n, boxed in enumerate(pairs)
            if n not in circuits and (pair := nearer(boxed, layout.clearance)) is not None
        }
        cuts = _cuts(layout, made, needed.values()) if further else []
        if passes.keys() >= {*cuts}:
            break
        passes |= dict.fromkeys(cuts)
        for past in cuts:
            at = gone_by(layout, past.axis, past.at)
            backs[past.axis] = max(at, backs.get(past.axis, 0.0))
    apart = _ordered(layout, made, pairs, circuits, needed)
    whole = with_machines(layout, passes, apart.orders).net
    if whole.deadlock:
        return Exclusions(faults=(_stuck(layout, whole),))
    return replace(apart, passes=tuple(passes), backs=tuple(backs.items()))


def _stuck(layout: Layout, coordination: CoordinatedNet) -> Fault:
    """A circuit of the coordinated net that carries no token: what is on it never moves."""
    net, operations, circuit = coordination.net, layout.factory.operations, coordination.deadlock
    events = (net.right[place] // 2 for place in circuit)
    robots = sorted({operations[n].carrier for n in events if n < len(operations)})
    names = listing(net.net.places[place].name for place in circuit)
    return fault(layout.factory, f"these wait for each other for ever: {names}", *robots)


def _cuts(layout: Layout, made: Coordinated, pairs: Iterable[Near]) -> list[Past]:
    """Where ways home are clear of what they come near, for each pair that allows it."""
    net = made.net.net
    sequence = one_unit(net, layout.factory)
    when = {event: time for time, event in enumerate(sequence)}
    cuts = list[Past]()
    for pair in pairs:
        sides = (pair.one, pair.other), (pair.other, pair.one)
        found = (_cut(layout, *both, when, net) for both in sides if both[0].since >= 0)
        ways = [past for past in found if past is not None]
        if ways:
            cuts.append(
                min(ways, key=lambda past: past.at - layout.legs[past.after // 2, past.axis][1])
            )
    return cuts


def _cut(
    layout: Layout, own: Presence, other: Presence, when: Mapping[int, int], net: MarkedNet
) -> Past | None:
    """The pass by which a robot that goes home is clear of another machine; None where it never is,
    or where that is there already as it sets out."""
    robot, since = own.robot, own.since
    if all(_under_way(net, when, place, since) for place in other.places):
        return None
    begin, home = layout.legs[since // 2, robot][1], layout.guidepaths[robot].length
    heights = [z for _, span in own.sweeps for z in span]
    span = (min(heights), max(heights))
    if rises_first(layout, robot):
        span = (max(heights), max(heights))

    def clear(at: float) -> bool:
        there = replace(own, sweeps=(((at, home), span),))
        pair = nearest(there, other, layout.clearance)
        return pair is None or nearer(pair, layout.clearance) is None

    if begin >= home or not clear(home - SPARE):
        return None
    low, high = begin, home - SPARE
    if clear(low):
        return None
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if clear(middle) else (middle, high)
    return Past(since, robot, round(min(high + SPARE, home - SPARE), 6))


def _under_way(net: MarkedNet, when: Mapping[int, int], place: int, event: int) -> bool:
    """Whether a place is marked directly after a transition as one unit is made alone."""
    begin, end, now = when[net.left[place]], when[net.right[place]], when[event]
    return begin <= now < end if begin < end else now >= begin or now < end


def _ordered(
    layout: Layout,
    made: Coordinated,
    pairs: Sequence[Near],
    circuits: dict[int, Circuit],
    needed: Mapping[int, Near],
) -> Exclusions:
    """The pairs that come near, with order places for those that are not excluded yet."""
    net, factory = made.net.net, layout.factory
    whole, sequence, orders = net, one_unit(net, factory), list[Precedence]()
    for by_magazine, starts in ((True, {}), (False, _starts(made.net, factory))):
        asked = (p for p in needed.values() if (p.one.bears or p.other.bears) == by_magazine)
        apart = (_orderable(net, sequence, pair) for pair in asked)
        wanted = [both for both in apart if both is not None]
        count, whole = len(whole.tokens), ordered(whole, sequence, wanted, starts).net
        orders += (
            _precedence(whole, place, not by_magazine) for place in range(count, len(whole.tokens))
        )
    circuits |= _circuits(whole, needed)
    excluded = tuple(_excluded(whole, pairs[n], circuit) for n, circuit in circuits.items())
    faults = (_fault(layout, net, pair) for n, pair in needed.items() if n not in circuits)
    return Exclusions(excluded, tuple(orders), (), (), tuple(faults))


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
