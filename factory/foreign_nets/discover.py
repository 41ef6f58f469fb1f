"""The gears of a net that does not name them (Definition 3.6, read backwards).

Contract each shared place [a; b], the only output of a and only input of b, to a node. What is left
of a gear net is a digraph in which every edge lies on exactly one simple circuit, and these are the
gears. A depth-first search finds them: no edge leads sideways, and each tree edge is under exactly
one back edge. Linear, without recursion.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from factory.nets.composition import MOST, fault, notation
from factory.nets.gears import Gear
from factory.nets.marked import MANY, NONE, MarkedNet
from factory.nets.verdict import Fault, listing


def discover(net: MarkedNet) -> tuple[tuple[Gear, ...], tuple[Fault, ...]]:
    """The gears of a gear net, named g1, g2, ..., or the exact reasons why it is none."""
    if not net.net.places:
        return (), (fault("no gear", "the net has no places"),)
    faults = tuple(islice(_local(net), MOST))
    if faults:
        return (), faults
    nodes, joint = _contracted(net)
    edges: dict[int, list[int]] = {}
    for place, before in enumerate(net.left):
        if place not in joint:
            edges.setdefault(nodes[before], []).append(place)
    circuits, found = _circuits(net, nodes, edges)
    if found:
        return (), (found,)
    gears = sorted(_gear(net, circuit, joint) for circuit in circuits)
    named = (Gear(f"g{i}", "", *gear) for i, gear in enumerate(gears, start=1))
    return tuple(named), ()


def _local(net: MarkedNet) -> Iterator[Fault]:
    """What around a single place or transition cannot be part of a gear net."""
    names = net.net.places
    for place, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
        called = f"place {names[place].name} = {notation(net, place)}"
        if before == NONE:
            yield fault("missing producer", f"nothing marks {called}", places=[place])
        if after == NONE:
            yield fault("missing consumer", f"nothing takes from {called}", places=[place])
        if MANY in (before, after):
            text = f"{called} is not of the form [x; y]: the net has choice there"
            yield fault("choice", text, places=[place])
        if before == after >= 0:
            text = f"{called} is a 1-gear, which is dead (Definition 3.4)"
            yield fault("1-gear", text, places=[place])
    for event in range(len(net.net.transitions)):
        yield from _around(net, event)


def _around(net: MarkedNet, event: int) -> Iterator[Fault]:
    """A transition that gears share has one place on one side, which they share too."""
    before, after = net.net.preset[event], net.net.postset[event]
    called = net.net.transitions[event].name
    if not before or not after:
        kind = "missing consumer" if before else "missing producer"
        side = "leads to" if before else "waits for"
        yield fault(kind, f"transition {called} {side} no place", transitions=[event])
    elif len(before) > 1 or len(after) > 1:
        joins = len(before) > 1
        shared = after[0] if joins else before[0]
        other = net.right[shared] if joins else net.left[shared]
        one = len(after if joins else before) == 1
        if one and other >= 0:
            far_in, far_out = len(net.net.preset[other]), len(net.net.postset[other])
            near = len(before if joins else after)
            one = (far_in, far_out) == ((1, near) if joins else (near, 1))
        if not one:
            text = (
                f"{len(before)} places lead to {called} and {len(after)} from it: the gears that"
                " meet there share no one place [a; b]"
            )
            yield fault("no shared place", text, places=before + after, transitions=[event])


def _contracted(net: MarkedNet) -> tuple[list[int], frozenset[int]]:
    """For each transition its node, and the shared places."""
    nodes = list(range(len(net.net.transitions)))
    joint = set()
    for event, before in enumerate(net.net.preset):
        if len(before) > 1:
            place = net.net.postset[event][0]
            nodes[net.right[place]] = event
            joint.add(place)
    return nodes, frozenset(joint)


def _circuits(
    net: MarkedNet, nodes: list[int], edges: dict[int, list[int]]
) -> tuple[list[list[int]], Fault | None]:
    """The circuits by depth-first search, each a list of places; or a place that spoils it."""
    right = net.right
    start = nodes[0]
    entry: dict[int, int] = {start: NONE}
    on_path = {start}
    used = set[int]()
    circuits: list[list[int]] = []
    calls = [(start, iter(edges[start]))]
    while calls:
        node, rest = calls[-1]
        place = next(rest, None)
        if place is None:
            calls.pop()
            on_path.discard(node)
            continue
        after = nodes[right[place]]
        if after not in entry:
            entry[after] = place
            on_path.add(after)
            calls.append((after, iter(edges[after])))
        elif after not in on_path:
            return [], _sideways(net, place)
        else:
            circuit = _climb(net, nodes, entry, place, after)
            if not used.isdisjoint(circuit):
                return [], _twice(net, [p for p in circuit if p in used], place)
            used.update(circuit)
            circuits.append(circuit)
    return circuits, _left_over(net, nodes, entry, used)


def _climb(
    net: MarkedNet, nodes: list[int], entry: dict[int, int], place: int, top: int
) -> list[int]:
    circuit, node = [place], nodes[net.left[place]]
    while node != top:
        circuit.append(entry[node])
        node = nodes[net.left[entry[node]]]
    return circuit[::-1]


def _left_over(
    net: MarkedNet, nodes: list[int], entry: dict[int, int], used: set[int]
) -> Fault | None:
    for node in nodes:
        if node not in entry:
            text = f"{net.net.transitions[node].name} cannot be reached: the net is not connected"
            return fault("gears apart", text, transitions=[node])
    loose = next((p for p in entry.values() if p != NONE and p not in used), None)
    return None if loose is None else _no_circuit(net, loose)


def _no_circuit(net: MarkedNet, place: int) -> Fault:
    text = f"place {net.net.places[place].name} = {notation(net, place)} lies on no circuit"
    return fault("unclosed gear", text, places=[place])


def _sideways(net: MarkedNet, place: int) -> Fault:
    """A second way to a transition, or a way that does not come back."""
    goal, seen = net.left[place], {net.right[place]}
    queue = [net.right[place]]
    for event in queue:
        for q in net.net.postset[event]:
            if net.right[q] not in seen:
                seen.add(net.right[q])
                queue.append(net.right[q])
    return _twice(net, [], place) if goal in seen else _no_circuit(net, place)


def _twice(net: MarkedNet, shared: list[int], place: int) -> Fault:
    more = f" and share {listing(net.net.places[p].name for p in shared)}" if shared else ""
    name = net.net.places[place].name
    text = f"circuits through {name} cross twice{more}: some circuit is no gear"
    return fault("two gears cross twice", text, places=[place, *shared])


def _gear(
    net: MarkedNet, circuit: list[int], joint: frozenset[int]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Places and transitions of a gear, with the shared places put back, a marked place first."""
    places = []
    for place in circuit:
        places.append(place)
        places += [q for q in net.net.postset[net.right[place]] if q in joint]
    first = next((i for i, p in enumerate(places) if net.tokens[p]), places.index(min(places)))
    places = places[first:] + places[:first]
    return tuple(places), tuple(net.left[p] for p in places)
