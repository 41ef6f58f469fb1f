"""Whether claimed gears compose a gear net: Definitions 3.5 and 3.6, gear by gear, in linear time.

The text of condition (a) intersects all the gears that meet the new one, so that two of them could
share more if a third does not. It is read strictly: the new gear S and the net so far have exactly
one place [a; b] and the transitions a and b in common, and every gear that meets S runs through it.

So two gears that meet share one place [a; b], the transitions a and b, and nothing else; seen from
a transition: all gears through it share one of its places, and that place with no others. And the
incidence graph of gears and shared places is a tree. Then the simple circuits are exactly the
gears: a circuit that leaves [a; b] along one gear can come back along that gear only. Conversely,
where both hold, (a) holds for each gear, added in the order of a search through that tree.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

from factory.nets.marked import MANY, NONE, MarkedNet
from factory.nets.verdict import Fault, listing

MOST = 10
"""How many faults of one kind are listed."""


@dataclass(frozen=True, slots=True)
class Joint:
    """How a gear is added to those before it (Definition 3.6): along place [a; b], with c before a.

    The first gear has -1 for all; c is None for a tool of one operation only, of which condition
    (b) is not demanded.
    """

    gear: int
    place: int
    a: int
    b: int
    c: int | None


@dataclass(frozen=True, slots=True)
class Composition:
    """The gears in the order in which they compose the net, or the faults that forbid it.

    `closed` says of each gear whether it is a cycle of the net; `owners` lists the gears of each
    place.
    """

    joints: tuple[Joint, ...]
    faults: tuple[Fault, ...]
    closed: tuple[bool, ...]
    owners: tuple[tuple[int, ...], ...]


def compose(net: MarkedNet) -> Composition:
    """Check the claim that `net.gears` compose the net into a gear net."""
    closed, faults = _closed(net)
    owners = _owners(net)
    passing = _passing(net)
    faults += islice(_uncovered(net, owners, passing), MOST)
    faults += islice(_misplaced(net, owners), MOST)
    joints: tuple[Joint, ...] = ()
    if not faults:
        faults += islice(_shared(net, owners, passing), MOST)
    if not faults:
        joints, faults = _tree(net, owners)
    return Composition(joints, tuple(faults), tuple(closed), tuple(map(tuple, owners)))


def fault(kind: str, reason: str, gears: Iterable[int] = (), **ids: Iterable[int]) -> Fault:
    """A fault of the property gear_net."""
    places, transitions = tuple(ids.get("places", ())), tuple(ids.get("transitions", ()))
    return Fault("gear_net", kind, reason, tuple(dict.fromkeys(gears)), places, transitions)


def _closed(net: MarkedNet) -> tuple[list[bool], list[Fault]]:
    """Definition 3.5: place i leads from transition i to transition i + 1, and no place repeats."""
    faults: list[Fault] = []
    closed = []
    left, right = net.left, net.right
    stamp_p, stamp_t = [NONE] * len(left), [NONE] * len(net.net.transitions)
    for number, gear in enumerate(net.gears):
        places, events = gear.places, gear.transitions
        good = len(places) == len(events) >= 2
        for place, before, after in zip(places, events, events[1:] + events[:1], strict=False):
            if before < 0 or left[place] != before or right[place] != after:
                good = False
                continue
            if stamp_p[place] == number or stamp_t[before] == number:
                good = False
            stamp_p[place] = stamp_t[before] = number
        closed.append(good)
        if not good and len(faults) < MOST:
            faults.append(_unclosed(net, number))
    return closed, faults


def _unclosed(net: MarkedNet, number: int) -> Fault:
    """The exact reason why a gear is no gear."""
    gear, name = net.gears[number], net.gears[number].robot
    if len(gear.places) < 2:
        text = f"the gear of {name} has fewer than two places: such a gear is dead (Definition 3.4)"
        return fault("1-gear", text, [number], places=gear.places)
    after = gear.transitions[1:] + gear.transitions[:1]
    for place, a, b in zip(gear.places, gear.transitions, after, strict=False):
        if a < 0 or net.left[place] != a or net.right[place] != b:
            return _broken(net, number, place, a, b)
    if len(gear.places) != len(gear.transitions):
        counts = f"{len(gear.places)} places but {len(gear.transitions)} transitions"
        text = f"the gear of {name} has {counts}"
        return fault("unclosed gear", text, [number], places=gear.places[:1])
    twice = [p for p, count in Counter(gear.places).items() if count > 1]
    text = f"the gear of {name} is no cycle: it runs through a place or a transition twice"
    return fault("unclosed gear", text, [number], places=twice or gear.places[:1])


def _broken(net: MarkedNet, number: int, place: int, a: int, b: int) -> Fault:
    name, called = net.gears[number].robot, net.net.places[place].name
    wanted = f"the gear of {name} is not closed: place {called} should be [{_event(net, a)};"
    found = f"{wanted} {_event(net, b)}] and is {notation(net, place)}"
    if net.left[place] == NONE:
        return fault("missing producer", f"{found}: nothing marks it", [number], places=[place])
    kind = "missing consumer" if net.right[place] == NONE else "unclosed gear"
    return fault(kind, found, [number], places=[place])


def _event(net: MarkedNet, event: int) -> str:
    return net.net.transitions[event].name if event >= 0 else "?"


def notation(net: MarkedNet, place: int) -> str:
    """A place as the paper writes it: [a, b; c]."""
    at = net.net.places[place]
    before = listing(net.net.transitions[e].name for e in at.left)
    return f"[{before}; {listing(net.net.transitions[e].name for e in at.right)}]"


def _owners(net: MarkedNet) -> list[list[int]]:
    owners: list[list[int]] = [[] for _ in net.net.places]
    for number, gear in enumerate(net.gears):
        for place in gear.places:
            owners[place].append(number)
    return owners


def _passing(net: MarkedNet) -> list[int]:
    """For each transition the number of gears through it."""
    passing = [0] * len(net.net.transitions)
    for gear in net.gears:
        for event in gear.transitions:
            if event >= 0:
                passing[event] += 1
    return passing


def _uncovered(net: MarkedNet, owners: list[list[int]], passing: list[int]) -> Iterator[Fault]:
    """Places and transitions that are part of no gear."""
    for place, own in enumerate(owners):
        if not own:
            text = f"place {net.net.places[place].name} = {notation(net, place)} is in no gear"
            near = _near(net, place, owners)
            yield fault("place in no gear", text, near, places=[place])
    for event, count in enumerate(passing):
        if not count:
            text = f"transition {net.net.transitions[event].name} is in no gear"
            yield fault("transition in no gear", text, transitions=[event])


def _near(net: MarkedNet, place: int, owners: list[list[int]]) -> list[int]:
    """The gears through the transitions of a place."""
    at = net.net.places[place]
    beside = [q for e in at.left + at.right for q in net.net.preset[e] + net.net.postset[e]]
    return sorted({gear for q in beside for gear in owners[q]})


def _misplaced(net: MarkedNet, owners: list[list[int]]) -> Iterator[Fault]:
    """Places whose slots belong to other robots than the gears through them."""
    for place, slots in enumerate(net.slots):
        own = owners[place]
        at = net.net.places[place]
        if at.size != len(own) or (list(slots) != own and sorted(slots) != own):
            text = (
                f"place {at.name} acts on {at.size} robots with slots for {named(net, slots)},"
                f" but the gears through it are those of {named(net, own)}"
            )
            yield fault("slots", text, own, places=[place])


def named(net: MarkedNet, gears: Iterable[int]) -> str:
    """The robots of gears, ? for one that has no gear."""
    names = (net.gears[g].robot if 0 <= g < len(net.gears) else "?" for g in gears)
    return listing(names) or "none"


def _shared(net: MarkedNet, owners: list[list[int]], passing: list[int]) -> Iterator[Fault]:
    """Definition 3.6 (a) around each transition: gears that share it share one of its places, and
    just one."""
    joint = [NONE] * len(passing)
    for place, own in enumerate(owners):
        if len(own) < 2:
            continue
        for event in (net.left[place], net.right[place]):
            if passing[event] == len(own):
                joint[event] = place if joint[event] == NONE else MANY
    for event, count in enumerate(passing):
        if count > 1 and joint[event] < 0:
            yield _clash(net, event, owners, joint[event] == MANY)


def _clash(net: MarkedNet, event: int, owners: list[list[int]], many: bool) -> Fault:
    places = net.net.preset[event] + net.net.postset[event]
    gears = sorted({gear for p in places for gear in owners[p]})
    called = net.net.transitions[event].name
    if many:
        both = [p for p in places if len(owners[p]) > 1]
        text = (
            f"gears {named(net, gears)} cross twice: they share the place before {called} and the"
            " one after it"
        )
        return fault("two gears cross twice", text, gears, places=both, transitions=[event])
    text = f"gears {named(net, gears)} meet at {called} but share no one place [a; b] there"
    return fault("no shared place", text, gears, places=places, transitions=[event])


def _tree(net: MarkedNet, owners: list[list[int]]) -> tuple[tuple[Joint, ...], list[Fault]]:
    """A breadth-first search over gears and shared places, which must form a tree."""
    if not net.gears:
        return (), [fault("no gear", "the net has no gears")]
    entry, parent = [NONE] * len(net.gears), [NONE] * len(net.gears)
    seen = bytearray(len(net.gears))
    seen[0], order = 1, [0]
    for gear in order:
        for place in net.gears[gear].places:
            if len(owners[place]) < 2 or place == entry[gear]:
                continue
            for other in owners[place]:
                if seen[other] and other != gear:
                    return (), [_ring(net, gear, other, place, entry, parent)]
                if other != gear:
                    seen[other], entry[other], parent[other] = 1, place, gear
                    order.append(other)
    if len(order) < len(net.gears):
        return (), [_apart(net, [g for g, hit in enumerate(seen) if not hit])]
    return _joints(net, order, entry)


def _ring(
    net: MarkedNet, one: int, other: int, place: int, entry: list[int], parent: list[int]
) -> Fault:
    """The cycle of gears and shared places that a second way from gear to gear closes."""
    ways: list[list[tuple[str, int]]] = []
    for gear in (one, other):
        way = [("gear", gear)]
        while parent[gear] != NONE:
            way += [("place", entry[gear]), ("gear", parent[gear])]
            gear = parent[gear]
        ways.append(way)
    while len(ways[0]) > 1 and len(ways[1]) > 1 and ways[0][-2] == ways[1][-2]:
        ways[0].pop()
        ways[1].pop()
    nodes = [*reversed(ways[0]), ("place", place), *ways[1][:-1]]
    gears = [number for kind, number in nodes if kind == "gear"]
    places = [number for kind, number in nodes if kind == "place"]
    names = listing(net.net.places[p].name for p in places)
    if len(gears) == 2:
        text = f"gears {named(net, gears)} cross twice: they share {names}"
    else:
        text = f"gears {named(net, gears)} form a ring through {names}: some circuit is no gear"
    return fault("two gears cross twice", text, gears, places=places)


def _apart(net: MarkedNet, others: list[int]) -> Fault:
    text = f"gears {named(net, others)} share no place with the rest, directly or not"
    return fault("gears apart", text, others)


def _joints(
    net: MarkedNet, order: list[int], entry: list[int]
) -> tuple[tuple[Joint, ...], list[Fault]]:
    """Condition (b) for each gear after the first: some [c; a] in it with c not yet in the net."""
    there = bytearray(len(net.net.transitions))
    joints: list[Joint] = []
    for number in order:
        gear, place = net.gears[number], entry[number]
        if place == NONE:
            joints.append(Joint(number, -1, -1, -1, None))
        else:
            at = gear.places.index(place)
            c = gear.transitions[at - 1]
            a, b = net.left[place], net.right[place]
            if there[c] and len(gear.places) > 2:
                text = f"no transition c of {gear.robot} alone leads to {_event(net, a)}"
                return (), [fault("missing producer", text, [number], places=[place])]
            joints.append(Joint(number, place, a, b, None if there[c] else c))
        for event in gear.transitions:
            there[event] = 1
    return tuple(joints), []
