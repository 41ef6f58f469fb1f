"""Nets with tokens on their places, of any shape, and the theory of marked graphs.

A marked graph is a net in which every place has at most one producer and at most one consumer
(Commoner, Holt, Even and Pnueli, 1971; here a place may lack either). Nothing else in this module
than what says so assumes one. Tokens move by the place/transition rule; on a safe net that is
Definition 3.4, except that a transition with a place in both its preset and its postset never
fires (a 1-gear is dead by Definition 3.4, condition 1).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from factory.nets.gears import Gear, GearNet
from factory.nets.petri import PetriNet

NONE = -1
"""The producer or consumer of a place that has none."""
MANY = -2
"""The producer or consumer of a place that has several."""


@dataclass(frozen=True)
class MarkedNet:
    """(T, P) with m_0, for each place the number of its tokens; it may have choice.

    `gears` are those that are claimed, or () where none are known; `slots` as in `GearNet`, or ().
    Raises ValueError where tokens and places differ in number or some number is negative.
    """

    net: PetriNet
    tokens: tuple[int, ...]
    gears: tuple[Gear, ...] = ()
    slots: tuple[tuple[int, ...], ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if len(self.tokens) != len(self.net.places) or min(self.tokens, default=0) < 0:
            raise ValueError("one number of tokens, not negative, is needed for each place")

    @cached_property
    def left(self) -> tuple[int, ...]:
        """For each place its producer, NONE or MANY."""
        return tuple(_only(place.left) for place in self.net.places)

    @cached_property
    def right(self) -> tuple[int, ...]:
        """For each place its consumer, NONE or MANY."""
        return tuple(_only(place.right) for place in self.net.places)

    @property
    def is_marked_graph(self) -> bool:
        """Whether no place has several producers or several consumers."""
        return MANY not in self.left and MANY not in self.right

    @cached_property
    def blocked(self) -> frozenset[int]:
        """The transitions with a place in both preset and postset: they never fire."""
        both = (set(p.left) & set(p.right) for p in self.net.places if p.left and p.right)
        return frozenset(event for events in both for event in events)

    def enabled(self, event: int) -> bool:
        """Whether m_0 enables the transition."""
        ready = all(self.tokens[p] for p in self.net.preset[event])
        return ready and event not in self.blocked


def marked(net: GearNet | MarkedNet) -> MarkedNet:
    """The net with its initial tokens. A place that `initial` names for each robot in its slots
    has one token; for each further time that it is named, a further one."""
    if isinstance(net, MarkedNet):
        return net
    tokens = [0] * len(net.threaded.places)
    for place, named in Counter(net.initial).items():
        owners = max(1, len(net.slots[place]))
        tokens[place] = max(1, named - owners + 1)
    return MarkedNet(net.threaded.net, tuple(tokens), net.gears, net.slots)


def _only(events: tuple[int, ...]) -> int:
    if len(events) == 1:
        return events[0]
    return MANY if events else NONE


@dataclass(frozen=True, slots=True)
class TokenFree:
    """What a marked graph's token-free places say about its transitions.

    `order` holds the transitions that token-free places lead to in no circle, each after those it
    waits for; `stuck` those that never fire.
    """

    order: tuple[int, ...]
    stuck: tuple[int, ...]


def token_free(net: MarkedNet) -> TokenFree:
    """The topological order of a marked graph along its places without tokens. Linear."""
    waits = [0] * len(net.net.transitions)
    free = [not tokens for tokens in net.tokens]
    for event in net.blocked:
        waits[event] = 1
    for place, event in enumerate(net.right):
        if free[place] and event != NONE:
            waits[event] += 1
    order = [event for event, count in enumerate(waits) if not count]
    right, postset = net.right, net.net.postset
    for event in order:
        for place in postset[event]:
            after = right[place]
            if free[place] and after != NONE:
                waits[after] -= 1
                if not waits[after]:
                    order.append(after)
    return TokenFree(tuple(order), tuple(e for e, count in enumerate(waits) if count))


def stuck_circuit(net: MarkedNet, stuck: Iterable[int]) -> tuple[int, ...]:
    """The places of a circuit that never carries a token, upstream of the stuck transitions: free
    of tokens, or one place that its transition both needs and gives back. The last of the places
    is alone where it has no producer."""
    never = frozenset(stuck)
    event, path, visited = min(never), list[int](), dict[int, int]()
    while event not in visited:
        visited[event] = len(path)
        place = _barren(net, event, never)
        path.append(place)
        if net.left[place] in (event, NONE):
            return (place,)
        event = net.left[place]
    return tuple(reversed(path[visited[event] :]))


def _barren(net: MarkedNet, event: int, never: frozenset[int]) -> int:
    """A place of the preset that will never be marked, or that loops."""
    places = net.net.preset[event]
    if event in net.blocked:
        return next(p for p in places if net.left[p] == event)
    before = ((p, net.left[p]) for p in places if not net.tokens[p])
    return next(p for p, producer in before if producer == NONE or producer in never)


def dead_ends(net: MarkedNet) -> tuple[int, ...]:
    """The places with a consumer but no producer: what they feed stops (marked graphs)."""
    pairs = enumerate(zip(net.left, net.right, strict=True))
    return tuple(p for p, (before, after) in pairs if before == NONE and after != NONE)


@dataclass(frozen=True, slots=True)
class Bound:
    """Whether a place of a marked graph can hold two tokens.

    `firings`: how often each transition fires to get there, None where that is impossible;
    `circuit`: where a circuit with at most one token forbids it, the circuit's places; `work` done.
    """

    firings: Mapping[int, int] | None
    circuit: tuple[int, ...] = ()
    work: int = 0


def overfill(net: MarkedNet, place: int, stuck: frozenset[int]) -> Bound:
    """The least firings that put a second token on a place of a marked graph, found backwards.

    To fire its producer k times without its consumer, an event at distance d in tokens upstream
    must fire k - d times; that fails where the consumer, or a stuck event, is nearer than k.
    """
    needed, producer = 2 - net.tokens[place], net.left[place]
    if needed <= 0:
        return Bound({})
    if producer == NONE:
        return Bound(None)
    left, tokens, preset = net.left, net.tokens, net.net.preset
    distance: dict[int, int] = {}
    onward = {producer: place}
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
                if far < needed and left[q] == NONE:
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
            for p in net.net.preset[event]:
                tokens[p] -= 1
            for p in net.net.postset[event]:
                tokens[p] += 1
                if left.get(net.right[p]):
                    ready.append(net.right[p])
    if any(left.values()):
        raise ValueError("the events cannot all fire that often")
    return tuple(sequence)


def least_tokens(net: MarkedNet, source: int) -> list[int | None]:
    """For each transition the least number of tokens on a path to it from `source`, None where
    there is no path (marked graphs). One search by levels: a 0-1 BFS where m_0 is safe."""
    found: list[int | None] = [None] * len(net.net.transitions)
    levels = {0: [source]}
    right, tokens, postset = net.right, net.tokens, net.net.postset
    while levels:
        level = min(levels)
        for event in levels[level]:
            if found[event] is not None:
                continue
            found[event] = level
            for p in postset[event]:
                if right[p] != NONE and found[right[p]] is None:
                    levels.setdefault(level + tokens[p], []).append(right[p])
        del levels[level]
    return found


def components(net: MarkedNet) -> list[int]:
    """For each transition the number of its weakly connected component."""
    parent = list(range(len(net.net.transitions)))

    def root(event: int) -> int:
        while parent[event] != event:
            parent[event] = parent[parent[event]]
            event = parent[event]
        return event

    for place in net.net.places:
        events = place.left + place.right
        for event in events[1:]:
            parent[root(event)] = root(events[0])
    return [root(event) for event in range(len(parent))]
