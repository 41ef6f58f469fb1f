"""Live, safe and reversible: from the structure of a marked graph, else by exploring the markings.

Guarantees, for a marked graph: live where no circuit is free of tokens and every place has a
producer (Commoner et al., Theorem 1); safe where each place lies on a circuit with at most one
token, or its producer cannot fire often enough (Theorem 2); live implies reversible (Murata 1989,
Theorem 21: a marking is reachable where it keeps the tokens of every circuit).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

from factory.foreign_nets.explore import LIMIT, Exploration, explore
from factory.nets.marked import (
    NONE,
    MarkedNet,
    components,
    dead_ends,
    overfill,
    play,
    stuck_circuit,
    token_free,
)
from factory.nets.verdict import Fault, listing

WORK = 5_000_000
"""How many places the search for an unsafe one may look at."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """Live, safe and reversible, with what speaks against them and how it was found."""

    live: bool | None
    safe: bool | None
    reversible: bool | None
    faults: tuple[Fault, ...]
    method: str


def behaviour(net: MarkedNet, closed: Sequence[bool] = (), limit: int = LIMIT) -> Behaviour:
    """How the net behaves from m_0. `closed` says which of `net.gears` are cycles of the net."""
    if not net.is_marked_graph:
        return _explored(net, limit)
    stuck = token_free(net).stuck
    dying = _dying(net, stuck)
    overfull = _unsafe(net, closed, frozenset(stuck))
    open_ended = NONE in net.left or NONE in net.right
    one_way = _one_way(net, stuck) if stuck or open_ended else ()
    safe = None if any(f.kind == "undecided" for f in overfull) else not overfull
    return Behaviour(not dying, safe, not one_way, (*dying, *overfull, *one_way), "structure")


def _dying(net: MarkedNet, stuck: tuple[int, ...]) -> tuple[Fault, ...]:
    """Why a marked graph is not live: a circuit free of tokens, or a place without producer."""
    names = net.net.places
    if stuck:
        circuit = stuck_circuit(net, stuck)
        events = tuple(net.right[p] for p in circuit)
        shown = listing(names[p].name for p in circuit)
        if net.left[circuit[0]] == NONE:
            text, kind = f"nothing ever marks place {shown}", "missing producer"
        elif events[0] in net.blocked:
            text = f"place {shown} is before and after its transition, which is dead (Def. 3.4)"
            kind = "1-gear"
        else:
            text, kind = f"the circuit through {shown} carries no token", "token-free circuit"
        return (Fault("live", kind, text, (), circuit, events),)
    ends = dead_ends(net)
    return tuple(
        Fault(
            "live",
            "missing producer",
            f"nothing marks place {names[p].name} again once its tokens are gone",
            (),
            (p,),
            (net.right[p],),
        )
        for p in ends[:1]
    )


def _unsafe(net: MarkedNet, closed: Sequence[bool], stuck: frozenset[int]) -> tuple[Fault, ...]:
    """A place of a marked graph that can hold two tokens, with the firings that put them there."""
    covered = cover(net, closed)
    work = 0
    for place, gear in enumerate(covered):
        if gear != NONE:
            continue
        bound = overfill(net, place, stuck)
        if bound.firings is not None:
            return (_two_tokens(net, place, play(net, bound.firings)),)
        work += bound.work
        for other in bound.circuit:
            covered[other] = max(covered[other], 0)
        if work > WORK:
            text = f"the search for a place with two tokens stopped after {WORK} steps"
            return (Fault("safe", "undecided", text),)
    return ()


def _two_tokens(net: MarkedNet, place: int, firing: tuple[int, ...]) -> Fault:
    name = net.net.places[place].name
    when = f"after {len(firing)} firings" if firing else "initially"
    text = f"place {name} holds two tokens {when}"
    return Fault("safe", "two tokens", text, (), (place,), firing)


def cover(net: MarkedNet, closed: Sequence[bool]) -> list[int]:
    """For each place a gear through it that has at most one token and keeps it, or NONE."""
    covered = [NONE] * len(net.tokens)
    tokens = net.tokens
    for number, (gear, good) in enumerate(zip(net.gears, closed, strict=False)):
        if good and sum(tokens[p] for p in gear.places) <= 1:
            for place in gear.places:
                covered[place] = number
    return covered


def _one_way(net: MarkedNet, stuck: tuple[int, ...]) -> tuple[Fault, ...]:
    """An enabled transition connected to something that fires finitely often: in a component that
    repeats at all, all fire equally often."""
    member = components(net)
    finite = {member[e] for e in stuck}
    for place in net.net.places:
        if not place.left or not place.right:
            finite.update(member[e] for e in place.left + place.right)
    events = (e for e, part in enumerate(member) if part in finite and net.enabled(e))
    return tuple(
        Fault(
            "reversible",
            "no way back",
            f"{net.net.transitions[e].name} can fire, but not so often that the initial marking"
            " returns",
            transitions=(e,),
        )
        for e in islice(events, 1)
    )


def _explored(net: MarkedNet, limit: int) -> Behaviour:
    """The properties of a net with choice, by its markings."""
    found = explore(net, limit)
    faults = list(_found(net, found))
    named = {fault.property for fault in faults if fault.kind != "undecided"}

    def value(name: str) -> bool | None:
        return False if name in named else True if found.complete else None

    return Behaviour(
        value("live"), value("safe"), value("reversible"), tuple(faults), "exploration"
    )


def _found(net: MarkedNet, found: Exploration) -> Iterable[Fault]:
    names, events = net.net.places, net.net.transitions
    if found.deadlock is not None:
        text = f"after {len(found.deadlock)} firings nothing is enabled any more"
        yield Fault("live", "deadlock", text, transitions=found.deadlock)
    elif found.starved is not None:
        firing, event = found.starved
        text = f"after {len(firing)} firings {events[event].name} can never fire again"
        yield Fault("live", "dead transition", text, transitions=firing or (event,))
    elif not found.complete:
        yield _undecided("live", found)
    if found.unsafe is not None:
        firing, place = found.unsafe
        text = f"place {names[place].name} holds two tokens after {len(firing)} firings"
        yield Fault("safe", "two tokens", text, (), (place,), firing)
    elif not found.complete:
        yield _undecided("safe", found)
    one_way = found.one_way or found.deadlock
    if one_way:
        text = f"after {len(one_way)} firings the initial marking is out of reach"
        yield Fault("reversible", "no way back", text, transitions=one_way)
    elif not found.complete:
        yield _undecided("reversible", found)


def _undecided(name: str, found: Exploration) -> Fault:
    text = f"undecided: {found.markings} markings were explored, and there are more"
    return Fault(name, "undecided", text)
