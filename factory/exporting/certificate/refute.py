"""Refutations: whether a property fails as a certificate claims, decided from its listing in linear
time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from graphlib import CycleError, TopologicalSorter

import networkx as nx

from factory.exporting.certificate.listing import Net, Section, number


def refute(net: Net, claim: str, section: Section) -> Iterator[str]:
    """The faults of a claim that the property `claim` fails. That a net is no gear train is shown
    by the failure of `gear_net`."""
    if not section["reason"]:
        yield f"{claim}: fails without a reason"
    elif claim not in _REFUTATIONS or not _REFUTATIONS[claim](net, section):
        yield f"{claim}: the certificate does not show that it fails"


def _not_gear_net(net: Net, section: Section) -> bool:
    return not (composes(net) if net.robots else decomposes(net))


def composes(net: Net) -> bool:
    """Whether the robots' gears compose a gear net: local conditions, and a tree of gears and
    shared places."""
    if not all(map(net.closed, net.robots)):
        return False
    if any(net.uncovered("gear_net")) or any(net.wrong_moves("gear_net")):
        return False
    shared = ((p, len(own)) for p, own in enumerate(net.owners) if len(own) > 1)
    ends = [(e, count) for p, count in shared for e in (net.left[p][0], net.right[p][0])]
    meeting = [(e, len(gears)) for e, gears in enumerate(net.meeting) if len(gears) > 1]
    return sorted(ends) == meeting and bool(nx.is_tree(incidence(net)))


def incidence(net: Net) -> nx.Graph:
    """The graph of gears (from 0) and the places that they share (from -1 down)."""
    pairs = ((index, ~p) for p, own in enumerate(net.owners) if own[1:] for index in own)
    graph = nx.Graph(pairs)
    graph.add_nodes_from(range(len(net.robots)))
    return graph


def decomposes(net: Net) -> bool:
    """Whether a net without robots is a gear net: with shared places contracted, it is strongly
    connected, and each of its blocks has as many edges as nodes: a circuit."""
    edges = [edge for edge in map(net.edge, range(len(net.names))) if edge and edge[0] != edge[1]]
    if not edges or len(edges) < len(net.names):
        return False
    node, joint = list(range(len(net.events))), set()
    for event, (before, after) in enumerate(zip(net.preset, net.postset, strict=True)):
        if not before or not after or (len(before) > 1 and len(after) > 1):
            return False
        if len(before) > 1:
            far = net.right[after[0]][0]
            if len(net.preset[far]) != 1 or len(net.postset[far]) != len(before):
                return False
            node[far] = event
            joint.add(after[0])
        if len(after) > 1 and len(net.preset[net.left[before[0]][0]]) != len(after):
            return False
    graph = nx.DiGraph()
    for p, (a, b) in enumerate(edges):
        if p not in joint:
            nx.add_path(graph, (node[a], (p, "in"), (p, "out"), node[b]))
    blocks = [list(block) for block in nx.biconnected_component_edges(graph.to_undirected())]
    circuits = all(len(block) == len({n for edge in block for n in edge}) for block in blocks)
    return circuits and bool(nx.is_strongly_connected(graph))


def _not_legal(net: Net, section: Section) -> bool:
    """Whether some gear is not marked once, or a marked place acts on others than start there."""
    return not (all(map(net.marked_once, net.robots)) and net.threaded())


def _not_safe(net: Net, section: Section) -> bool:
    tokens = play(net, section["firing"])
    return tokens is not None and tokens[number(section["place"])] >= 2


def _not_live(net: Net, section: Section) -> bool:
    """A circuit that is never marked, a place that nothing marks, or a deadlock."""
    circuit = section["circuit"]
    if circuit is None:
        return _stops(net, section["firing"])
    if len(circuit) == 1 and not net.left[circuit[0]]:
        return bool(net.right[circuit[0]])
    loop = len(circuit) == 1
    return net.circuit(circuit) and (loop or not any(net.tokens[p] for p in circuit))


def _not_reversible(net: Net, section: Section) -> bool:
    """A deadlock that is not the start, or a transition of a marked graph that can fire next to
    one that can do so a bounded number of times only."""
    if section["firing"] is not None:
        return _stops(net, section["firing"]) and len(section["firing"]) > 0
    first = number(section["transition"])
    return net.marked_graph() and first in one_way(net)


def _stops(net: Net, firing: list[int]) -> bool:
    """Whether a sequence can fire, and nothing after it."""
    tokens = play(net, firing)
    return tokens is not None and not any(
        enabled(net, tokens, event) for event in range(len(net.events))
    )


def one_way(net: Net) -> list[int]:
    """The enabled transitions of a marked graph in a component where something fires finitely
    often: then everything in it does. Without any, the net is reversible: components where all
    goes on return (Murata 1989, Theorem 21), and in the others nothing ever happens."""
    graph, finite = nx.Graph(), _stuck(net)
    for before, after in zip(net.left, net.right, strict=True):
        nx.add_path(graph, (*before, *after))
        if not before or not after:
            finite.update(before + after)
    ending = {e for part in nx.connected_components(graph) if part & finite for e in part}
    return [event for event in sorted(ending) if enabled(net, net.tokens, event)]


def _stuck(net: Net) -> set[int]:
    """The transitions of a marked graph that never fire: those that wait for each other, or for
    what nothing marks, and all that wait for these."""
    never, fired = -1, set[int]()
    waits = TopologicalSorter({never: [never]} | {e: [] for e in range(len(net.events))})
    for p, (before, after) in enumerate(zip(net.left, net.right, strict=True)):
        if after and (not net.tokens[p] or before == after):
            waits.add(after[0], *(before or [never]))
    with suppress(CycleError):
        waits.prepare()
    while ready := waits.get_ready():
        fired.update(ready)
        waits.done(*ready)
    return set(range(len(net.events))) - fired


def enabled(net: Net, tokens: list[int], event: int) -> bool:
    """Whether a transition can fire; one with a place before and after it never can."""
    before = net.preset[event]
    return all(tokens[p] for p in before) and not set(before) & set(net.postset[event])


def play(net: Net, firing: list[int]) -> list[int] | None:
    """The tokens after a firing sequence, None where it cannot fire."""
    tokens = list(net.tokens)
    for event in firing:
        if not enabled(net, tokens, number(event)):
            return None
        for p in net.preset[event]:
            tokens[p] -= 1
        for p in net.postset[event]:
            tokens[p] += 1
    return tokens


_REFUTATIONS: dict[str, Callable[[Net, Section], bool]] = {
    "gear_net": _not_gear_net,
    "safe": _not_safe,
    "live": _not_live,
    "reversible": _not_reversible,
    "legal": _not_legal,
}
