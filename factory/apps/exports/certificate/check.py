"""Checking a certificate from the document alone, in linear time.

The checker shares no code with the writer: any program that reads JSON can do the same. A property
that is not claimed must have a reason, which is not checked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import networkx as nx

from factory.apps.exports.certificate.listing import (
    CLAIMS,
    SCHEMA,
    TRAIN,
    Net,
    Rows,
    Section,
    digest,
    number,
)


def check_certificate(document: object) -> list[str]:
    """The faults of a certificate, [] if it proves all its claims."""
    return list(_checked("the certificate", _check(document)))


def _checked(where: str, faults: Iterator[str]) -> Iterator[str]:
    """The faults; where the search for them fails, that the part is not of the documented form."""
    try:
        yield from faults
    except KeyError as error:
        yield f"{where} is not of the documented form: {error} is missing"
    except (TypeError, IndexError, ValueError, AttributeError, OverflowError):
        yield f"{where} is not of the documented form"


def _check(document: Any) -> Iterator[str]:
    if document["schema"] != SCHEMA:
        yield f"schema {document['schema']} is not {SCHEMA}"
    if document["digest"] != digest(document):
        yield "the digest is not that of the document"
    net = Net(document["net"], document["robots"])
    faults = list(net.faults())
    yield from faults
    if not faults:
        for claim in (*CLAIMS, TRAIN) if TRAIN in document else CLAIMS:
            yield from _checked(claim, _claim(net, claim, document))


def _claim(net: Net, claim: str, document: Section) -> Iterator[str]:
    section = document[claim]
    if section["holds"] is True:
        yield from _PROOFS[claim](net, section, document)
    elif section["holds"] not in (False, None) or not section["reason"]:
        yield f"{claim}: holds is {section['holds']!r}, without a reason"


def _prove_gear_net(net: Net, section: Section, document: Section) -> Iterator[str]:
    """Definition 3.6: replay the order in which the gears are added."""
    if not all(map(net.closed, net.robots)):
        yield "gear_net: some robot's gear is no cycle (Definition 3.5)"
        return
    order = [number(step["gear"]) for step in section["order"]]
    if sorted(order) != list(range(len(net.robots))) or not order:
        yield "gear_net: the order does not add every gear once"
        return
    at_place: Rows = [[] for _ in net.names]
    passing = [0] * len(net.events)
    for step in section["order"]:
        robot = net.robots[step["gear"]]
        if step is not section["order"][0]:
            yield from _added(net, step, at_place, passing)
        elif any(step[key] is not None for key in ("place", "a", "b", "c", "exempt")):
            yield f"gear_net: {robot.name} is the first gear, and must not name a place"
        for p, e in zip(robot.places, robot.turns, strict=True):
            at_place[p].append(step["gear"])
            passing[e] += 1
    yield from net.uncovered("gear_net")
    yield from net.wrong_moves("gear_net")


def _added(net: Net, step: Section, at_place: Rows, passing: list[int]) -> Iterator[str]:
    """Conditions (a) and (b) for one gear."""
    robot = net.robots[step["gear"]]
    gear, name = robot.places, robot.name
    old_places = [p for p in gear if at_place[p]]
    old_events = [e for e in robot.turns if passing[e]]
    place, a, b = number(step["place"]), number(step["a"]), number(step["b"])
    if old_places != [place] or net.edge(place) != (a, b) or sorted(old_events) != sorted((a, b)):
        yield f"gear_net: (a) {name} shares more or less than place [a; b] with the gears before"
        return
    meets = at_place[place]
    if sorted(step["meets"]) != sorted(meets) or not passing[a] == passing[b] == len(meets):
        yield f"gear_net: (a) some gear meets {name} outside of the place they share"
    before = gear[gear.index(place) - 1]
    c = net.left[before][0]
    if step["c"] is None:
        if len(gear) != 2 or step["exempt"] != "tool of one operation":
            yield f"gear_net: (b) is demanded of {name}"
    elif step["c"] != c or passing[c] or net.edge(before) != (c, a) or step["exempt"] is not None:
        yield f"gear_net: (b) fails for {name}: c is not new, or [c; a] not its place"


def _prove_gear_train(net: Net, section: Section, document: Section) -> Iterator[str]:
    """Definition 3.6', and Theorem 1: an order in which every gear ascends from its token on."""
    if not net.robots or not all(map(net.closed, net.robots)):
        yield "gear_train: some robot's gear is no cycle (Definition 3.5)"
        return
    yield from net.uncovered("gear_train")
    shared = {p for p, owners in enumerate(net.owners) if len(owners) > 1}
    for robot in net.robots:
        if any({robot.places[i - 1], p} <= shared for i, p in enumerate(robot.places)):
            yield f"gear_train: {robot.name} has no wait of its own before each operation"
    for event, gears in enumerate(net.meeting):
        around = shared & {*net.preset[event], *net.postset[event]}
        if len(gears) > 1 and [net.owners[p] for p in around] != [gears]:
            yield f"gear_train: the gears at {net.events[event]} share more or less than a place"
    if not _connected(net):
        yield "gear_train: the gears are not connected"
    yield from net.wrong_moves("gear_train")
    yield from _ascending(net, section, document)


def _connected(net: Net) -> bool:
    """Whether the gears and the places that they share form a connected graph."""
    graph = nx.Graph(
        (index, ~p) for p, owners in enumerate(net.owners) if owners[1:] for index in owners
    )
    graph.add_nodes_from(range(len(net.robots)))
    return bool(nx.is_connected(graph))


def _ascending(net: Net, section: Section, document: Section) -> Iterator[str]:
    """Whether every robot's transitions, from its one token on, ascend in the order."""
    if section["order"] is None:
        if document["live"]["holds"] is True:
            yield "gear_train: a live train has an order"
        return
    rank = {str(name): step for step, name in enumerate(section["order"])}
    if sorted(section["order"]) != sorted(net.events):
        yield "gear_train: the order does not name every transition once"
        return
    for robot in net.robots:
        on = [step for step, p in enumerate(robot.places) if net.tokens[p]]
        if len(on) != 1 or net.tokens[robot.places[on[0]]] != 1:
            yield f"gear_train: {robot.name} does not carry one token"
            continue
        turns = robot.turns[on[0] + 1 :] + robot.turns[: on[0] + 1]
        ranks = [rank[net.events[e]] for e in turns]
        for (one, earlier), (other, later) in pairwise(zip(turns, ranks, strict=True)):
            if earlier >= later:
                names = f"{net.events[other]} before {net.events[one]}"
                yield f"gear_train: the order has {names}, which {robot.name} does after it"
                break


def _prove_safe(net: Net, section: Section, document: Section) -> Iterator[str]:
    """Each place lies on a robot's gear, a circuit with at most one token."""
    closed = [robot.places if net.closed(robot) else [] for robot in net.robots]
    good = [set(row) if sum(net.tokens[p] for p in row) <= 1 else set() for row in closed]
    cover = [number(c) for c in section["cover"]]
    if len(cover) != len(net.names):
        yield "safe: the cover does not name one gear for each place"
    elif not all(0 <= c < len(good) and p in good[c] for p, c in enumerate(cover)):
        yield "safe: a place is not on its gear of the cover, or that gear has two tokens"


def _prove_live(net: Net, section: Section, document: Section) -> Iterator[str]:
    """The token-free places, in an order in which each comes after those it waits for."""
    if not net.marked_graph():
        yield "live: an order of places is no proof for a net with choice"
        return
    order = [number(p) for p in section["order"]]
    empty = [p for p, tokens in enumerate(net.tokens) if not tokens]
    if sorted(order) != empty:
        yield "live: the order does not name every place without token once"
        return
    rank = {p: i for i, p in enumerate(order)}
    for event, (before, after) in enumerate(zip(net.preset, net.postset, strict=True)):
        last = max((rank[p] for p in before if p in rank), default=-1)
        first = min((rank[p] for p in after if p in rank), default=len(order))
        if last >= first or set(before) & set(after):
            yield f"live: the places around {net.events[event]} are out of order"
    if any(not row and net.right[p] for p, row in enumerate(net.left)):
        yield "live: some place has no producer"


def _prove_reversible(net: Net, section: Section, document: Section) -> Iterator[str]:
    """A live marked graph, each place of which lies on a circuit, so that its connected parts are
    strongly connected (Murata 1989, Theorem 21): this follows from the proofs of live and safe."""
    if not (document["live"]["holds"] is True and document["safe"]["holds"] is True):
        yield "reversible: this follows for nets that are live, and safe by their gears, only"


def _prove_legal(net: Net, section: Section, document: Section) -> Iterator[str]:
    """Each gear is marked once, and f_m is a bijection onto the robots."""
    marked = [number(p) for p in section["marked"]]
    if len(marked) != len(net.robots):
        yield "legal: not every robot has its place"
        return
    pairs = zip(net.robots, marked, strict=True)
    lost = [robot for robot, p in pairs if robot.initial != p or not net.marked_once(robot)]
    for robot in lost:
        yield f"legal: {robot.name} is not marked exactly once, where it says"
    if not lost and not net.threaded():
        yield "legal: f_m is no bijection"


_PROOFS: dict[str, Callable[[Net, Section, Section], Iterator[str]]] = {
    "gear_net": _prove_gear_net,
    TRAIN: _prove_gear_train,
    "safe": _prove_safe,
    "live": _prove_live,
    "reversible": _prove_reversible,
    "legal": _prove_legal,
}
