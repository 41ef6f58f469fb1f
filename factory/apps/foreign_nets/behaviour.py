"""The properties of any net: from the structure of a marked graph, else by exploring the markings.

Guarantees, for a marked graph: live where no circuit is free of tokens and every place has a
producer (Commoner et al., Theorem 1); safe where each place lies on a circuit with at most one
token, or its producer cannot fire often enough (Theorem 2); live implies reversible (Murata 1989,
Theorem 21: a marking is reachable where it keeps the tokens of every circuit).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import networkx as nx

from factory.api import Defect, GearNet, GearProof, MarkedNet, Verdict
from factory.apps.foreign_nets.discover import discover
from factory.apps.foreign_nets.explore import LIMIT, Exploration, explore
from factory.support.collector import collector_paused
from factory.support.errors import Position, listing

WORK = 5_000_000
"""Greatest number of places visited by the search for an unsafe one."""

RUN_DOWN, NAMED = 10_000, 12
"""Greatest number of firings to a deadlock of a marked graph, and of names in a sentence."""


NO_GEARS = "undecided: a legal marking marks each gear once, and the net has no gears"


@collector_paused()
def analyse(
    net: GearNet | MarkedNet,
    sources: Mapping[str, Position] | None = None,
    limit: int = LIMIT,
) -> Verdict:
    """The verdict on a net that may come from elsewhere.

    Gears that it claims are checked as `verify` does, otherwise those of a gear net are discovered.
    Without gears there is no legal marking: `legal` and `gear_train` are None. Linear in the net;
    only a net with choice is explored, up to `limit` markings. `sources`: as for `verify`.
    """
    against: tuple[Defect, ...] = ()
    if isinstance(net, MarkedNet) and not net.gears:
        gears, against = discover(net)
        net = net.with_gears(gears) if gears else net
    subject, train, closed = MarkedNet.of(net), None, tuple[bool, ...]()
    if against:
        illegal: tuple[Defect, ...] = (Defect("legal", "undecided", NO_GEARS),)
    else:
        proof = GearProof.of(net)
        closed, train = proof.composition.closed, proof.train
        against, illegal = proof.against, proof.illegal
    if subject.is_marked_graph:
        method, defects = "structure", _of_marked_graph(subject, closed)
    else:
        method, defects = "exploration", _explored(subject, explore(subject, limit))
    return Verdict.of(subject, (*against, *defects, *illegal), train, sources, method)


def _of_marked_graph(net: MarkedNet, closed: Sequence[bool]) -> Iterator[Defect]:
    """The defects of a marked graph as to live, safe and reversible; `closed`: which of its gears
    are cycles."""
    stuck = net.token_free.stuck
    yield from _dying(net, stuck)
    yield from _unsafe(net, closed, frozenset(stuck))
    if stuck or MarkedNet.NONE in net.left or MarkedNet.NONE in net.right:
        yield from _one_way(net, stuck)


def _dying(net: MarkedNet, stuck: tuple[int, ...]) -> Iterator[Defect]:
    """Why a marked graph is not live: a circuit free of tokens, or a place without producer."""
    names = net.net.places
    if stuck:
        circuit = net.stuck_circuit(stuck)
        events = tuple(net.right[p] for p in circuit)
        shown = listing(names[p].name for p in circuit)
        text, kind = f"the circuit through {shown} carries no token", "token-free circuit"
        if net.left[circuit[0]] == MarkedNet.NONE:
            text, kind = f"nothing ever marks place {shown}", "missing producer"
        elif events[0] in net.blocked:
            text = f"place {shown} is before and after its transition, which is dead (Def. 3.4)"
            kind = "1-gear"
        if (firing := run_down(net)) is not None:
            text += f"; {_stopped(net, firing)}"
        yield Defect("live", kind, text, (), circuit, events)
        return
    for p in dead_ends(net)[:1]:
        text = f"nothing marks place {names[p].name} again once its tokens are gone"
        if (firing := run_down(net)) is not None:
            text += f"; {_stopped(net, firing)}"
        yield Defect("live", "missing producer", text, (), (p,), (net.right[p],))


def _unsafe(net: MarkedNet, closed: Sequence[bool], stuck: frozenset[int]) -> Iterator[Defect]:
    """A place of a marked graph that can hold two tokens, with the firings that put them there."""
    covered = net.cover(closed)
    work = 0
    for place, gear in enumerate(covered):
        if gear != MarkedNet.NONE:
            continue
        bound = overfill(net, place, stuck)
        if bound.firings is not None:
            firing = play(net, bound.firings)
            text = f"place {net.net.places[place].name} holds two tokens {_after(net, firing)}"
            yield Defect("safe", "two tokens", text, (), (place,), firing)
            return
        work += bound.work
        for other in bound.circuit:
            covered[other] = max(covered[other], 0)
        if work > WORK:
            text = f"the search for a place with two tokens stopped after {WORK} steps"
            yield Defect("safe", "undecided", text)
            return


@dataclass(frozen=True, slots=True)
class Bound:
    """Whether a place of a marked graph can hold two tokens.

    `firings`: how often each transition fires to get there, None where that is impossible;
    `circuit`: where a circuit with at most one token forbids it, the circuit's places; `work` done.
    """

    firings: Mapping[int, int] | None
    circuit: tuple[int, ...] = ()
    work: int = 0


def overfill(net: MarkedNet, place: int, stuck: frozenset[int] = frozenset()) -> Bound:
    """The least firings that put a second token on a place of a marked graph, found backwards.

    To fire its producer k times without its consumer, an event at distance d in tokens upstream
    must fire k - d times; that fails where the consumer, or a stuck event, is nearer than k.
    """
    needed, producer = 2 - net.tokens[place], net.left[place]
    if needed <= 0:
        return Bound({})
    if producer == MarkedNet.NONE:
        return Bound(None)
    left, tokens, preset = net.left, net.tokens, net.net.preset
    distance: dict[int, int] = {}
    onward: dict[int, int] = {producer: place}
    levels: list[list[tuple[int, int]]] = [[(producer, place)], []]
    work = 0
    for level in range(needed):
        for event, via in levels[level]:
            if event in distance:
                continue
            distance[event], onward[event] = level, via
            if event in stuck:
                return Bound(None, (), work)
            if event == net.right[place]:
                return Bound(None, _back(net, onward, event, place), work)
            for q in preset[event]:
                work += 1
                far = level + tokens[q]
                if far < needed and left[q] == MarkedNet.NONE:
                    return Bound(None, (), work)
                if far < needed:
                    levels[far].append((left[q], q))
    return Bound({event: needed - far for event, far in distance.items()}, (), work)


def _back(net: MarkedNet, onward: Mapping[int, int], event: int, place: int) -> tuple[int, ...]:
    """The circuit from the consumer of a place back to the place."""
    circuit: list[int] = []
    while not circuit or circuit[-1] != place:
        circuit.append(onward[event])
        event = net.right[onward[event]]
    return tuple(circuit)


def play(net: MarkedNet, firings: Mapping[int, int]) -> tuple[int, ...]:
    """A sequence from m_0 in which each event fires as often as said (marked graphs).

    Raises ValueError where there is none.
    """
    left, tokens, sequence = dict(firings), list(net.tokens), list[int]()
    ready = [event for event, count in left.items() if count]
    while ready:
        event = ready.pop()
        while left.get(event) and all(tokens[p] for p in net.net.preset[event]):
            left[event] -= 1
            sequence.append(event)
            net.fire(tokens, event)
            after = (net.right[p] for p in net.net.postset[event])
            ready += (e for e in after if left.get(e))
    if any(left.values()):
        raise ValueError("the events cannot all fire that often")
    return tuple(sequence)


def run_down(net: MarkedNet) -> tuple[int, ...] | None:
    """A sequence from m_0 after which nothing is enabled any more; None where a marked graph has
    none of at most RUN_DOWN firings: what is enabled in one stays so until it fires, so each way to
    fire comes as far."""
    tokens, firing = list(net.tokens), list[int]()
    ready = [event for event in range(len(net.net.transitions)) if event not in net.blocked]
    while ready:
        event = ready.pop()
        if not all(tokens[p] for p in net.net.preset[event]):
            continue
        if len(firing) == RUN_DOWN:
            return None
        firing.append(event)
        net.fire(tokens, event)
        after = [net.right[p] for p in net.net.postset[event]]
        ready += [event, *(e for e in after if e != MarkedNet.NONE and e not in net.blocked)]
    return tuple(firing)


def _after(net: MarkedNet, firing: Sequence[int]) -> str:
    """A firing sequence in words: `after a, b`."""
    names = [net.net.transitions[event].name for event in firing]
    if len(names) > NAMED:
        left = len(names) - NAMED
        names[NAMED // 2 : -NAMED // 2] = [f"... ({left} more: --json) ..."]
    return f"after {', '.join(names)}" if names else "initially"


def _stopped(net: MarkedNet, firing: Sequence[int]) -> str:
    """A deadlock in words: the firing sequence, and the places of the tokens after it."""
    pairs = zip(net.net.places, net.after(firing), strict=True)
    where = [place.name for place, count in pairs if count]
    held = f", with tokens in {listing(where)}" if where else ""
    return f"{_after(net, firing)} nothing is enabled any more{held}"


def _one_way(net: MarkedNet, stuck: tuple[int, ...]) -> Iterator[Defect]:
    """An enabled transition connected to something that fires finitely often: in a component that
    repeats at all, all fire equally often."""
    graph, finite = nx.Graph(), set(stuck)
    for place in net.net.places:
        nx.add_path(graph, place.left + place.right)
        if not place.left or not place.right:
            finite.update(place.left + place.right)
    ending = {e for part in nx.connected_components(graph) if part & finite for e in part}
    for event in islice((e for e in net.enabled(net.tokens) if e in ending), 1):
        yield Defect.no_way_back(net, event)


def _explored(net: MarkedNet, exploration: Exploration) -> Iterator[Defect]:
    """The defects that an exploration shows, and the properties that it leaves undecided."""
    names, events = net.net.places, net.net.transitions
    text = f"undecided: {exploration.markings} markings were explored, and there are more"
    if exploration.deadlock is not None:
        reason = _stopped(net, exploration.deadlock)
        yield Defect("live", "deadlock", reason, transitions=exploration.deadlock)
    elif exploration.starved is not None:
        firing, event = exploration.starved
        reason = f"{_after(net, firing)} {events[event].name} can never fire again"
        yield Defect("live", "dead transition", reason, transitions=firing or (event,))
    elif not exploration.complete:
        yield Defect("live", "undecided", text)
    if exploration.unsafe is not None:
        firing, place = exploration.unsafe
        reason = f"place {names[place].name} holds two tokens {_after(net, firing)}"
        yield Defect("safe", "two tokens", reason, (), (place,), firing)
    elif not exploration.complete:
        yield Defect("safe", "undecided", text)
    if one_way := exploration.one_way or exploration.deadlock:
        reason = f"{_after(net, one_way)} the initial marking is unreachable"
        yield Defect("reversible", "no way back", reason, transitions=one_way)
    elif not exploration.complete:
        yield Defect("reversible", "undecided", text)


def dead_ends(net: MarkedNet) -> tuple[int, ...]:
    """The places with a consumer but no producer: what they feed stops (marked graphs)."""
    none, pairs = MarkedNet.NONE, enumerate(zip(net.left, net.right, strict=True))
    return tuple(p for p, (before, after) in pairs if before == none and after != none)
