"""Composition of gear nets: Definitions 3.5 and 3.6 checked gear by gear, in linear time.

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

from factory.support.errors import listing
from factory.theory.nets.gears import Gear
from factory.theory.nets.marked import MANY, NONE, MarkedNet
from factory.theory.nets.verdict import Defect

MOST = Defect.MOST
"""Greatest number of defects of one kind that are listed."""


@dataclass(frozen=True, slots=True)
class Joint:
    """How a gear is added to those before it (Definition 3.6): along place [a; b], with c before a.

    The first gear has None for all; a tool of one operation only, of which condition (b) is not
    demanded, has None for c.
    """

    gear: int
    place: int | None = None
    a: int | None = None
    b: int | None = None
    c: int | None = None


@dataclass(frozen=True, slots=True)
class Composition:
    """The gears of a net in the order in which they compose it, or the defects that forbid it.

    Attributes:
        joints: how each gear is added to those before it.
        defects: what forbids it.
        closed: whether each gear is a cycle of the net.
        fitting: whether all are, cover the net, and share one place at each transition where
            they meet, so that no more than a tree is missing (`train`).
    """

    joints: tuple[Joint, ...]
    defects: tuple[Defect, ...]
    closed: tuple[bool, ...]
    fitting: bool

    @classmethod
    def of(cls, net: MarkedNet) -> Composition:
        """Check the claim that `net.gears` compose the net into a gear net."""
        closed = tuple(_is_cycle(net, gear) for gear in net.gears)
        passing = [0] * len(net.net.transitions)
        for gear in net.gears:
            for event in gear.transitions:
                if event >= 0:
                    passing[event] += 1
        broken = (_unclosed(net, number) for number, good in enumerate(closed) if not good)
        defects = [*islice(broken, MOST)]
        defects += islice(_uncovered(net, passing), MOST)
        defects += islice(_misplaced(net), MOST)
        joints: tuple[Joint, ...] = ()
        if not defects:
            defects += islice(_shared(net, passing), MOST)
        fitting = not defects
        if fitting:
            joints, defects = _tree(net)
        return cls(joints, tuple(defects), closed, fitting)


def _is_cycle(net: MarkedNet, gear: Gear) -> bool:
    """Definition 3.5: place i leads from transition i to transition i + 1, and none repeats."""
    places, events, left, right = gear.places, gear.transitions, net.left, net.right
    return (
        len(places) == len(events) == len({*places}) == len({*events}) >= 2
        and min(events) >= 0
        and all(
            left[p] == a and right[p] == b
            for p, a, b in zip(places, events, events[1:] + events[:1], strict=True)
        )
    )


def _unclosed(net: MarkedNet, number: int) -> Defect:
    """The exact reason why a gear is none."""
    gear, called = net.gears[number], f"the gear of {net.gears[number].robot}"
    places, events = gear.places, gear.transitions
    if len(places) < 2:
        text = f"{called} has fewer than two places: such a gear is dead (Definition 3.4)"
        return Defect.no_gear_net("1-gear", text, [number], places)
    for place, a, b in zip(places, events, events[1:] + events[:1], strict=False):
        if a >= 0 and net.left[place] == a and net.right[place] == b:
            continue
        wanted = f"place {net.net.places[place].name} should be [{_event(net, a)};"
        text = f"{called} is not closed: {wanted} {_event(net, b)}] and is {net.notation(place)}"
        kind = "missing consumer" if net.right[place] == NONE else "unclosed gear"
        if net.left[place] == NONE:
            kind, text = "missing producer", f"{text}: nothing marks it"
        return Defect.no_gear_net(kind, text, [number], [place])
    if len(places) != len(events):
        text = f"{called} has {len(places)} places but {len(events)} transitions"
        return Defect.no_gear_net("unclosed gear", text, [number], places[:1])
    twice = [p for p, count in Counter(places).items() if count > 1]
    text = f"{called} is no cycle: it runs through a place or a transition twice"
    return Defect.no_gear_net("unclosed gear", text, [number], twice or places[:1])


def _event(net: MarkedNet, event: int) -> str:
    return net.net.transitions[event].name if event >= 0 else "?"


def _uncovered(net: MarkedNet, passing: list[int]) -> Iterator[Defect]:
    """Places and transitions that are part of no gear."""
    for place, owners in enumerate(net.owners):
        if not owners:
            at = net.net.places[place]
            text = f"place {at.name} = {net.notation(place)} is in no gear"
            beside = [q for e in at.left + at.right for q in net.net.preset[e] + net.net.postset[e]]
            near = sorted({gear for q in beside for gear in net.owners[q]})
            yield Defect.no_gear_net("place in no gear", text, near, [place])
    for event, count in enumerate(passing):
        if not count:
            text = f"transition {net.net.transitions[event].name} is in no gear"
            yield Defect.no_gear_net("transition in no gear", text, transitions=[event])


def _misplaced(net: MarkedNet) -> Iterator[Defect]:
    """Places whose slots belong to other robots than the gears through them."""
    for place, slots in enumerate(net.slots):
        owners, at = net.owners[place], net.net.places[place]
        if at.size != len(owners) or (slots != owners and tuple(sorted(slots)) != owners):
            text = (
                f"place {at.name} acts on {at.size} robots with slots for {named(net, slots)},"
                f" but the gears through it are those of {named(net, owners)}"
            )
            yield Defect.no_gear_net("slots", text, owners, [place])


def named(net: MarkedNet, gears: Iterable[int]) -> str:
    """The robots of gears, ? for one that has no gear."""
    names = (net.gears[g].robot if 0 <= g < len(net.gears) else "?" for g in gears)
    return listing(names) or "none"


def _shared(net: MarkedNet, passing: list[int]) -> Iterator[Defect]:
    """Definition 3.6 (a) around each transition: gears that share it share one of its places, and
    just one."""
    owners = net.owners
    joint: list[int] = [NONE] * len(passing)
    for place, on in enumerate(owners):
        if len(on) < 2:
            continue
        for event in (net.left[place], net.right[place]):
            if passing[event] == len(on):
                joint[event] = place if joint[event] == NONE else MANY
    for shared, count in enumerate(passing):
        if count < 2 or joint[shared] >= 0:
            continue
        places, called = net.net.preset[shared] + net.net.postset[shared], _event(net, shared)
        gears = sorted({gear for p in places for gear in owners[p]})
        kind = "no shared place"
        text = f"gears {named(net, gears)} meet at {called} but share no one place [a; b] there"
        if joint[shared] == MANY:
            kind, places = "two gears cross twice", tuple(p for p in places if len(owners[p]) > 1)
            both = f"the place before {called} and the one after it"
            text = f"gears {named(net, gears)} cross twice: they share {both}"
        yield Defect.no_gear_net(kind, text, gears, places, [shared])


def _tree(net: MarkedNet) -> tuple[tuple[Joint, ...], list[Defect]]:
    """A breadth-first search over gears and shared places, which must form a tree."""
    if not net.gears:
        return (), [Defect.no_gear_net("no gear", "the net has no gears")]
    owners, entry = net.owners, [*map(int, [NONE] * len(net.gears))]
    seen = bytearray(len(net.gears))
    seen[0], order = 1, [0]
    for gear in order:
        for place in net.gears[gear].places:
            if len(owners[place]) < 2 or place == entry[gear]:
                continue
            for other in owners[place]:
                if seen[other] and other != gear:
                    return (), [_ring(net)]
                if other != gear:
                    seen[other], entry[other] = 1, place
                    order.append(other)
    if len(order) < len(net.gears):
        apart = [g for g, hit in enumerate(seen) if not hit]
        text = f"gears {named(net, apart)} share no place with the rest, directly or not"
        return (), [Defect.no_gear_net("gears apart", text, apart)]
    return _joints(net, order, entry)


def _ring(net: MarkedNet) -> Defect:
    """A cycle in the incidence graph of gears (from 0) and shared places (from -1 down)."""
    import networkx as nx  # only a net that is none pays for it

    pairs = (
        (gear, ~place) for place, owners in enumerate(net.owners) if owners[1:] for gear in owners
    )
    around = [node for node, _ in nx.find_cycle(nx.Graph(pairs))]
    gears, places = [n for n in around if n >= 0], [~n for n in around if n < 0]
    names = listing(net.net.places[p].name for p in places)
    text = f"gears {named(net, gears)} form a ring through {names}: some circuit is no gear"
    if len(gears) == 2:
        text = f"gears {named(net, gears)} cross twice: they share {names}"
    return Defect.no_gear_net("two gears cross twice", text, gears, places)


def _joints(
    net: MarkedNet, order: list[int], entry: list[int]
) -> tuple[tuple[Joint, ...], list[Defect]]:
    """Condition (b) for each gear after the first: some [c; a] in it with c not yet in the net."""
    there = bytearray(len(net.net.transitions))
    joints: list[Joint] = []
    for number in order:
        gear, place = net.gears[number], entry[number]
        if place == NONE:
            joints.append(Joint(number))
        else:
            c = gear.transitions[gear.places.index(place) - 1]
            a, b = net.left[place], net.right[place]
            if there[c] and len(gear.places) > 2:
                text = f"no transition c of {gear.robot} alone leads to {_event(net, a)}"
                return (), [Defect.no_gear_net("missing producer", text, [number], [place])]
            joints.append(Joint(number, place, a, b, None if there[c] else c))
        for event in gear.transitions:
            there[event] = 1
    return tuple(joints), []
