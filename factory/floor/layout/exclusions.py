"""Why machines of a layout never meet: those that come near in two places of its coordinated net
are never in both at once.

Either a circuit of the net with one token goes through both places, or order places are added, in
the order in which a single unit is made. A pair that is marked together while a single unit is made
is a fault: a machine stands, or holds something, where another has to pass.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from itertools import product

from factory.floor.layout.certificate import (
    MILLI,
    Certificate,
    Excluded,
    Exclusions,
    Fault,
    Precedence,
    fault,
)
from factory.floor.layout.coordinating import Coordinated, with_machines
from factory.floor.layout.hands.leaving import before_next, farther, gone_by, homes
from factory.floor.layout.homeward import Homeward
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.nearness import Near, near
from factory.floor.layout.presence import Presence
from factory.floor.layout.staying import carried_ahead
from factory.support.errors import listing
from factory.theory.control.mode import ROUNDING
from factory.theory.nets.coordinated import CoordinatedNet, Past
from factory.theory.nets.exclusion import Circuit, Pair, excluding, ordered, overlap, times
from factory.theory.nets.marked import MarkedNet
from factory.theory.plant.factory import Factory
from factory.theory.problem.ids import end_of, operation_of, start_of


@dataclass(frozen=True)
class Further:
    """Further `presences` of machines, and which of the pairs near them `counts`."""

    presences: tuple[Presence, ...] = ()
    counts: Callable[[Near], bool] = field(default=lambda pair: True)


Presences = Callable[[Layout, Coordinated, Mapping[int, float]], Further]
"""Those of a layout in its coordinated net, with robots that go where they are awaited."""

ROUNDS = 8
"""Most rounds in which ways home are cut."""


def coordinated(layout: Layout) -> Coordinated:
    """The coordinated net of a layout, with everything that keeps its machines apart; made once.

    Args:
        layout: the layout.
    """
    return layout.kept(_coordinated)


def _coordinated(layout: Layout) -> Coordinated:
    apart = kept(layout)
    return with_machines(layout, apart.passes, apart.orders)


def awaited_positions(layout: Layout) -> dict[int, float]:
    """For robots that return by themselves as soon as they have released their payload, by index,
    the arc lengths to which they go [m]."""
    return dict(kept(layout).backs)


def goes_early(layout: Layout) -> list[tuple[int, int]]:
    """The operations (index) before which robots always go ahead: to where they are awaited, or
    with what they bring."""
    homes = [(tour[0], r) for r in awaited_positions(layout) for tour in layout.factory.tours[r]]
    return [*homes, *carried_ahead(layout)]


def too_near(layout: Layout, robots: Collection[int]) -> set[int]:
    """Of robots that go ahead while they wait, those that would come near another machine there and
    that no circuit keeps from it."""
    net, paths, homeward = coordinated(layout), layout.guidepaths, Homeward(layout)
    awaited = awaited_positions(layout) | {robot: paths[robot].length for robot in robots}
    pairs = dict(enumerate(near([*presences(layout, net, awaited)], layout.clearance)))
    apart = _circuits(net.net, pairs)
    faults = (pair for n, pair in pairs.items() if n not in apart and homeward.nearer(pair))
    return {*robots}.intersection(side.robot for p in faults for side in (p.one, p.other))


def crowded(layout: Layout, certificate: Certificate) -> dict[int, float]:
    """Least travels of robots, so that hands from above are out of the way before they come to
    where the next part comes down [m]."""
    more = ((robot, at - before_next(layout, robot)) for robot, at in certificate.apart.backs)
    return {robot: farther(layout, robot, by) for robot, by in more if by > ROUNDING}


def kept(layout: Layout) -> Exclusions:
    """What keeps the machines of a layout apart: from its certificate, if that is of its
    factory."""
    certificate = layout.certificate
    if certificate is not None and certificate.is_of(layout.factory):
        return certificate.apart
    return layout.kept(exclusions)


def exclusions(layout: Layout, further: Presences | None = None) -> Exclusions:
    """Find what keeps the machines of a layout apart, with `further` presences if there are any:
    ways home are cut where they are clear of what comes near, until there is no new cut; a lift
    that is not clear where it is set on the way is set at home; what the net does not exclude then
    is ordered."""
    backs, passes, homeward = homes(layout), dict[Past, None](), Homeward(layout)
    at_home = dict[Precedence, None]()
    for rounds in range(ROUNDS, -1, -1):
        net = with_machines(layout, passes, [*at_home])
        if net.deadlock:
            return Exclusions(faults=(waiting_for_ever(layout, net),))
        sequence = one_unit(net.net, layout.factory)
        when = times(net.net, sequence)
        more = further(layout, net, backs) if further else Further()
        every = [*presences(layout, net, backs), *more.presences]
        pairs = [p for p in near(every, layout.clearance) if more.counts(p)]
        circuits = _circuits(net.net, dict(enumerate(pairs)))
        needed = {
            n: pair
            for n, boxed in enumerate(pairs)
            if n not in circuits and (pair := homeward.nearer(boxed)) is not None
        }
        cuts = homeward.cuts(net.net, when, needed.values()) if rounds else []
        if passes.keys() >= {*cuts}:
            stuck = (pair for pair in needed.values() if _orderable(net.net, when, pair) is None)
            setting = dict.fromkeys(homeward.adjusted_at_home(net, stuck)) if rounds else {}
            if at_home.keys() >= setting.keys():
                break
            at_home |= setting
        passes |= dict.fromkeys(cuts)
        for past in cuts:
            at = gone_by(layout, past.axis, past.at)
            backs[past.axis] = max(at, backs.get(past.axis, 0.0))
    orders, ordered_net = _orders(net, layout.factory, sequence, needed.values())
    circuits |= _circuits(ordered_net, needed)
    orders = (*at_home, *orders)
    if (whole := with_machines(layout, passes, orders)).deadlock:
        return Exclusions(faults=(waiting_for_ever(layout, whole),))
    return Exclusions(
        tuple(_excluded(ordered_net, pairs[n], circuit) for n, circuit in circuits.items()),
        orders,
        tuple(passes),
        tuple(backs.items()),
        tuple(_fault(layout, net.net, p) for n, p in needed.items() if n not in circuits),
    )


def waiting_for_ever(layout: Layout, net: CoordinatedNet) -> Fault:
    """A circuit of the coordinated net without a token: its machines never move."""
    operations, circuit = layout.factory.operations, net.deadlock
    events = (operation_of(net.net.right[place]) for place in circuit)
    robots = sorted({operations[n].carrier for n in events if n < len(operations)})
    names = listing(net.net.net.places[place].name for place in circuit)
    return fault(layout.factory, f"these wait for each other for ever: {names}", *robots)


def _orders(
    net: CoordinatedNet, factory: Factory, sequence: Sequence[int], pairs: Collection[Near]
) -> tuple[tuple[Precedence, ...], MarkedNet]:
    """The order places that exclude pairs that come near, and the net with them; those of
    magazines come first."""
    whole, orders, when = net.net, list[Precedence](), times(net.net, sequence)
    for by_magazine, starts in ((True, {}), (False, _starts(net, factory))):
        asked = (pair for pair in pairs if (pair.one.bears or pair.other.bears) == by_magazine)
        apart = (_orderable(net.net, when, pair) for pair in asked)
        wanted = [both for both in apart if both is not None]
        count, whole = len(whole.tokens), ordered(whole, sequence, wanted, starts).net
        orders += (_precedence(whole, place) for place in range(count, len(whole.tokens)))
    return tuple(orders), whole


def _precedence(net: MarkedNet, place: int) -> Precedence:
    """An order place of a net, by names."""
    before, start = (net.net.transitions[side[place]].name for side in (net.left, net.right))
    return Precedence(net.net.places[place].name, before, start, net.tokens[place])


def _circuits(net: MarkedNet, pairs: Mapping[int, Near]) -> dict[int, Circuit]:
    """By the numbers of pairs, a circuit with one token through a place of either presence, if
    there is one."""
    combined = [(n, both) for n, pair in pairs.items() for both in _places(pair)]
    circuits = excluding(net, [both for _, both in combined])
    circuit_of = dict[int, Circuit]()
    for (n, _), circuit in zip(combined, circuits, strict=True):
        if circuit is not None:
            circuit_of.setdefault(n, circuit)
    return circuit_of


def _places(pair: Near) -> Iterable[Pair]:
    """One place of each presence of a pair, but for a place of both."""
    return ((p, q) for p, q in product(pair.one.places, pair.other.places) if p != q)


def one_unit(net: MarkedNet, factory: Factory) -> list[int]:
    """The transitions of a coordinated net in the order in which they fire when one period is made
    operation by operation and everything else fires as soon as it can."""
    when = [-1] * len(net.net.transitions)
    for step, number in enumerate(factory.order):
        when[start_of(number)], when[end_of(number)] = 2 * step, 2 * step + 1
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


def _orderable(net: MarkedNet, when: Sequence[int], pair: Near) -> Pair | None:
    """Of the places of two presences, two that are not marked together while one unit is made
    alone: those left last and entered first. None if there are none."""
    apart = [both for both in _places(pair) if not overlap(net, when, both)]
    return apart[-1] if apart else None


def _starts(net: CoordinatedNet, factory: Factory) -> Mapping[int, int]:
    """For each transition that comes by itself, an end of an operation or a pass: the start of the
    operation that leads to it."""
    starts: dict[int, int] = {o.end: o.start for o in factory.operations}
    for past, (place, _) in net.passes.items():
        starts[net.net.right[place]] = factory.operation_of(past.after).start
    return starts


def _excluded(net: MarkedNet, pair: Near, circuit: Circuit) -> Excluded:
    both = next(both for both in _places(pair) if {*both} <= {*circuit})
    names = [net.net.places[place].name for place in both]
    return Excluded(
        (pair.one.machine, pair.other.machine),
        (names[0], names[1]),
        pair.bodies,
        tuple(net.net.places[place].name for place in circuit),
    )


def _fault(layout: Layout, net: MarkedNet, pair: Near) -> Fault:
    """The fault of a pair that no order keeps apart."""
    one, other = (
        f"{body} of {side.machine}, {_named(net, side)},"
        for side, body in zip((pair.one, pair.other), pair.bodies, strict=True)
    )
    message = (
        f"{one} and {other} come {pair.lacking * MILLI:.2f} mm nearer than they may; making"
        " a single unit needs both at once"
    )
    robots = pair.one.robot, pair.other.robot
    return fault(layout.factory, message, *robots, lacking=pair.lacking)


def _named(net: MarkedNet, presence: Presence) -> str:
    """A presence in words."""
    names = [net.net.places[place].name for place in presence.places]
    return f"in {' and '.join(names)}" if names else "which stands"
