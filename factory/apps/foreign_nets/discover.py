"""Discovery of the gears of a net that does not name them (Definition 3.6, read backwards).

Contract each shared place [a; b], the only output of a and only input of b, to a node. What is left
of a gear net is a digraph in which every edge lies on exactly one simple circuit, and these are the
gears: the biconnected components, each of which is one circuit. Linear.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import networkx as nx

from factory.api import Defect, Gear, MarkedNet
from factory.support.errors import listing
from factory.theory.problem.ids import PlaceId, TransitionId


def discover(net: MarkedNet) -> tuple[tuple[Gear, ...], tuple[Defect, ...]]:
    """The gears of a gear net, named g1, g2, ..., or the reasons for which it is none."""
    if not net.net.places:
        return (), (Defect.no_gear_net("no gear", "the net has no places"),)
    shared = _shared(net)
    against = tuple(islice(_local(net, shared), Defect.MOST))
    if against:
        return (), against
    graph = _contracted(net, shared)
    whole = graph.to_undirected()
    apart = list(nx.connected_components(whole))[1:]
    if apart:
        event = min(node for node in apart[0] if node >= 0)
        name = net.net.transitions[event].name
        text = f"{name} cannot be reached: the net is not connected"
        return (), (Defect.no_gear_net("gears apart", text, transitions=[event]),)
    circuits = []
    for component in nx.biconnected_components(whole):
        part = graph.subgraph(component)
        if any(part.in_degree(node) != 1 or part.out_degree(node) != 1 for node in part):
            return (), (_no_circuit(net, part),)
        circuits.append([~node for node, _ in nx.find_cycle(part) if node < 0])
    gears = sorted(_gear(net, circuit, shared) for circuit in circuits)
    return tuple(Gear(f"g{i}", "", *gear) for i, gear in enumerate(gears, start=1)), ()


def _shared(net: MarkedNet) -> frozenset[int]:
    """The places [a; b] that gears share: the only output of a, the only input of b, and as many
    lead to a as from b."""
    preset, postset = net.net.preset, net.net.postset
    return frozenset(
        place
        for place, (a, b) in enumerate(zip(net.left, net.right, strict=True))
        if a >= 0
        and b >= 0
        and len(postset[a]) == len(preset[b]) == 1 < len(preset[a]) == len(postset[b])
    )


def _local(net: MarkedNet, shared: frozenset[int]) -> Iterator[Defect]:
    """Places and transitions whose neighbourhood cannot be part of a gear net."""
    for place, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
        called = f"place {net.net.places[place].name} = {net.notation(place)}"
        if before == MarkedNet.NONE:
            yield Defect.no_gear_net("missing producer", f"nothing marks {called}", places=[place])
        if after == MarkedNet.NONE:
            yield Defect.no_gear_net(
                "missing consumer", f"nothing takes from {called}", places=[place]
            )
        if MarkedNet.MANY in (before, after):
            text = f"{called} is not of the form [x; y]: the net has choice there"
            yield Defect.no_gear_net("choice", text, places=[place])
        if before == after >= 0:
            text = f"{called} is a 1-gear, which is dead (Definition 3.4)"
            yield Defect.no_gear_net("1-gear", text, places=[place])
    for event, (preset, postset) in enumerate(zip(net.net.preset, net.net.postset, strict=True)):
        called = net.net.transitions[event].name
        if not preset or not postset:
            kind = "missing consumer" if preset else "missing producer"
            side = "leads to" if preset else "waits for"
            yield Defect.no_gear_net(
                kind, f"transition {called} {side} no place", transitions=[event]
            )
        elif (preset[1:] and postset[0] not in shared) or (postset[1:] and preset[0] not in shared):
            text = (
                f"places that lead to {called}: {len(preset)}, from it: {len(postset)}; the gears"
                " that meet there share no one place [a; b]"
            )
            yield Defect.no_gear_net("no shared place", text, (), preset + postset, [event])


def _contracted(net: MarkedNet, shared: frozenset[int]) -> nx.DiGraph:
    """Transitions (from 0) and places (from -1 down), with a and b of each shared place one."""
    node = {net.right[place]: net.left[place] for place in shared}
    graph = nx.DiGraph()
    for place, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
        if place not in shared:
            nx.add_path(graph, (node.get(before, before), ~place, node.get(after, after)))
    return graph


def _no_circuit(net: MarkedNet, part: nx.DiGraph) -> Defect:
    """The defect of a biconnected component that is no circuit: some place lies on none, or
    several."""
    for strong in nx.strongly_connected_components(part):
        if len(strong) == 1 and (place := ~next(iter(strong))) >= 0:
            called = f"place {net.net.places[place].name} = {net.notation(place)}"
            return Defect.no_gear_net(
                "unclosed gear", f"{called} lies on no circuit", places=[place]
            )
    node = next(node for node in part if part.degree(node) > 2)
    places = sorted(~place for place in {*part.predecessors(node), *part.successors(node)})
    names = listing(net.net.places[place].name for place in places)
    text = f"circuits through {names} cross twice: some circuit is no gear"
    return Defect.no_gear_net("two gears cross twice", text, places=places)


def _gear(
    net: MarkedNet, circuit: list[int], shared: frozenset[int]
) -> tuple[tuple[PlaceId, ...], tuple[TransitionId, ...]]:
    """Places and transitions of a gear, with the shared places put back, a marked place first."""
    places = []
    for place in circuit:
        places.append(place)
        places += [q for q in net.net.postset[net.right[place]] if q in shared]
    first = next((i for i, p in enumerate(places) if net.tokens[p]), places.index(min(places)))
    places = places[first:] + places[:first]
    return tuple(map(PlaceId, places)), tuple(net.left[p] for p in places)
